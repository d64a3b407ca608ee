"""Parameters of an equation from a recording, with all that is needed to judge them."""

from __future__ import annotations

import dataclasses
import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.special import stdtrit

from ..errors import ConfigError, Status
from ..regression import Identifiability, identifiability, least_squares_bias
from ..regression.batch import Fit
from ..regression.weak_form import WINDOW
from .assessment import Assessment, assess
from .equations import Equation
from .methods import RECURSIVE, Problem, default_method, split
from .recordings import Recording
from .recursion import Track, follow
from .windows import make_window

_LATE = 0.5
"""Samples of lag between sensors from which it is told."""
_SCALE = 2.0
"""Factor between the noise told and the noise found from which it is told."""
_WEAK_EXPLANATION = 0.5
"""Share of the regressand's variance below which the equation is said to explain little."""


@dataclasses.dataclass(frozen=True)
class Identification:
    """Parameters with their intervals, and whether to believe them; made by `identify`.

    Attributes:
        problem: the equation and the recording.
        method: by which the parameters were found.
        theta: the parameters (n,); NaN where the data give none.
        cov: their covariance; for rows whose residuals may be correlated and unequal, unless the method is recursive (n, n).
        status: what became of the method.
        level: of the intervals.
        identifiability: what the record can tell.
        assessment: on the recording itself.
        track: along the recording, of a recursive method.
    """

    problem: Problem
    method: str
    theta: Float[np.ndarray, "n"]
    cov: Float[np.ndarray, "n n"]
    status: Status
    level: float
    identifiability: Identifiability
    assessment: Assessment
    track: Track | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Their names."""
        return self.problem.equation.parameters

    @property
    def std(self) -> Float[np.ndarray, "n"]:
        """Standard deviations of the parameters."""
        return np.sqrt(np.diagonal(self.cov))

    @property
    def reach(self) -> float:
        """Standard deviations from a parameter to either end of its interval.

        Student's t: a variance summed over lags up to L of N rows is known as well as one from 1.5 N / (L + 1) free ones.

        Source: Bartlett (1950), Biometrika 37(1-2):1-16, for the freedom of a smoothed spectrum, here at frequency 0.
        """
        _, weak = split(self.method)
        freedom = 1.5 * self.identifiability.rows / (self.problem.reach(weak) + 1)
        return float(stdtrit(max(freedom, 1.0), 0.5 + 0.5 * self.level))

    @property
    def interval(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Lower and upper ends of the parameters' intervals."""
        return self.theta - self.reach * self.std, self.theta + self.reach * self.std

    @functools.cached_property
    def rivals(self) -> dict[str, Fit]:
        """The same parameters by all other methods that apply, by name."""
        return {name: self.problem.fit(name) for name in self.problem.offered() if name != self.method}

    def check(self, recording: Recording, theta: Float[np.ndarray, "n"] | None = None) -> Assessment:
        """The equation held against another recording, with the parameters found or others."""
        _, weak = split(self.method)
        given = self.theta if theta is None else theta
        window = make_window(recording.dt, self.problem.width, weak=weak)
        return assess(self.problem.equation, given, recording, window, self.problem.free_run)

    @functools.cached_property
    def cautions(self) -> tuple[str, ...]:
        """What a reader of the parameters should know."""
        base, weak = split(self.method)
        if self.status != Status.ok:
            return (f"no estimate: {self.status.sentence}",)
        found = [*self._of_sensors(), *self._of_isotropy(base, weak)]
        # Isotropy has its own words above.
        found += [each for each in self.identifiability.cautions if "isotropic" not in each]
        found += [*self._of_bias(base, weak), *self._of_convergence(base, weak)]
        if base in ("gtls", "bcls"):
            scale = float(np.sqrt(self.problem.fit(self.method).noise_scale))
            if not 1.0 / _SCALE < scale < _SCALE:
                found.append(
                    f"the rows are {scale:.2g} times as noisy as the noise of the signals says: it is wrong, or the equation is"
                )
        low, high = self.interval
        unknown = [name for name, a, b in zip(self.parameters, low, high, strict=True) if a <= 0.0 <= b]
        if unknown:
            found.append(f"{', '.join(unknown)}: the interval holds 0; the record does not show that the term is there")
        if self.assessment.explained_share < _WEAK_EXPLANATION:
            found.append(
                f"the terms explain {100 * self.assessment.explained_share:.0f} % of the variance of the regressand: "
                "most of it is something else"
            )
        return tuple(found)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the method takes for granted and no record can show."""
        base, _ = split(self.method)
        told = {
            "ls": "the regressors are free of noise",
            "rls": "the regressors are free of noise",
            "iv": "the instruments know nothing of the noise: sensors err independently of each other",
        }.get(base, "the noise of the signals is white, independent, and as told up to one factor")
        if base == "bcls":
            told = "the noise of the signals is white, independent, and exactly as told"
        whole = "an error that all sensors share, such as the scale of the regressand, scales every parameter"
        return (told, whole)

    def _of_sensors(self) -> list[str]:
        return [
            f"{name}: the second sensor is {abs(late):.2g} samples {'late' if late > 0 else 'early'}: align it with the first"
            for name, late in self.problem.recording.lags.items()
            if abs(late) >= _LATE
        ]

    def _of_isotropy(self, base: str, weak: bool) -> list[str]:
        """The most common misuse: equal noise in all columns taken for granted."""
        noise = self.problem.row_noise(weak)
        if base != "tls" and not (base in ("rtls", "frtls") and noise is None):
            return []
        told = (
            "total least squares takes all columns to be equally noisy, in their units and independently of each other"
        )
        if noise is None:
            return [f"{told}; nothing here says they are: where they are not, it is far worse than least squares"]
        ratio = self.identifiability.noise_ratio
        if ratio < 1.5:
            return []
        words = "some of them have no noise" if np.isinf(ratio) else f"here they differ by a factor of {ratio:.3g}"
        return [f'{told}; {words}: do not use these numbers, take "gtls" or "iv"']

    def _of_convergence(self, base: str, weak: bool) -> list[str]:
        """Whether a recursion without forgetting has come to where all rows together lead."""
        if self.track is None or self.track.forgetting < 1.0 or base == "rls":
            return []
        form = "tls" if self.problem.row_noise(weak) is None else "gtls"
        off = np.abs(self.theta - np.asarray(self.problem.fit(f"weak-{form}" if weak else form).theta)) / self.std
        worst = int(off.argmax())
        if off[worst] < 1.0:
            return []
        return [
            f"the recursion has not converged: {self.parameters[worst]} is {off[worst]:.1f} of its standard deviations from "
            f'what all rows together give; take "{form}"'
        ]

    def _of_bias(self, base: str, weak: bool) -> list[str]:
        """How far noise in the regressors pulls least squares, where it is known."""
        noise = self.problem.row_noise(weak)
        if base not in ("ls", "rls") or noise is None:
            return []
        rows = self.problem.rows(weak)[self.problem.whole(weak), :-1]
        covariance = jnp.asarray(noise)
        moment = jnp.asarray(rows.T @ rows / len(rows)) - covariance[:-1, :-1]
        # The estimate is pulled already: what pulls it is found at parameters put back once.
        back = self.theta - least_squares_bias(moment, jnp.asarray(self.theta), covariance)
        bias = np.asarray(least_squares_bias(moment, jnp.asarray(back), covariance))
        worst = int(np.argmax(np.abs(bias) / self.std))
        if abs(bias[worst]) < self.std[worst]:
            return []
        return [
            f"noise in the regressors pulls least squares: {self.parameters[worst]} by about {bias[worst]:.3g}, "
            f"{abs(bias[worst]) / self.std[worst]:.1f} of its standard deviations, however long the record"
        ]


def identify(
    equation: Equation,
    recording: Recording,
    method: str | None = None,
    *,
    window: int = WINDOW,
    lag: int | None = None,
    level: float = 0.95,
    forgetting: float = 1.0,
) -> Identification:
    """Find the parameters of an equation.

    Args:
        equation: linear in its parameters.
        recording: of its signals, by one sensor or several.
        method: "ls", "iv", "gtls", "bcls", "tls", "rls", "rtls" or "frtls", with "weak-" in front for derivatives against a
            test function. By default instrumental variables where there are two sensors; total least squares for the
            covariance of each row where the noise of all signals is known; else least squares. Weak where it can be.
        window: samples of the test function, odd.
        lag: rows over which residuals may be correlated; by default about twice what a row reaches over.
        level: of the intervals.
        forgetting: of recursive methods, how much a row counts one row later.

    Raises:
        ConfigError: an unknown method, one that asks for what is not known, or numbers out of their range.
        DataError: fewer samples than a row needs.

    Example:
        >>> from gainful.identification import Recording, identify, parse_equation
        >>> u = np.sin(np.arange(50.0))
        >>> y = np.zeros(50)
        >>> for k in range(1, 50):
        ...     y[k] = 0.8 * y[k - 1] + 0.5 * u[k - 1]
        >>> equation = parse_equation("y", {"a": "lag(y)", "b": "lag(u)"}, ["y", "u"])
        >>> identify(equation, Recording(np.arange(50.0), {"y": y, "u": u})).theta.round(6).tolist()
        [0.8, 0.5]
    """
    if not 0.0 < level < 1.0:
        raise ConfigError(f"level: expected a probability between 0 and 1, got {level!r}")
    if lag is not None and (not isinstance(lag, int) or lag < 0):
        raise ConfigError(f"lag: expected a whole number of rows of at least 0, got {lag!r}")
    missing = [name for name in equation.signals if name not in recording.values]
    if missing:
        raise ConfigError(f"recording: expected all of {', '.join(equation.signals)}, got no {missing[0]!r}")
    problem = Problem(equation, recording, window, lag)
    chosen = default_method(problem, recording.noise) if method is None else method
    base, weak = split(chosen)
    track = None
    if base in RECURSIVE:
        track = follow(problem, chosen, forgetting)
        theta, cov, status = track.theta[-1], track.cov, Status(int(track.status[track.status != Status.missing][-1]))
    else:
        fit = problem.fit(chosen)
        theta, cov, status = np.asarray(fit.theta), np.asarray(fit.cov), Status(int(fit.status))
    told = identifiability(problem.rows(weak)[:, None, :], problem.row_noise(weak), columns=equation.parameters)
    own = assess(equation, theta, recording, problem.window(weak), problem.free_run)
    return Identification(problem, chosen, theta, cov, status, level, told, own, track)
