"""What a controller is to follow, as states of the plant."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError
from .slews import QuinticSlews, slew_torque

ATTITUDES = ("quaternion", "angles")


class AbstractReference(eqx.Module):
    """A trajectory of the state, and the input that would keep a plant on it."""

    @abc.abstractmethod
    def state(self, t: Float[Array, ""]) -> Float[Array, " n"]:
        """The state wanted at a time [s]."""

    @abc.abstractmethod
    def input(self, t: Float[Array, ""]) -> Float[Array, " m"]:
        """The input fed forward."""


def _numbers(value: Any) -> Array:
    return jnp.asarray(value, float)


def _per_acceleration(value: Any) -> Array:
    return jnp.zeros((0, 3)) if value is None else jnp.asarray(value, float)


class SetPoint(AbstractReference):
    """One state for good, kept by one input.

    Attributes:
        at: the state (n,).
        by: the input (m,).
    """

    at: Array = eqx.field(converter=_numbers)
    by: Array = eqx.field(converter=_numbers)

    def state(self, t: Float[Array, ""]) -> Float[Array, " n"]:
        return self.at

    def input(self, t: Float[Array, ""]) -> Float[Array, " m"]:
        return self.by


class SlewStates(AbstractReference):
    """Slews as states `[attitude, deflection, rate, deflection rate]` of a spacecraft with or without elastic modes.

    The deflection is the one at which the modes rest in the hub's acceleration, `deflection = quasi_static dw/dt`, and its
    rate is zero; the torque fed forward is that of a rigid body.

    Attributes:
        slews: to follow.
        inertia: of the whole (3, 3) [kg m^2].
        quasi_static: `-E^-1 B` of a flexible structure (m, 3) [m s^2]; no mode by default.
        attitude: "quaternion" or 3-2-1 "angles".
        momentum: stored in wheels (3,) [N m s].

    Raises:
        ConfigError: another way to write the attitude.
        ShapeError: matrices of another shape.
    """

    slews: QuinticSlews
    inertia: Array = eqx.field(converter=_numbers)
    quasi_static: Array = eqx.field(converter=_per_acceleration, default=None)
    attitude: str = eqx.field(static=True, default="quaternion")
    momentum: Array = eqx.field(converter=_numbers, default=(0.0, 0.0, 0.0))

    def __check_init__(self) -> None:
        if self.attitude not in ATTITUDES:
            raise ConfigError(f"attitude: expected one of {', '.join(ATTITUDES)}, got {self.attitude!r}")
        if self.inertia.shape != (3, 3):
            raise ShapeError(f"inertia: expected shape (3, 3), got {self.inertia.shape}")
        if self.quasi_static.ndim != 2 or self.quasi_static.shape[1] != 3:
            raise ShapeError(f"quasi_static: expected 3 columns, got shape {self.quasi_static.shape}")

    def state(self, t: Float[Array, ""]) -> Float[Array, " n"]:
        attitude = self.slews.attitude(t) if self.attitude == "quaternion" else self.slews.angles(t)
        deflection = self.quasi_static @ self.slews.target_acceleration(t)
        return jnp.concatenate([attitude, deflection, self.slews.target_rate(t), jnp.zeros(len(deflection))])

    def input(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return slew_torque(self.slews, self.inertia, t, self.momentum)
