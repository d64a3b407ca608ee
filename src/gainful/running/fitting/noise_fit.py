"""What fitting the noise came to."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from ...filters import AbstractEstimator
from .entries import NoiseEntry

FLAT = 0.5
"""A standard deviation known no better than to this share of itself is not told by the record."""

SINGULAR = 1e-10
"""Directions in which the curvature is smaller than this share of the largest are flat."""


@dataclasses.dataclass(frozen=True)
class FittedEntry:
    """An entry of the noise, before and after.

    Attributes:
        entry: which.
        start: standard deviations before, per step of typical length for Q.
        fitted: standard deviations after.
        factor: fitted over start.
        standard_error: of the fitted standard deviation, as a share of it; infinite where the record tells nothing, None
            where the method gives none or the entry is at a bound.
        limit: for a standard deviation that is at its floor or hardly told: the largest that the record allows with 95 %, as a
            factor on the start; None for others, or where there is no limit.
        bound: "floor" or "ceiling" where the search wanted to go on, else "".
    """

    entry: NoiseEntry
    start: tuple[float, ...]
    fitted: tuple[float, ...]
    factor: float
    standard_error: float | None
    limit: float | None
    bound: str

    @property
    def flat(self) -> bool:
        """Whether the record hardly tells it."""
        return self.standard_error is not None and self.standard_error > FLAT

    @property
    def remark(self) -> str:
        """What to think of it, or nothing."""
        if self.bound == "floor":
            return "at its floor: the record tells no size but a largest one"
        if self.bound == "ceiling":
            return "at its ceiling: the record would have even more"
        return "flat likelihood: the record hardly tells it" if self.flat else ""


@dataclasses.dataclass(frozen=True)
class NoiseFit:
    """Fitted noise, how well it is known, and how well it predicts what it was not fitted to.

    Attributes:
        method: "ml", "em", "moments" or "truth".
        entries: what was fitted.
        estimator: with the fitted noise.
        start: mean log likelihood per fitted row before [nats].
        fitted: the same after.
        held_start: mean log likelihood per row held out, before; NaN without such rows.
        held_fitted: the same after.
        rows: how many were fitted.
        held_rows: how many were held out.
        iterations: of the search.
        converged: whether the search ended by itself.
        path: what the search made small, iteration by iteration.
        step: typical length of a step, for which Q is told [s].
        contamination: share of outliers that the likelihood allows for.
    """

    method: str
    entries: tuple[FittedEntry, ...]
    estimator: AbstractEstimator
    start: float
    fitted: float
    held_start: float
    held_fitted: float
    rows: int
    held_rows: int
    iterations: int
    converged: bool
    path: tuple[float, ...]
    step: float
    contamination: float

    @property
    def states(self) -> dict[str, float]:
        """Factors on the standard deviations of Q, by the name of a state."""
        return self._factors("process")

    @property
    def outputs(self) -> dict[str, float]:
        """Factors on the standard deviations of R, by the name of an output."""
        return self._factors("measurement")

    def _factors(self, kind: str) -> dict[str, float]:
        return {name: each.factor for each in self.entries if each.entry.kind == kind for name in each.entry.names}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the numbers should know."""
        told = [f"{each.entry.label}: {each.remark}" for each in self.entries if each.remark]
        if not self.converged:
            told.append(f"the search had not ended after {self.iterations} iterations")
        if self.held_fitted < self.held_start:
            loss = self.held_start - self.held_fitted
            lost = f"the rows held out are predicted worse than before, by {loss:.3g} nats per row"
            why = {"truth": "noise fitted to the truth makes estimates accurate, not their covariance"}
            told.append(f"{lost}: {why.get(self.method, 'the record changes, or is too short for so many entries')}")
        return tuple(told)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        text = (
            f"log likelihood per row {self.start:.4g} before and {self.fitted:.4g} after over {self.rows} rows fitted"
        )
        if self.held_rows:
            text += f", {self.held_start:.4g} and {self.held_fitted:.4g} over {self.held_rows} held out"
        return text


def relative_errors(curvature: Float[np.ndarray, "n n"], free: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Standard errors of logarithms given second derivatives of a negative log likelihood.

    Args:
        curvature: in all logarithms.
        free: which of them are not at a bound; the others come out NaN.

    Returns:
        Infinite for those along which the likelihood does not curve.
    """
    errors = np.full(len(curvature), np.nan)
    at = np.flatnonzero(free)
    if not at.size:
        return errors
    values, vectors = np.linalg.eigh(curvature[np.ix_(at, at)])
    sound = values > SINGULAR * max(values.max(), 0.0)
    variances = vectors[:, sound] ** 2 @ (1.0 / values[sound])
    lost = (vectors[:, ~sound] ** 2).sum(axis=1) > 1e-6
    errors[at] = np.where(lost, np.inf, np.sqrt(variances))
    return errors
