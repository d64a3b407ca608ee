"""Attitudes to follow, seen from a circular orbit."""

import abc
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..spaces import quaternion_exp, quaternion_multiply
from .euler312 import euler312_rates_inverse, euler312_to_dcm, euler312_to_quaternion

ORBITAL_RATE = 1.1e-3  # rad/s


class AbstractTarget(eqx.Module):
    """An attitude as 3-1-2 angles relative to orbit axes, which turn at the orbital rate about -y.

    At time 0 the orbit axes are the inertial axes.

    Attributes:
        orbital_rate: rate of the orbit axes [rad/s].
    """

    orbital_rate: eqx.AbstractVar[float | Array]

    @abc.abstractmethod
    def angles(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """(phi, theta, psi) of the target relative to orbit axes [rad]."""

    @property
    def orbit_rate(self) -> Float[Array, "3"]:
        """Rate of the orbit axes, in those axes [rad/s]."""
        return jnp.array([0.0, -1.0, 0.0]) * self.orbital_rate

    def orbit(self, t: Float[Array, ""]) -> Float[Array, "4"]:
        """Quaternion from orbit axes to inertial axes."""
        return quaternion_exp(self.orbit_rate * t)

    def attitude(self, t: Float[Array, ""]) -> Float[Array, "4"]:
        """Quaternion from target axes to inertial axes."""
        return quaternion_multiply(self.orbit(t), euler312_to_quaternion(self.angles(t)))

    def rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """Inertial rate of the target in its own axes [rad/s]: `Phi^-1 d(angles)/dt + A w_orbit`."""
        t = jnp.asarray(t, float)
        angles, slopes = jax.jvp(self.angles, (t,), (jnp.ones_like(t),))
        return euler312_rates_inverse(angles) @ slopes + euler312_to_dcm(angles) @ self.orbit_rate

    def acceleration(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """How that rate changes [rad/s^2], by differentiation."""
        t = jnp.asarray(t, float)
        return jax.jvp(self.rate, (t,), (jnp.ones_like(t),))[1]


class SwingTarget(AbstractTarget):
    """A target that swings about all three axes: `phi = a sin(O t)`, `theta = b sin^2(O t)`, `psi = c sin^2(O t / 2)`.

    Attributes:
        amplitude: (a, b, c) [rad].
        period: 2 pi / O [s].
        orbital_rate: of the orbit axes [rad/s].

    Example:
        >>> [round(math.degrees(angle), 9) for angle in SwingTarget().angles(jnp.asarray(25.0))]
        [45.0, 30.0, 15.0]
    """

    amplitude: Float[Array, "3"] = eqx.field(converter=jnp.asarray, default=(math.pi / 4, math.pi / 6, math.pi / 6))
    period: float | Array = 100.0  # s
    orbital_rate: float | Array = ORBITAL_RATE

    def angles(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        phase = 2.0 * math.pi * t / self.period
        return self.amplitude * jnp.stack([jnp.sin(phase), jnp.sin(phase) ** 2, jnp.sin(0.5 * phase) ** 2])


class SlewTarget(AbstractTarget):
    """A target whose angles grow at constant rates from zero.

    Attributes:
        slope: of (phi, theta, psi) [rad/s].
        orbital_rate: of the orbit axes [rad/s].
    """

    slope: Float[Array, "3"] = eqx.field(converter=jnp.asarray)
    orbital_rate: float | Array = ORBITAL_RATE

    def angles(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return self.slope * t
