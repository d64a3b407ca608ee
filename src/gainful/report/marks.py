"""Moments that are marked in the figures of the states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..diagnostics import changes
from ..diagnostics.learning import state_names
from ..running import Result


def marks_of(result: Result, alarms: Mapping[str, Sequence[float]] | None) -> dict[str, list[float]]:
    """Times of the alarms given and of the sudden changes that the filter found by itself [s], by the state's name."""
    marks = {name: list(times) for name, times in (alarms or {}).items()}
    names = state_names(result.model.space)
    for each in changes(result):
        marks.setdefault(names[each.state], []).append(each.t)
    return marks
