"""Attitude in the rotation sequence 3-2-1: turn by yaw about z, then by pitch about y, then by roll about x.

Angles are written `(roll, pitch, yaw)` [rad]. A body that turns at `w` has `d(roll, pitch, yaw)/dt = E w`, and `E` is
singular where pitch is 90 degrees.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..spaces import quaternion_exp, quaternion_multiply


def euler321_rates(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """`E`: what turns body rates into rates of the angles."""
    sr, cr, cp, tp = jnp.sin(angles[0]), jnp.cos(angles[0]), jnp.cos(angles[1]), jnp.tan(angles[1])
    zero, one = jnp.zeros_like(sr), jnp.ones_like(sr)
    return jnp.stack([jnp.stack(row) for row in ([one, sr * tp, cr * tp], [zero, cr, -sr], [zero, sr / cp, cr / cp])])


def euler321_rates_inverse(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """`E^-1`: what turns rates of the angles into body rates; never singular to build."""
    sr, cr, sp, cp = jnp.sin(angles[0]), jnp.cos(angles[0]), jnp.sin(angles[1]), jnp.cos(angles[1])
    zero, one = jnp.zeros_like(sr), jnp.ones_like(sr)
    return jnp.stack([jnp.stack(row) for row in ([one, zero, -sp], [zero, cr, sr * cp], [zero, -sr, cr * cp])])


def euler321_to_quaternion(angles: Float[Array, "3"]) -> Float[Array, "4"]:
    """The quaternion from body to reference, scalar last."""
    about_x, about_y, about_z = (quaternion_exp(angles[k] * jnp.eye(3)[k]) for k in range(3))
    return quaternion_multiply(quaternion_multiply(about_z, about_y), about_x)


def quaternion_to_euler321(q: Float[Array, "4"]) -> Float[Array, "3"]:
    """The angles of a unit quaternion from body to reference, pitch within 90 degrees of zero.

    Example:
        >>> angles = jnp.array([0.3, -0.2, 2.5])
        >>> [round(angle, 12) for angle in quaternion_to_euler321(euler321_to_quaternion(angles)).tolist()]
        [0.3, -0.2, 2.5]
    """
    x, y, z, w = q[0], q[1], q[2], q[3]
    along, across = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w)
    roll = jnp.arctan2(2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y))
    # The arc tangent keeps its digits where the arc sine of a number near 1 has lost them.
    return jnp.stack([roll, jnp.arctan2(2.0 * (y * w - x * z), jnp.hypot(along, across)), jnp.arctan2(across, along)])


class AngleState(eqx.Module):
    """A state whose quaternion is written in 3-2-1 angles, for laws and networks that want plain numbers.

    Attributes:
        at: where the quaternion begins.
    """

    at: int = eqx.field(static=True, default=0)

    def __call__(self, numbers: Float[Array, " size"]) -> Float[Array, " size_less_1"]:
        before, q, after = jnp.split(numbers, [self.at, self.at + 4])
        return jnp.concatenate([before, quaternion_to_euler321(q), after])
