"""The input at which a differentiable map takes a wanted value."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, ShapeError, did_you_mean

METHODS = ("gauss-newton", "joint-ekf", "ekf")
FLOOR = 1e-12
"""Smallest damping relative to the weights: keeps a system solvable where nothing is left to do."""


class Inverse(eqx.Module):
    """What an inversion found.

    Attributes:
        u: the input (inputs,).
        residual: wanted less reached, `target - y(u)` (outputs,).
        cost: its weighted mean square, before each sweep and at the end (sweeps + 1,).
        sensitivity: dy/du at `u` (outputs, inputs).
        saturated: which inputs stand at a limit, of amplitude or of step (inputs,).
    """

    u: Float[Array, " inputs"]
    residual: Float[Array, " outputs"]
    cost: Float[Array, " sweeps_and_1"]
    sensitivity: Float[Array, "outputs inputs"]
    saturated: Bool[Array, " inputs"]


def _numbers(value: Any) -> Array:
    return jnp.asarray(value, float)


class Inversion(eqx.Module):
    """Finds the input that takes a map `u -> y` to a target, by sweeps of regularised least squares.

    With `H = dy/du`, `W` the weights, `J` the weighted mean square of `target - y` and `S` the target's own variance,

        R = damping W^-1 + S,      R^-1 = (damping + W S)^-1 W
        du = (H' R^-1 H + P^-1 + E)^-1 (H' R^-1 (target - y) - E (u - start))

    "gauss-newton" takes all inputs together, `P` the same in every sweep: damped by the part of `J` that the inputs can take
    away, it is Levenberg and Marquardt's method and converges faster than quadratically on an affine map. "joint-ekf" and
    "ekf" take the input for the state of an extended Kalman filter and the target for its measurement, repeated: `P`
    shrinks from sweep to sweep, and the damping is the mean of all `J` so far, so that the error falls as the inverse
    square of the number of sweeps. "ekf" takes the inputs one at a time, the others at their newest value; where inputs act
    alike it is slower still.

    Either damping makes the first step the shorter, the further the target is beyond what inputs of the size of the prior
    can do. Where limits of the inputs are to decide instead, take a damping of 0.

    An output of weight 0 is not looked at. An input at a limit is left out of the next sweep while it pushes outwards.

    Attributes:
        weights: of the outputs, per squared unit (outputs,), or a matrix W.
        method: "gauss-newton", "joint-ekf" or "ekf".
        sweeps: how many; each costs one evaluation of the map and its derivatives.
        damping: a number that stays, 0 for the plain method of Gauss and Newton; by default it follows from the residual.
        input_scale: an input's unit of measure, in which the prior is written (inputs,) or one number.
        prior_variance: P at the start, in squared units of `input_scale`.
        effort: E, weight of the departure from the start (inputs, inputs) or a diagonal; only with "gauss-newton".
        limit: largest magnitude of an input (inputs,) or one number; none by default.
        step_limit: largest change from the start, likewise: a trust region per sample.

    Raises:
        ConfigError: an unknown method, no sweep, a number of the wrong sign, or an effort a filter has no place for.
        ShapeError: weights that are neither a vector nor a square matrix.

    Source: Behera, Gopal and Chaudhury (1996), IEEE Trans. Neural Networks 7(6):1401-1414, for "ekf"; Yamashita and
        Fukushima (2001), Computing Suppl. 15:239-249, for the damping.
    Differs: gains are computed from information, which takes one division per input in place of an inverse of the size
        of the output, and a target's variance enters together with R. What no input can reach does not damp
        "gauss-newton", or with more outputs than inputs it would never arrive.
    Reduces to: the gain of the linear quadratic regulator, with W its Riccati matrix, E the cost of the input and damping 1.

    Example:
        >>> twice = Inversion(jnp.ones(1), sweeps=3)
        >>> round(float(twice(lambda u: 2.0 * u, jnp.array([1.0]), jnp.zeros(1)).u[0]), 6)
        0.5
    """

    weights: Array = eqx.field(converter=_numbers)
    method: str = eqx.field(static=True, default="gauss-newton")
    sweeps: int = eqx.field(static=True, default=2)
    damping: float | Array | None = None
    input_scale: float | Array = 1.0
    prior_variance: float | Array = 1.0
    effort: Array | None = None
    limit: float | Array | None = None
    step_limit: float | Array | None = None

    def __check_init__(self) -> None:
        if self.method not in METHODS:
            raise ConfigError(f"method: {self.method!r} is not known; {did_you_mean(self.method, METHODS)}")
        if not isinstance(self.sweeps, int) or self.sweeps < 1:
            raise ConfigError(f"sweeps: expected a whole number of at least 1, got {self.sweeps!r}")
        if self.effort is not None and self.method != "gauss-newton":
            raise ConfigError(f"effort: expected the method 'gauss-newton', got {self.method!r}")
        shape = self.weights.shape
        if len(shape) not in (1, 2) or shape[0] != shape[-1]:
            raise ShapeError(f"weights: expected one per output or a square matrix, got shape {shape}")

    def __call__(
        self,
        output: Callable[[Float[Array, " inputs"]], Float[Array, " outputs"]],
        target: Float[Array, " outputs"],
        start: Float[Array, " inputs"],
        *,
        variance: Float[Array, "..."] | None = None,
    ) -> Inverse:
        """The input whose output is nearest to the target.

        Args:
            output: the map; any pure function JAX can differentiate.
            target: wanted.
            start: where to begin, and the centre of trust region and effort.
            variance: S, how uncertain the map's output is: a covariance, or its diagonal; none by default.
        """
        scale = jnp.broadcast_to(jnp.asarray(self.input_scale, float), start.shape)
        low, high = self._bounds(start)
        first = jnp.clip(start, low, high)
        W = jnp.diag(self.weights) if self.weights.ndim == 1 else self.weights
        problem = _Problem(output, target, W, variance, start, scale, low, high)
        P = jnp.broadcast_to(jnp.asarray(self.prior_variance, float), start.shape)
        sweep = {"gauss-newton": self._joint, "joint-ekf": self._joint, "ekf": self._one_by_one}[self.method]

        def follow(carry: tuple[Array, Array, Array], k: Array) -> tuple[tuple[Array, Array, Array], Array]:
            u, information, damping = carry
            cost, damping = self._damping(problem, u, damping, k)
            u, information = sweep(problem, u, information, damping)
            return (u, information, damping), cost

        (u, _, _), costs = jax.lax.scan(
            follow, (first, jnp.diag(1.0 / P), jnp.zeros(())), jnp.arange(self.sweeps), unroll=self.sweeps <= 4
        )
        y, H = problem.linear(u)
        residual = target - y
        return Inverse(u, residual, jnp.append(costs, problem.cost(residual)), H / scale, (u <= low) | (u >= high))

    def _bounds(self, start: Array) -> tuple[Array, Array]:
        low, high = jnp.full_like(start, -jnp.inf), jnp.full_like(start, jnp.inf)
        if self.limit is not None:
            low, high = jnp.maximum(low, -self.limit), jnp.minimum(high, self.limit)
        if self.step_limit is not None:
            # From a start beyond the limits, a step leads back as far as the limits ask for.
            inside = jnp.clip(start, low, high)
            low, high = jnp.maximum(low, inside - self.step_limit), jnp.minimum(high, inside + self.step_limit)
        return low, high

    def _damping(self, problem: _Problem, u: Array, last: Array, k: Array) -> tuple[Array, Array]:
        if self.damping is None and self.method == "gauss-newton":
            y, H = problem.linear(u)
            cost = problem.cost(problem.target - y)
            return cost, problem.reachable(problem.target - y, H)
        cost = problem.cost(problem.target - problem.output(u))
        damping = last + (cost - last) / (k + 1) if self.damping is None else jnp.asarray(self.damping, float)
        return cost, damping

    def _joint(self, problem: _Problem, u: Array, information: Array, damping: Array) -> tuple[Array, Array]:
        y, H = problem.linear(u)
        weighted = H.T @ problem.inverse_noise(damping)
        normal, slope = information + weighted @ H, weighted @ (problem.target - y)
        kept = normal
        if self.effort is not None:
            E = jnp.asarray(self.effort, float)
            E = (jnp.diag(E) if E.ndim == 1 else E) * jnp.outer(problem.scale, problem.scale)
            normal, slope = normal + E, slope - E @ ((u - problem.start) / problem.scale)
        free = ~(((u >= problem.high) & (slope > 0)) | ((u <= problem.low) & (slope < 0)))
        system = jnp.where(jnp.outer(free, free), normal, jnp.eye(len(u)))
        step = jax.scipy.linalg.solve(system, jnp.where(free, slope, 0.0), assume_a="pos")
        u = jnp.clip(u + problem.scale * step, problem.low, problem.high)
        return u, information if self.method == "gauss-newton" else kept

    def _one_by_one(self, problem: _Problem, u: Array, information: Array, damping: Array) -> tuple[Array, Array]:
        noise = problem.inverse_noise(damping)
        for i in range(len(u)):
            along = jnp.zeros_like(u).at[i].set(problem.scale[i])
            y, h = jax.jvp(problem.output, (u,), (along,))
            own = information[i, i] + h @ noise @ h
            information = information.at[i, i].set(own)
            moved = u[i] + problem.scale[i] * (h @ noise @ (problem.target - y)) / own
            u = u.at[i].set(jnp.clip(moved, problem.low[i], problem.high[i]))
        return u, information


class _Problem(eqx.Module):
    output: Callable[[Array], Array]
    target: Array
    W: Array
    variance: Array | None
    start: Array
    scale: Array
    low: Array
    high: Array

    def linear(self, u: Array) -> tuple[Array, Array]:
        """The output, and its derivatives by inputs in their units of measure."""
        y, push = jax.linearize(self.output, u)
        return y, jax.vmap(push, in_axes=1, out_axes=1)(jnp.diag(self.scale))

    @property
    def tracked(self) -> Array:
        """How many outputs are looked at."""
        return jnp.maximum(jnp.sum(jnp.diag(self.W) > 0), 1)

    def cost(self, residual: Array) -> Array:
        return residual @ self.W @ residual / self.tracked

    def reachable(self, residual: Array, H: Array) -> Array:
        """The share of the cost that inputs can take away."""
        normal, slope = H.T @ self.W @ H, H.T @ self.W @ residual
        normal = normal + (FLOOR * jnp.trace(normal) + jnp.finfo(normal.dtype).tiny) * jnp.eye(len(normal))
        return slope @ jax.scipy.linalg.solve(normal, slope, assume_a="pos") / self.tracked

    def inverse_noise(self, damping: Array) -> Array:
        """`R^-1`, also where a weight is 0 and R infinite."""
        damping = jnp.maximum(damping, FLOOR * jnp.trace(self.W) / self.tracked)
        if self.variance is None:
            return self.W / damping
        S = jnp.diag(self.variance) if self.variance.ndim == 1 else self.variance
        return jnp.linalg.solve(damping * jnp.eye(len(self.W)) + self.W @ S, self.W)
