"""How a state moves: in steps, in continuous time, or not at all by itself."""

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError
from ..linalg import congruence
from ..spaces import AbstractSpace
from .base import Instant
from .discretize import runge_kutta_4, van_loan
from .functions import Function, Matrix, as_point, at


class AbstractDynamics(eqx.Module):
    """The moving half of a model."""

    Q: eqx.AbstractVar[Matrix]
    G: eqx.AbstractVar[Matrix | None]

    @property
    @abc.abstractmethod
    def takes_dt(self) -> bool:
        """Whether the state's map is right for any time step."""

    @property
    @abc.abstractmethod
    def noise_takes_dt(self) -> bool:
        """Whether the noise is right for any time step."""

    @abc.abstractmethod
    def move(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Float[Array, " size"]:
        """The state one interval later."""

    @abc.abstractmethod
    def noise(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Float[Array, "dof dof"]:
        """The covariance the interval adds, in tangent coordinates."""

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        """What a reader of estimates along these states should know of the motion there."""
        return ()


def _shaped(matrix: Array, rows: int, role: str) -> Array:
    if matrix.shape == (1, 1) and rows > 1:
        matrix = matrix[0, 0] * jnp.eye(rows, dtype=matrix.dtype)
    if matrix.ndim != 2 or matrix.shape != (rows, rows):
        raise ModelError(f"{role}: expected shape ({rows}, {rows}), got {matrix.shape}")
    return matrix


def _through(gain: Matrix | None, noise: Matrix, role: str, dof: int, arguments: tuple[Any, ...]) -> Array:
    """`G Q G^T`, or Q where the noise acts on every state."""
    if gain is None:
        return _shaped(noise(*arguments), dof, role)
    g = gain(*arguments)
    if g.ndim != 2 or g.shape[0] != dof:
        raise ModelError(f"G: expected {dof} rows, one per degree of freedom of the state, got shape {g.shape}")
    return congruence(g, _shaped(noise(*arguments), g.shape[1], role))


class DiscreteDynamics(AbstractDynamics):
    """`x <- f(x, u, t)`; `f` may ask for `dt`, and must if steps vary.

    Attributes:
        f: the transition.
        Q: covariance of the process noise of one step.
        G: optional matrix through which the noise enters.
    """

    f: Function
    Q: Matrix
    G: Matrix | None

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        return self.f.cautions(x)

    @property
    def takes_dt(self) -> bool:
        return "dt" in self.f.asks

    @property
    def noise_takes_dt(self) -> bool:
        return _asks_dt(self.Q) or _asks_dt(self.G)

    def move(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        return as_point(self.f(*at(when, x, p)), space.size, x.dtype, "f")

    def noise(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        return _through(self.G, self.Q, "Q", space.dof, at(when, x, p))


class ContinuousDynamics(AbstractDynamics):
    """`dx/dt = f(x, u, t) + G w`, stepped by Runge-Kutta 4; the noise by Van Loan's integral along the error dynamics.

    For a quaternion `f` returns the three body rates [rad/s]; for every other signal its own rate of change.

    Attributes:
        f: the rates, one per degree of freedom.
        Q: spectral density of the noise `w`, in its units squared per second.
        G: optional matrix through which the noise enters, one row per degree of freedom.
        substeps: Runge-Kutta steps per interval.
    """

    f: Function
    Q: Matrix
    G: Matrix | None
    substeps: int = eqx.field(static=True)

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        return self.f.cautions(x)

    @property
    def takes_dt(self) -> bool:
        return True

    @property
    def noise_takes_dt(self) -> bool:
        return True

    def _rates(self, space: AbstractSpace, x: Array, t: Array, when: Instant, p: dict[str, Array]) -> Array:
        _, u, _, dt, parameters = at(when, x, p)
        return as_point(self.f(x, u, t, dt, parameters), space.dof, x.dtype, "f")

    def move(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        h = when.dt / self.substeps
        start = when.t - when.dt

        def velocity(point: Array, t: Array) -> Array:
            return space.velocity(point, self._rates(space, point, t, when, p))

        for k in range(self.substeps):
            # Integrated in the numbers that store the state; adding nothing brings them back onto the space.
            x = space.plus(runge_kutta_4(velocity, x, start + k * h, h), jnp.zeros(space.dof, x.dtype))
        return x

    def noise(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        density = _through(self.G, self.Q, "Q", space.dof, at(when, x, p))
        start = when.t - when.dt
        own = self._rates(space, x, start, when, p)

        def error_rate(d: Array) -> Array:
            return space.error_rate(x, d, self._rates(space, space.plus(x, d), start, when, p), own)

        drift = jax.jacfwd(error_rate)(jnp.zeros(space.dof, x.dtype))
        # The drift is frozen over the step anyway; one halving is as good as many.
        return van_loan(drift, density, when.dt, halvings=1)[1]


def _asks_dt(matrix: Matrix | None) -> bool:
    return matrix is not None and matrix.fn is not None and "dt" in matrix.fn.asks


class LinearDynamics(AbstractDynamics):
    """`x <- F x + B u + w`.

    Attributes:
        F: transition matrix, numbers or a function.
        B: optional input matrix.
        Q: covariance of the process noise of one step.
        G: optional matrix through which the noise enters.
    """

    F: Matrix
    B: Matrix | None
    Q: Matrix
    G: Matrix | None

    @property
    def takes_dt(self) -> bool:
        return _asks_dt(self.F)

    @property
    def noise_takes_dt(self) -> bool:
        return _asks_dt(self.Q) or _asks_dt(self.G)

    def move(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        arguments = at(when, x, p)
        moved = self.F(*arguments) @ x
        if self.B is not None:
            moved = moved + self.B(*arguments) @ when.u
        return as_point(moved, space.size, x.dtype, "F")

    def noise(self, space: AbstractSpace, x: Array, when: Instant, p: dict[str, Array]) -> Array:
        return _through(self.G, self.Q, "Q", space.dof, at(when, x, p))
