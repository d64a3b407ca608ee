"""Ways to find the parameters of an equation in a recording, by name."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, Status, did_you_mean
from ..regression.batch import (
    Fit,
    bias_compensated_least_squares,
    generalized_total_least_squares,
    least_squares,
    total_least_squares,
)
from ..regression.instruments import instrumental_variables, instrumented
from ..regression.uncertainty import errors_in_variables_scores, sandwich_covariance
from .equations import Equation
from .free_run import FreeRun, free_run_of
from .recordings import Recording
from .windows import Window, make_window

Base = Literal["ls", "tls", "gtls", "bcls", "iv", "rls", "rtls", "frtls"]
BASES: dict[Base, str] = {
    "ls": "least squares",
    "tls": "total least squares, equal noise in all columns",
    "gtls": "total least squares, noise of each row",
    "bcls": "least squares less the noise",
    "iv": "instrumental variables",
    "rls": "recursive least squares",
    "rtls": "recursive total least squares",
    "frtls": "total least squares by line search",
}
"""Methods by name; each with "weak-" in front goes against a test function in place of differences."""
RECURSIVE = ("rls", "rtls", "frtls")
METHODS = (*BASES, *(f"weak-{base}" for base in BASES))
_ROUNDS, _SETTLED = 20, 1e-6
"""Rounds of simulated instruments, and the change relative to sigma at which they stop."""


def split(method: str) -> tuple[Base, bool]:
    """A method's base and whether it is weak.

    Raises:
        ConfigError: no such method.
    """
    if method not in METHODS:
        raise ConfigError(f"method: {method!r} is not known; {did_you_mean(method, METHODS)}")
    base = method.removeprefix("weak-")
    return base, method != base  # type: ignore[return-value]  # one of the bases


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """An equation and a recording, and the rows that methods make of them, each found once.

    Attributes:
        equation: with the parameters.
        recording: of its signals.
        width: samples of the test function of weak methods, odd.
        lag: rows over which residuals may be correlated; by default about twice what a row reaches over, or more for long
            records.
    """

    equation: Equation
    recording: Recording
    width: int
    lag: int | None = None
    _known: dict[Any, Any] = dataclasses.field(default_factory=dict, repr=False)

    def _once(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    @functools.cached_property
    def noise(self) -> dict[str, float]:
        """Standard deviation of the noise of the mean of all sensors, by signal, as far as it is known.

        A regressand that all sensors share has what is common to the residuals of two sensors.
        """
        known = self.recording.mean_noise()
        bare = self.equation.regressand.pieces[0].bare
        name = bare.signal if len(self.equation.regressand.pieces) == 1 and bare is not None else ""
        alone = not any(name in term.signals for term in self.equation.terms.values())
        if self.recording.sensors > 1 and name and name not in known and alone and bare.order == 0:  # type: ignore[union-attr]
            weak = self.weak_helps
            shared = float(self.fit("weak-iv" if weak else "iv").noise_scale)
            taps = self.window(weak).taps[0] if weak else np.ones(1)
            known[name] = float(np.sqrt(max(shared, 0.0) / (taps @ taps)))
        return known

    @functools.cached_property
    def free_run(self) -> FreeRun | None:
        """The equation solved for one of its signals, if it can be."""
        return free_run_of(self.equation)

    @property
    def weak_helps(self) -> bool:
        """Whether there are derivatives, and a test function can take them all."""
        return self.equation.order > 0 and all(term.weak for term in self.equation.columns)

    def window(self, weak: bool) -> Window:
        """Weights over neighbouring samples."""
        return make_window(self.recording.dt, self.width, weak=weak)

    def rows(self, weak: bool, half: int | None = None) -> Float[np.ndarray, "T p"]:
        """Rows `[h, z]` of the mean of all sensors, or of every other one."""

        def make() -> Float[np.ndarray, "T p"]:
            of = self.recording
            return self.equation.rows(of.mean(half), of.dt, self.window(weak), of.mean_noise(half))

        return self._once(("rows", weak, half), make)

    def row_noise(self, weak: bool) -> Float[np.ndarray, "p p"] | None:
        """Mean covariance of the noise of the mean sensor's rows; None where no noise is known."""
        if not any(self.noise.values()):
            return None

        def make() -> Float[np.ndarray, "p p"]:
            of = self.recording
            each = self.equation.noise(of.mean(), of.dt, self.window(weak), self.noise)
            whole = self.whole(weak) & np.isfinite(each).all(axis=(1, 2))
            return each[whole].mean(axis=0) if whole.any() else np.full(each.shape[1:], np.nan)

        return self._once(("row_noise", weak), make)

    def whole(self, weak: bool) -> Bool[np.ndarray, "T"]:
        """Which rows of the mean sensor are."""
        return np.asarray(np.isfinite(self.rows(weak)).all(axis=1))

    def reach(self, weak: bool) -> int:
        """Rows over which residuals may be correlated."""
        if self.lag is not None:
            return self.lag
        own = 2 * self.window(weak).width if weak or self.equation.order else self.equation.lag
        # Newey and West's rule for what is not known of the residuals.
        return max(own, int(4 * (len(self.recording) / 100) ** (2 / 9)))

    def offered(self) -> list[str]:
        """Methods that can be compared on this record."""
        bases = ["ls", "tls"]
        if self.recording.sensors > 1 or self.free_run is not None:
            bases.append("iv")
        if any(self.noise.values()):
            bases += ["gtls", "bcls"]
        weak = [f"weak-{base}" for base in bases if base != "tls"] if self.weak_helps else []
        return [*weak, *bases]

    def fit(self, method: str, *, independent: bool = False) -> Fit:
        """The parameters by a method that takes all rows at once.

        Args:
            method: not a recursive one.
            independent: take the residuals of different rows for independent, in the covariance.

        Raises:
            ConfigError: no such method, or one that wants a second sensor or the noise of signals.
        """
        lag = 0 if independent else self.reach(split(method)[1])
        return self._once(("fit", method, lag), lambda: self._fit(*split(method), lag))

    def _fit(self, base: str, weak: bool, lag: int) -> Fit:
        rows = self.rows(weak)
        whole = self.whole(weak)
        table, count = jnp.asarray(np.where(whole[:, None], rows, 0.0)), float(whole.sum())
        S = table.T @ table
        if base == "iv":
            return self._by_instruments(weak, lag)
        if base == "ls":
            fit = least_squares(S, count)
            q = table[:, -1] - table[:, :-1] @ fit.theta
            return _with_sandwich(fit, table[:, :-1] * q[:, None], S[:-1, :-1], lag)
        if base == "tls":
            fit, noise = total_least_squares(S, count), jnp.eye(len(S))
        else:
            found = self.row_noise(weak)
            if found is None:
                raise ConfigError(
                    f"method: {base!r} needs the noise of the signals: give it, or a second sensor of the same motion"
                )
            noise = jnp.asarray(found)
            solve = generalized_total_least_squares if base == "gtls" else bias_compensated_least_squares
            fit = solve(S, count * noise, count)
        level = 1.0 if base == "bcls" else fit.noise_scale * (1.0 - (len(S) - 1) / count)
        excess = (S - level * count * noise)[:-1, :-1]
        if base == "bcls":
            q = table[:, -1] - table[:, :-1] @ fit.theta
            pull = (noise @ jnp.append(fit.theta, -1.0))[:-1]
            scores = table[:, :-1] * q[:, None] + jnp.where(whole[:, None], pull, 0.0)
        else:
            scores = errors_in_variables_scores(table, fit.theta, noise)
        return _with_sandwich(fit, scores, excess, lag)

    def _by_instruments(self, weak: bool, lag: int) -> Fit:
        if self.recording.sensors > 1:
            first, second = (jnp.asarray(self.rows(weak, half)) for half in (0, 1))
            return instrumental_variables(first, second, lag=lag)
        run = self.free_run
        if run is None:
            raise ConfigError(
                "method: instrumental variables need a second sensor of the same motion, or an equation that can be run by "
                "itself"
            )
        of, rows = self.recording, jnp.asarray(self.rows(weak))
        fit = self.fit("weak-ls" if weak else "ls")
        for _ in range(_ROUNDS):
            simulated = of.mean() | {run.signal: run(fit.theta, of.mean(), of.dt)}
            bounded = {name: np.where(np.isfinite(each), each, np.nan) for name, each in simulated.items()}
            instruments = self.equation.rows(bounded, of.dt, self.window(weak))[:, :-1]
            new = instrumented(rows, jnp.asarray(instruments), lag=lag)
            moved = jnp.max(jnp.abs(new.theta - fit.theta) / jnp.where(new.std > 0, new.std, 1.0))
            fit = new
            if not moved > _SETTLED:
                break
        return fit


def _with_sandwich(fit: Fit, scores: Array, excess: Array, lag: int) -> Fit:
    """The fit with a covariance that asks for no model of the noise."""
    return fit if fit.status != Status.ok else dataclasses.replace(fit, cov=sandwich_covariance(scores, excess, lag))


def default_method(problem: Problem, known: Mapping[str, float]) -> str:
    """What to take where nobody says: two sensors as each other's instruments, else what is known of the noise.

    Args:
        problem: the equation and the recording.
        known: standard deviations of the signals' noise.
    """
    weak = "weak-" if problem.weak_helps else ""
    if problem.recording.sensors > 1:
        return f"{weak}iv"
    return f"{weak}gtls" if all(known.get(name, 0.0) > 0 for name in problem.equation.signals) else f"{weak}ls"
