"""Attitude in the rotation sequence 3-1-2: turn by psi about z, then by phi about x, then by theta about y.

Angles are written `(phi, theta, psi)` [rad]; `A` takes reference axes into body axes. With `A_br` the attitude of a body
that turns at `w` and `w_r` the rate of its reference axes, in those axes,

    d(phi, theta, psi)/dt = Phi(phi, theta, psi) (w - A_br w_r),        dA/dt = -[w x] A    where w_r = 0.

`Phi` is singular where phi is 90 degrees: use a quaternion for manoeuvres that come near.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..spaces import quaternion_exp, quaternion_multiply


def _trigonometry(angles: Float[Array, "3"]) -> tuple[Array, ...]:
    phi, theta, psi = angles[0], angles[1], angles[2]
    return jnp.sin(phi), jnp.cos(phi), jnp.sin(theta), jnp.cos(theta), jnp.sin(psi), jnp.cos(psi)


def euler312_to_dcm(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """The matrix from reference axes to body axes, `C_y(theta) C_x(phi) C_z(psi)`."""
    sf, cf, st, ct, sp, cp = _trigonometry(angles)
    rows = [
        [ct * cp - st * sf * sp, ct * sp + st * sf * cp, -st * cf],
        [-cf * sp, cf * cp, sf],
        [st * cp + ct * sf * sp, st * sp - ct * sf * cp, ct * cf],
    ]
    return jnp.stack([jnp.stack(row) for row in rows])


def dcm_to_euler312(matrix: Float[Array, "3 3"]) -> Float[Array, "3"]:
    """The angles of a matrix from reference axes to body axes, phi within 90 degrees of zero.

    Example:
        >>> angles = jnp.array([0.3, -0.2, 2.5])
        >>> [round(angle, 12) for angle in dcm_to_euler312(euler312_to_dcm(angles)).tolist()]
        [0.3, -0.2, 2.5]
    """
    # The arc tangent keeps its digits, and its derivative, where the arc sine of an entry near 1 has lost them.
    phi = jnp.arctan2(matrix[1, 2], jnp.hypot(matrix[1, 0], matrix[1, 1]))
    return jnp.stack([phi, jnp.arctan2(-matrix[0, 2], matrix[2, 2]), jnp.arctan2(-matrix[1, 0], matrix[1, 1])])


def euler312_rates(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """`Phi`: what turns body rates relative to the reference into rates of the angles."""
    sf, cf, st, ct, _, _ = _trigonometry(angles)
    zero, one = jnp.zeros_like(sf), jnp.ones_like(sf)
    rows = [[ct, zero, st], [st * sf / cf, one, -ct * sf / cf], [-st / cf, zero, ct / cf]]
    return jnp.stack([jnp.stack(row) for row in rows])


def euler312_rates_inverse(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """`Phi^-1`: what turns rates of the angles into body rates relative to the reference; never singular to build."""
    sf, cf, st, ct, _, _ = _trigonometry(angles)
    zero, one = jnp.zeros_like(sf), jnp.ones_like(sf)
    return jnp.stack([jnp.stack(row) for row in ([ct, zero, -st * cf], [zero, one, sf], [st, zero, ct * cf])])


def euler312_to_quaternion(angles: Float[Array, "3"]) -> Float[Array, "4"]:
    """The quaternion from body to reference, scalar last."""
    about_x, about_y, about_z = (quaternion_exp(angle * jnp.eye(3)[axis]) for axis, angle in enumerate(angles))
    return quaternion_multiply(quaternion_multiply(about_z, about_x), about_y)


def quaternion_to_dcm(q: Float[Array, "4"]) -> Float[Array, "3 3"]:
    """The matrix from reference axes to body axes of a unit quaternion from body to reference."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    return jnp.stack([jnp.stack(row) for row in rows])
