"""Reaction wheels: where their axes point, and how much they can do."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ShapeError

REGULAR_PYRAMID = math.atan(1.0 / math.sqrt(2.0))  # rad, 35.26 deg: equal torque along every body axis


def orthogonal_axes() -> Float[Array, "3 3"]:
    """One wheel along each body axis."""
    return jnp.eye(3)


def pyramid_axes(angle: float = REGULAR_PYRAMID) -> Float[Array, "3 4"]:
    """Four wheels, each `angle` [rad] out of the x-y plane towards z: any three of them span all torques.

    Example:
        >>> pyramid_axes()[:, 0].round(4).tolist()
        [0.8165, 0.0, 0.5774]
    """
    c, s = math.cos(angle), math.sin(angle)
    return jnp.array([[c, 0.0, -c, 0.0], [0.0, c, 0.0, -c], [s, s, s, s]])


class Wheels(eqx.Module):
    """Reaction wheels with limits. A wheel's torque is what it does to the body; its momentum changes by the opposite.

    Attributes:
        axes: unit vector of each wheel in body axes (3, w).
        max_torque: largest torque [N m], one number or one per wheel.
        max_momentum: largest momentum [N m s], likewise.

    Example:
        >>> wheels = Wheels(orthogonal_axes())
        >>> wheels.limit(jnp.array([0.3, -0.05, -0.05]), jnp.array([0.0, 0.0, 2.0]), 0.01).tolist()
        [0.1, -0.05, 0.0]
    """

    axes: Float[Array, "3 w"]
    max_torque: Float[Array, " w"]
    max_momentum: Float[Array, " w"]

    def __init__(self, axes: Any = None, max_torque: Any = 0.1, max_momentum: Any = 2.0) -> None:
        self.axes = orthogonal_axes() if axes is None else jnp.asarray(axes, float)
        if self.axes.ndim != 2 or self.axes.shape[0] != 3:
            raise ShapeError(f"axes: expected shape (3, wheels), got {self.axes.shape}")
        limits = []
        for name, given in (("max_torque", max_torque), ("max_momentum", max_momentum)):
            value = jnp.asarray(given, float)
            if value.ndim > 1 or (value.ndim == 1 and value.shape != (self.count,)):
                raise ShapeError(f"{name}: expected one number or {self.count}, got shape {value.shape}")
            limits.append(jnp.broadcast_to(value, (self.count,)))
        self.max_torque, self.max_momentum = limits

    @property
    def count(self) -> int:
        """How many there are."""
        return self.axes.shape[1]

    def limit(self, torque: Float[Array, " w"], momentum: Float[Array, " w"], dt: float) -> Float[Array, " w"]:
        """The part of commanded torques [N m] that the motors and the momentum [N m s] allow for the next `dt` [s]."""
        return self.saturated(jnp.clip(torque, -self.max_torque, self.max_torque), momentum, dt)

    def saturated(self, torque: Float[Array, " w"], momentum: Float[Array, " w"], dt: float) -> Float[Array, " w"]:
        """The torque [N m] without what would take the momentum [N m s] beyond its limit during the next `dt` [s]."""
        # The momentum falls by torque dt; a wheel beyond its limit already must not go further, and need not jump back.
        lowest = jnp.minimum((momentum - self.max_momentum) / dt, 0.0)
        highest = jnp.maximum((momentum + self.max_momentum) / dt, 0.0)
        return jnp.clip(torque, lowest, highest)


def wheel_names(count: int) -> tuple[str, ...]:
    """What the wheels are called in names of signals: x, y, z for three, numbers from 1 otherwise."""
    return ("x", "y", "z") if count == 3 else tuple(str(k + 1) for k in range(count))
