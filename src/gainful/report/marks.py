"""Moments that are marked in the figures of the states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..diagnostics import changes
from ..running import Result


def marks_of(result: Result, alarms: Mapping[str, Sequence[float]] | None) -> dict[str, list[float]]:
    """Times of the alarms given and of the sudden changes that the filter found by itself [s], by the state's name."""
    marks = {name: list(times) for name, times in (alarms or {}).items()}
    # A bounded parameter goes by another name in the covariance, which is what watches it.
    names = {}
    for part in result.model.space.parts:
        names |= zip(part.tangent_names, part.names if part.size == part.dof else part.tangent_names, strict=True)
    for each in changes(result):
        marks.setdefault(names[each.state], []).append(each.t)
    return marks
