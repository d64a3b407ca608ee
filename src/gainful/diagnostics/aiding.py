"""How a network beside a filter was used along a record, and what it was worth."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from ..running import Result
from ..updates import Corrected, Correction
from .learning import parts_of
from .rows import judged_rows

UNKNOWN = 0.05
"""Share of measurements unlike those of training above which the corrections are not to be trusted."""
_STRETCHES = 20
"""Stretches of a record whose means are compared."""


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


@dataclasses.dataclass(frozen=True)
class AidingGain:
    """What aiding changed for one state or one signal, along one record.

    Attributes:
        name: of the state, or of the signal whose next reading is predicted.
        what: "error" against truth, or "prediction" of the next reading.
        before: root mean square without aiding.
        after: with it.
        low: lower end of the 95 % interval of the mean square's decrease.
        high: upper end.
    """

    name: str
    what: Literal["error", "prediction"]
    before: float
    after: float
    low: float
    high: float

    @property
    def helped(self) -> bool | None:
        """Whether aiding helped; None if the record does not tell."""
        return True if self.low > 0 else False if self.high < 0 else None


def aiding_gain(aided: Result, plain: Result) -> tuple[AidingGain, ...]:
    """What aiding changed: the errors of states that have a truth, and the predictions of the next readings.

    The interval is that of the means over 20 stretches of the record, as errors of neighbouring rows are alike. An open-loop
    correction changes no prediction, and so shows only against truth.

    Args:
        aided: the run with a network or with maps of sensors.
        plain: the same record without.

    Source: Schmeiser (1982), Operations Research 30(3):556-568, for batch means.
    """
    out = []
    rows = judged_rows(aided) & judged_rows(plain)
    pairs = [("error", aided.model.space.tangent_names, plain.error(), aided.error(), rows[:, None])]
    seen = aided.seen & rows[:, None]
    pairs.append(("prediction", aided.model.output.tangent_names, plain.residual, aided.residual, seen))
    for what, names, before, after, counted in pairs:
        for j, name in enumerate(names):
            known = np.broadcast_to(counted, before.shape)[:, j] & np.isfinite(before[:, j]) & np.isfinite(after[:, j])
            a, b = before[known, j] ** 2, after[known, j] ** 2
            if len(a) < 2 * _STRETCHES or np.array_equal(a, b):
                continue
            means = np.array([each.mean() for each in np.array_split(a - b, _STRETCHES)])
            reach = float(stdtrit(_STRETCHES - 1, 0.975)) * means.std(ddof=1) / math.sqrt(_STRETCHES)
            middle = float(np.mean(a - b))
            sizes = (math.sqrt(float(a.mean())), math.sqrt(float(b.mean())))
            out.append(AidingGain(name, what, *sizes, middle - reach, middle + reach))  # type: ignore[arg-type]  # one of the two
    return tuple(out)


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
