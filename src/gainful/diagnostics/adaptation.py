"""What a filter made of the measurement noise that it learned on the way."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..running import Result
from ..updates.noise_factors import Factors
from .learning import parts_of


@dataclasses.dataclass(frozen=True)
class Adaptation:
    """The measurement noise of a signal that a filter has learned.

    Attributes:
        signal: name of the signal.
        factor: on the variance of the model's R at the last row.
        largest: such factor at any row.
        lost_at: when the filter went back to the model's R for good [s]; None if it did not.
    """

    signal: str
    factor: float
    largest: float
    lost_at: float | None

    @property
    def warning(self) -> str:
        """What to think of it, or nothing."""
        if self.lost_at is None:
            return ""
        return (
            f"R of {self.signal} was given up at t = {self.lost_at:.6g} s: it grew {self.largest:.3g} times, "
            "so Q is too small"
        )


def adaptations(result: Result) -> tuple[Adaptation, ...]:
    """What became of each signal's measurement noise, where the filter learns it; nothing where it does not.

    Args:
        result: of a run; of a smoothed one the filter is judged.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> adaptations(gf.run(gf.KalmanFilter(noise=gf.SageHusa()), model, prior, log))[0].lost_at is None
        True
    """
    found = result if result.filtered is None else result.filtered
    out = []
    for memory in parts_of(found.memories, Factors):
        value, lost = np.asarray(memory.value), np.asarray(memory.lost)
        for i, name in enumerate(found.model.output.tangent_names):
            at = np.flatnonzero(lost[:, i])
            given_up = float(found.t[at[0]]) if at.size else None
            last = 1.0 if at.size else float(value[-1, i])
            out.append(Adaptation(name, last, float(value[:, i].max()), given_up))
    return tuple(out)
