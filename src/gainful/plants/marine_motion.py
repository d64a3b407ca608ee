"""How a marine vehicle moved, and its attitude in angles."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ShapeError
from ..spaces import quaternion_exp, quaternion_multiply
from .euler312 import quaternion_to_dcm

_NEAR = 5.0  # degrees
"""Pitch so near 90 degrees leaves roll and yaw to chance."""


class MarineMotion(eqx.Module):
    """How a vehicle moved, row by row.

    Attributes:
        t: times [s] (T,).
        nu: velocity and turn rate in body axes, surge, sway, heave, roll, pitch, yaw [m/s, rad/s] (T, 6).
        nudot: their rates of change in body axes (T, 6).
        quaternion: from body axes to north, east, down, scalar last (T, 4).
        wrench: that moved it [N, N m] (T, 6).
    """

    t: Float[Array, " T"]
    nu: Float[Array, "T 6"]
    nudot: Float[Array, "T 6"]
    quaternion: Float[Array, "T 4"]
    wrench: Float[Array, "T 6"]

    @property
    def attitude(self) -> Float[Array, "T 3"]:
        """Roll, pitch and yaw [rad]; at a pitch of 90 degrees roll and yaw are one turn, shared out by chance."""
        return jax.vmap(_angles)(self.quaternion)

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader of the angles should know."""
        pitch = np.degrees(np.abs(np.asarray(self.attitude[:, 1])))
        near = int((90.0 - pitch < _NEAR).sum())
        if not near:
            return ()
        return (
            f"pitch comes within {90.0 - pitch.max():.2g} degrees of 90, where roll and yaw are not told apart, and stays "
            f"within {_NEAR:g} in {near} of {len(pitch)} rows; take the quaternion",
        )


def _angles(q: Array) -> Array:
    A = quaternion_to_dcm(q)
    pitch = jnp.arctan2(-A[0, 2], jnp.hypot(A[0, 0], A[0, 1]))
    return jnp.stack([jnp.arctan2(A[1, 2], A[2, 2]), pitch, jnp.arctan2(A[0, 1], A[0, 0])])


def attitude_quaternion(attitude: Any) -> Array:
    """The quaternion from body axes to north, east, down, of roll, pitch and yaw [rad] or of itself; level by default."""
    given = jnp.zeros(3) if attitude is None else jnp.asarray(attitude, float)
    if given.shape == (4,):
        return given / jnp.linalg.norm(given)
    if given.shape != (3,):
        raise ShapeError(f"attitude: expected roll, pitch and yaw, or a quaternion, got shape {given.shape}")
    about_x, about_y, about_z = (quaternion_exp(angle * jnp.eye(3)[axis]) for axis, angle in enumerate(given))
    return quaternion_multiply(quaternion_multiply(about_z, about_y), about_x)
