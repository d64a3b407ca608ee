"""How well parameters tell what was not used to find them."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from .equations import Equation
from .free_run import FreeRun
from .recordings import Recording
from .windows import Window


@dataclasses.dataclass(frozen=True)
class Assessment:
    """An equation with given parameters held against a recording.

    Attributes:
        t: times [s] (T,).
        measured: the regressand (T,).
        explained: what the terms make of it (T,).
        signal: that the equation was solved for by itself, empty if it cannot be.
        observed: that signal as measured (T,).
        simulated: as the equation has it from the start, given all others (T,).
    """

    t: Float[np.ndarray, "T"]
    measured: Float[np.ndarray, "T"]
    explained: Float[np.ndarray, "T"]
    signal: str
    observed: Float[np.ndarray, "T"]
    simulated: Float[np.ndarray, "T"]

    @property
    def residual(self) -> float:
        """Root mean square of what the terms do not explain, in the regressand's unit."""
        return _rms(self.measured - self.explained)

    @property
    def explained_share(self) -> float:
        """Share of the regressand's variance that the terms explain; below 0 if they make it worse than its mean does."""
        return _share(self.measured, self.explained)

    @property
    def fit(self) -> float:
        """`1 - |error| / |regressand|`, the measure that toolboxes for identification print."""
        return _fit(self.measured, self.explained)

    @property
    def simulated_fit(self) -> float:
        """The same of the run by itself."""
        return _fit(self.observed, self.simulated)

    @property
    def simulation_error(self) -> float:
        """Root mean square error of the signal run by itself, in its unit; infinite if it ran away, NaN if there is none."""
        return _rms(self.observed - self.simulated)

    @property
    def simulated_share(self) -> float:
        """Share of the signal's variance that the run by itself explains."""
        return _share(self.observed, self.simulated)


def assess(
    equation: Equation, theta: Float[np.ndarray, "n"], recording: Recording, window: Window, run: FreeRun | None = None
) -> Assessment:
    """Hold an equation against a recording, of which the mean of all sensors counts.

    Args:
        equation: whose parameters are given.
        theta: the parameters.
        recording: best one that was not used to find them.
        window: how values and derivatives are taken.
        run: the equation solved for a signal; None if it cannot be.
    """
    signals = recording.mean()
    rows = equation.rows(signals, recording.dt, window)
    nothing = np.full(len(recording), np.nan)
    name = "" if run is None else run.signal
    observed = signals[name] if name else nothing
    simulated = nothing if run is None else run(theta, signals, recording.dt)
    return Assessment(recording.t, rows[:, -1], rows[:, :-1] @ np.asarray(theta), name, observed, simulated)


def _rms(error: Float[np.ndarray, "T"]) -> float:
    known = error[~np.isnan(error)]
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _fit(measured: Float[np.ndarray, "T"], told: Float[np.ndarray, "T"]) -> float:
    size = _rms(np.where(np.isnan(told), np.nan, measured))
    return 1.0 - _rms(measured - told) / size if size > 0 else float("nan")


def _share(measured: Float[np.ndarray, "T"], told: Float[np.ndarray, "T"]) -> float:
    both = ~np.isnan(measured) & ~np.isnan(told)
    if both.sum() < 2:
        return float("nan")
    y, error = measured[both], _rms(measured[both] - told[both])
    spread = float(np.var(y))
    with np.errstate(over="ignore"):
        return 1.0 - error**2 / spread if spread > 0 else float("nan")
