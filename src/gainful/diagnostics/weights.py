"""How far measurements counted, and whether a filter has shut itself off from one."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import ConfigError
from ..running import Result
from .rows import LEAST_WEIGHT


@dataclasses.dataclass(frozen=True)
class Weighing:
    """How a signal's measurements counted.

    Attributes:
        signal: name of the output.
        mean: mean weight; NaN if it was never measured.
        clipped: share that did not count in full.
        outliers: share that counted less than half.
        locked: time from which most of the last measurements counted less than half [s]; None if that never was.
        most: what most means here.
        window: how many measurements the last ones are.
    """

    signal: str
    mean: float
    clipped: float
    outliers: float
    locked: float | None
    most: float
    window: int

    @property
    def warning(self) -> str:
        """What to think of it, or nothing."""
        if self.locked is None:
            return ""
        return (
            f"more than {100 * self.most:.0f} % of {self.window} measurements of {self.signal} in a row counted less than "
            f"half, first at t = {self.locked:.6g} s: the model or R is wrong, or something failed"
        )


def weighing(result: Result, *, window: int = 200, most: float = 0.6) -> tuple[Weighing, ...]:
    """How each signal's measurements counted, and when a filter has shut itself off.

    A robust update that takes more than half of the measurements for outliers no longer follows them: its model is wrong,
    its R too small, or the plant has changed, and its estimates are predictions with a sigma that they do not deserve.

    Args:
        result: of a run; of a smoothed one the filter's weights are judged.
        window: measurements in a row that are judged together.
        most: share of them that must count less than half.

    Raises:
        ConfigError: no such window, or no such share.
    """
    if isinstance(window, bool) or not isinstance(window, int) or window < 1:
        raise ConfigError(f"window: expected a whole number of at least 1, got {window!r}")
    if not 0 < most < 1:
        raise ConfigError(f"most: expected a share between 0 and 1, got {most!r}")
    found = result if result.filtered is None else result.filtered
    kept = found.log.kept
    out = []
    for j, name in enumerate(found.model.output.tangent_names):
        rows = np.flatnonzero(found.seen[:, j] & kept)
        weight = found.weight[rows, j]
        low = weight < LEAST_WEIGHT
        sums = np.concatenate([[0], np.cumsum(low)])
        share = (sums[window:] - sums[:-window]) / window if len(rows) >= window else np.zeros(0)
        locked = np.flatnonzero(share > most)
        out.append(
            Weighing(
                name,
                float(weight.mean()) if len(rows) else float("nan"),
                float((weight < 1.0).mean()) if len(rows) else 0.0,
                float(low.mean()) if len(rows) else 0.0,
                float(found.t[rows[locked[0] + window - 1]]) if locked.size else None,
                most,
                window,
            )
        )
    return tuple(out)
