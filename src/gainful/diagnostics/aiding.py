"""How a network beside a filter was used along a record."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..running import Result
from ..updates import Corrected, Correction
from .learning import parts_of

UNKNOWN = 0.05
"""Share of measurements unlike those of training above which the corrections are not to be trusted."""


@dataclasses.dataclass(frozen=True)
class AidingUse:
    """How the corrections of a network were used.

    Attributes:
        measured: rows at which the network was asked.
        unmeasured: rows at which nothing was measured and it was not.
        passed: share of the measured rows whose correction was let through.
        unknown: share of them at which the network had learned nothing.
    """

    measured: int
    unmeasured: int
    passed: float
    unknown: float

    @property
    def warning(self) -> str:
        """What to think of it, or nothing."""
        if not self.unknown > UNKNOWN:
            return ""
        return (
            f"{100 * self.unknown:.3g} % of the measurements are unlike those the network was trained on: train it on more "
            "records, or on such as these"
        )


def aiding_use(result: Result) -> tuple[AidingUse, ...]:
    """How each `Corrected` update in the filter used its network; nothing if there is none.

    Args:
        result: of a run.
    """
    updates = parts_of(result.estimator, Corrected)
    out = []
    for memory in parts_of(result.memories, Correction)[: len(updates)]:
        measured = result.seen.any(axis=1) & result.log.kept
        asked = int(measured.sum())
        shares = [
            float(np.asarray(flag)[measured].mean()) if asked else 0.0 for flag in (memory.passed, memory.flagged)
        ]
        out.append(AidingUse(asked, int(result.log.kept.sum()) - asked, *shares))
    return tuple(out)
