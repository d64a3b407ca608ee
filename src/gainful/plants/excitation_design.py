"""Excitation that shows a plant's parameters as well as limits of its motion allow."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
from jaxtyping import Array, Float

from ..errors import ConfigError, NumericalError, ShapeError, did_you_mean
from .fourier_excitation import fourier_excitation

Regressor = Callable[[Array, Array, Array], Array]
"""From position, rate and acceleration (T,) to what the parameters are multiplied by, (T, n) or (T, equations, n)."""
Objective = Literal["smallest_eigenvalue", "log_determinant"]
"""What is made large of the moment: what is known of the worst combination of parameters, or of all of them."""

LIMITS = ("position", "rate", "acceleration", "wrench")
"""What can be limited, by its magnitude."""
_COARSE, _FINE, _SUMMITS = 24, 200, 8
"""Samples per period of the fastest harmonic, where moment and limits are looked up and where peaks are sought; how many of the
highest summits among the latter are climbed."""
_ACTIVE, _MARGIN = 1e-3, 1e-9
"""Share of a limit within which it counts as reached; share by which all peaks stay below."""
_FAR, _ALIKE = 1e9, 1e-12
"""Factor up to which a limit of the wrench is looked for; smallest eigenvalue of a moment with unit diagonal that shows all
parameters."""


@dataclasses.dataclass(frozen=True)
class ExcitationDesign:
    """A designed excitation, and what it reaches.

    Attributes:
        a: amplitudes of the cosines of `fourier_excitation`, in the rate's unit (harmonics,).
        b: amplitudes of the sines (harmonics,).
        period: [s].
        smallest_eigenvalue: of the mean of `H^T H` over a period, each column times its parameter's scale.
        log_determinant: of the same.
        peaks: largest magnitudes over a period, by the names of `LIMITS`; the wrench's if its parameters were given.
        active: the limits that are reached.
        starts: the objective each start was brought to, best first: alike if the optimum is not a matter of luck.
    """

    a: np.ndarray
    b: np.ndarray
    period: float
    smallest_eigenvalue: float
    log_determinant: float
    peaks: Mapping[str, float]
    active: tuple[str, ...]
    starts: tuple[float, ...]


def design_excitation(
    regressor: Regressor,
    limits: Mapping[str, float],
    *,
    period: float,
    harmonics: int = 5,
    parameters: Sequence[float] | Array | None = None,
    scales: Sequence[float] | Array | None = None,
    objective: Objective = "smallest_eigenvalue",
    starts: int = 32,
    seed: int = 0,
) -> ExcitationDesign:
    """Amplitudes of a `fourier_excitation` from which a regression learns most under limits.

    From several random starts, sequential quadratic programming makes the smallest eigenvalue or the determinant of the
    moment `mean of H^T H` large while no sample exceeds a limit. Each result is then scaled so that its peaks, sought between
    the samples too, reach the first limit and none exceeds its own. The optimum is a local one.

    Args:
        regressor: of position, rate and acceleration, in JAX.
        limits: largest magnitudes by name: any of "position", "rate", "acceleration" and "wrench".
        period: of the excitation [s].
        harmonics: of its series.
        parameters: believed ones; their product with the regressor is the wrench, for its limit and peak.
        scales: sizes of the parameters, by which the columns are multiplied, so that no unit decides which of them counts;
            1 each by default.
        objective: "smallest_eigenvalue" or "log_determinant".
        starts: random starts.
        seed: of those.

    Raises:
        ConfigError: limits that are not known or not above 0, none of rate, acceleration or wrench, a limit of the wrench
            without parameters, or numbers out of range.
        ShapeError: parameters or scales that are not as many as the columns.
        NumericalError: no start shows all parameters, as when two columns are always alike.

    Source: Swevers, Ganseman, Tukel, De Schutter and Van Brussel (1997), IEEE Trans. Robot. Autom. 13(5):730-740.
    Differs: amplitudes of a modified Fourier series, which rests at the ends of its period.

    Example:
        >>> found = design_excitation(
        ...     lambda q, rate, acceleration: jnp.stack([acceleration, rate], axis=-1),
        ...     {"rate": 1.0},
        ...     period=10.0,
        ...     harmonics=2,
        ...     starts=1,
        ... )
        >>> found.active, round(found.peaks["rate"], 6)
        (('rate',), 1.0)
    """
    problem = _Problem(regressor, dict(limits), period, harmonics, parameters, scales, objective)
    if not isinstance(starts, int) or starts < 1:
        raise ConfigError(f"starts: expected a whole number of at least 1, got {starts!r}")
    rng = np.random.default_rng(seed)
    found = [problem.improved(rng) for _ in range(starts)]
    ranked = sorted(found, key=lambda pair: -pair[0])
    best = ranked[0][1]
    if not problem.told_apart(best) > _ALIKE:
        raise NumericalError("regressor: no start shows all parameters; are two columns always alike, or one always 0?")
    return problem.described(best, tuple(each for each, _ in ranked))


class _Problem:
    """The regressor, the limits and the programs that look them up."""

    def __init__(
        self,
        regressor: Regressor,
        limits: dict[str, float],
        period: float,
        harmonics: int,
        parameters: Any,
        scales: Any,
        objective: str,
    ) -> None:
        if not isinstance(harmonics, int) or harmonics < 1:
            raise ConfigError(f"harmonics: expected a whole number of at least 1, got {harmonics!r}")
        if not period > 0:
            raise ConfigError(f"period: expected a time above 0 s, got {period!r}")
        if objective not in get_args(Objective):
            raise ConfigError(f"objective: {objective!r} is not known; {did_you_mean(objective, get_args(Objective))}")
        for name, limit in limits.items():
            if name not in LIMITS:
                raise ConfigError(f"limits: {name!r} is not known; {did_you_mean(str(name), LIMITS)}")
            if not limit > 0:
                raise ConfigError(f"limits: expected a {name} above 0, got {limit!r}")
        if not limits:
            raise ConfigError("limits: expected at least one, got none")
        if "wrench" in limits and parameters is None:
            raise ConfigError("parameters: missing; a limit of the wrench needs them")
        self.regressor, self.limits, self.objective = regressor, limits, objective
        self.period, self.harmonics = float(period), harmonics
        columns = jax.eval_shape(regressor, *(jnp.zeros(2),) * 3).shape[-1]
        self.parameters = _as_many("parameters", parameters, columns)
        given = _as_many("scales", scales, columns)
        self.scales = jnp.ones(columns) if given is None else given
        self.coarse = jnp.linspace(0.0, self.period, _COARSE * harmonics, endpoint=False)
        self.fine = jnp.linspace(0.0, self.period, _FINE * harmonics, endpoint=False)

    def signals(self, amplitudes: Any, t: Array) -> dict[str, Array]:
        """What is limited, at some times, each (T, ...)."""
        a, b = jnp.split(amplitudes, 2)
        motion = fourier_excitation(a, b, self.period, t)
        found: dict[str, Array] = {"position": motion[0], "rate": motion[1], "acceleration": motion[2]}
        if self.parameters is not None:
            found["wrench"] = self.regressor(*motion) @ self.parameters
        return found

    def moment(self, amplitudes: Any) -> Array:
        """Mean of `H^T H` over a period at the parameters' scale."""
        a, b = jnp.split(amplitudes, 2)
        H = self.regressor(*fourier_excitation(a, b, self.period, self.coarse)) * self.scales
        return jnp.einsum("...i,...j->ij", H, H) / len(self.coarse)

    def told_apart(self, x: np.ndarray) -> float:
        """The smallest eigenvalue of the moment at unit diagonal, for amplitudes along the basis."""
        M = np.asarray(self.moment(self.basis @ x))
        size = np.sqrt(np.diagonal(M))
        return float(np.linalg.eigvalsh(M / np.outer(size, size))[0]) if size.all() else 0.0

    @functools.cached_property
    def value(self) -> Callable[[Any], tuple[Array, Array]]:
        """The objective and its slope along the basis, in logarithms, so that no unit decides how steep it is."""

        def known(x: Array) -> Array:
            spectrum = jnp.linalg.eigvalsh(self.moment(self.basis @ x))
            return jnp.log(spectrum[0]) if self.objective == "smallest_eigenvalue" else jnp.sum(jnp.log(spectrum))

        return jax.jit(jax.value_and_grad(known))

    @functools.cached_property
    def room(self) -> tuple[Callable[[Any], Array], Callable[[Any], Array]]:
        """How far each sample is from its limit, in shares of it, and how that changes."""

        def left(x: Array) -> Array:
            found = self.signals(self.basis @ x, self.coarse)
            return jnp.concatenate([1.0 - (found[name] / limit).ravel() ** 2 for name, limit in self.limits.items()])

        return jax.jit(left), jax.jit(jax.jacfwd(left))

    @functools.cached_property
    def peaks(self) -> Callable[[Any], dict[str, Array]]:
        """Largest magnitudes over a period, between the samples too."""
        width = self.period / len(self.fine)
        around = jnp.linspace(-1.0, 1.0, 65)

        def magnitudes(amplitudes: Array, t: Array) -> dict[str, Array]:
            found = self.signals(amplitudes, t)
            return {name: jnp.max(jnp.abs(x).reshape(len(t), -1), axis=1) for name, x in found.items()}

        def refined(amplitudes: Array, name: str, t: Array) -> Array:
            for step in (width, width / 32, width / 1024):
                closer = (t[:, None] + step * around).ravel()
                x = magnitudes(amplitudes, closer)[name].reshape(len(t), -1)
                t = closer.reshape(len(t), -1)[jnp.arange(len(t)), jnp.argmax(x, axis=1)]
            return jnp.max(x)

        def largest(amplitudes: Array) -> dict[str, Array]:
            found = {}
            for name, x in magnitudes(amplitudes, self.fine).items():
                summit = (x >= jnp.roll(x, 1)) & (x >= jnp.roll(x, -1))
                _, places = jax.lax.top_k(jnp.where(summit, x, -1.0), _SUMMITS)
                found[name] = refined(amplitudes, name, self.fine[places])
            return found

        return jax.jit(largest)

    def scaled(self, x: np.ndarray) -> np.ndarray:
        """Amplitudes along the basis times the largest factor at which all limits hold."""
        amplitudes = self.basis @ x
        peaks = {name: float(peak) for name, peak in self.peaks(amplitudes).items()}
        # Position, rate and acceleration grow as the amplitudes do; the wrench need not.
        linear = [limit / peaks[name] for name, limit in self.limits.items() if name != "wrench"]
        high = min(linear) if linear else 1.0

        def excess(factor: float) -> float:
            return float(self.peaks(factor * amplitudes)["wrench"]) / self.limits["wrench"] - 1.0

        if "wrench" in self.limits:
            if excess(0.0) >= 0.0:
                raise ConfigError("limits: expected a wrench above the one at rest, got a smaller one")
            while not linear and excess(high) < 0.0:
                high *= 2.0
                if high > _FAR:
                    raise ConfigError(
                        "limits: expected a rate or an acceleration too, as the wrench never reaches its limit"
                    )
            if excess(high) > 0.0:
                high = float(scipy.optimize.brentq(excess, 0.0, high, xtol=1e-12 * high))  # type: ignore[arg-type]
        return (1.0 - _MARGIN) * high * x

    @functools.cached_property
    def basis(self) -> np.ndarray:
        """Amplitudes whose rates are of equal size and unlike each other (2 harmonics, directions).

        In a direction or two the polynomial nearly cancels the series: what would take amplitudes hundreds of times the rate is
        left out.
        """
        times = self.coarse
        rates = [self.signals(each, times)["rate"] for each in jnp.eye(2 * self.harmonics)]
        _, gains, directions = np.linalg.svd(np.stack(rates, axis=1) / np.sqrt(len(times)), full_matrices=False)
        kept = gains > 0.01 * np.median(gains)
        return directions[kept].T / gains[kept]

    def improved(self, rng: np.random.Generator) -> tuple[float, np.ndarray]:
        """The objective and the amplitudes, along the basis, that a random start is brought to."""
        left, slope = self.room
        first = self.scaled(rng.standard_normal(self.basis.shape[1]))

        def loss(x: np.ndarray) -> tuple[float, np.ndarray]:
            value, gradient = self.value(x)
            if not np.isfinite(value):
                return 1e6, np.zeros_like(x)
            return -float(value), -np.asarray(gradient)

        found = scipy.optimize.minimize(
            loss,
            first,
            jac=True,
            method="SLSQP",
            constraints={"type": "ineq", "fun": lambda x: np.asarray(left(x)), "jac": lambda x: np.asarray(slope(x))},
            options={"maxiter": 200, "ftol": 1e-9},
        )
        tried = [first]
        if np.isfinite(found.x).all() and found.x.any():
            tried.append(self.scaled(found.x))
        values = [float(self.value(each)[0]) for each in tried]
        values = [each if np.isfinite(each) else -np.inf for each in values]
        best = int(np.argmax(values))
        return values[best], tried[best]

    def described(self, x: np.ndarray, starts: tuple[float, ...]) -> ExcitationDesign:
        """The design with what it reaches."""
        amplitudes = self.basis @ x
        spectrum = np.linalg.eigvalsh(np.asarray(self.moment(jnp.asarray(amplitudes))))
        peaks = {name: float(peak) for name, peak in self.peaks(amplitudes).items()}
        active = tuple(name for name, limit in self.limits.items() if peaks[name] > (1.0 - _ACTIVE) * limit)
        a, b = np.split(amplitudes, 2)
        values = np.exp(starts) if self.objective == "smallest_eigenvalue" else np.asarray(starts)
        logarithm = float(np.log(spectrum).sum())
        return ExcitationDesign(a, b, self.period, float(spectrum[0]), logarithm, peaks, active, tuple(values.tolist()))


def _as_many(name: str, given: Any, columns: int) -> Float[Array, " n"] | None:
    if given is None:
        return None
    numbers = jnp.asarray(given, float)
    if numbers.shape != (columns,):
        raise ShapeError(f"{name}: expected {columns}, one per column of the regressor, got shape {numbers.shape}")
    return numbers
