"""Attitudes as unit quaternions, Hamilton convention, scalar last: `q = (x, y, z, w)`."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractSpace


def quaternion_multiply(p: Float[Array, "4"], q: Float[Array, "4"]) -> Float[Array, "4"]:
    """Hamilton product `p q`: the rotation `q` followed, in fixed axes, by `p`."""
    vector = p[3] * q[:3] + q[3] * p[:3] + jnp.cross(p[:3], q[:3])
    return jnp.concatenate([vector, (p[3] * q[3] - p[:3] @ q[:3])[None]])


def quaternion_conjugate(q: Float[Array, "4"]) -> Float[Array, "4"]:
    """The inverse rotation."""
    return q * jnp.array([-1.0, -1.0, -1.0, 1.0], q.dtype)


def quaternion_exp(rotation: Float[Array, "3"]) -> Float[Array, "4"]:
    """The unit quaternion of a rotation vector [rad]; smooth at zero."""
    square = rotation @ rotation
    small = square < 1e-8
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    sine = jnp.where(small, 0.5 - square / 48.0, jnp.sin(0.5 * angle) / angle)
    cosine = jnp.where(small, 1.0 - square / 8.0 + square**2 / 384.0, jnp.cos(0.5 * angle))
    return jnp.concatenate([sine * rotation, cosine[None]])


def quaternion_log(q: Float[Array, "4"]) -> Float[Array, "3"]:
    """The rotation vector [rad], at most pi long, of a unit quaternion; `q` and `-q` give the same; smooth at identity."""
    q = jnp.where(q[3] < 0, -q, q)
    square = q[:3] @ q[:3]
    small = square < 1e-8
    length = jnp.sqrt(jnp.where(small, 1.0, square))
    ratio = jnp.where(small, 2.0 / q[3] * (1.0 - square / (3.0 * q[3] ** 2)), 2.0 * jnp.arctan2(length, q[3]) / length)
    return ratio * q[:3]


def rotate(q: Float[Array, "4"], v: Float[Array, "3"]) -> Float[Array, "3"]:
    """The vector `v` rotated by `q`: from body axes to reference axes when `q` is body-to-reference."""
    t = 2.0 * jnp.cross(q[:3], v)
    return v + q[3] * t + jnp.cross(q[:3], t)


class Quaternion(AbstractSpace):
    """An attitude: stored as four numbers, moved by a rotation vector [rad] in body axes, `q <- q exp(d / 2)`.

    The multiplicative filter of spacecraft attitude is any filter of this library over this space.

    Source: Markley (2003), J. Guid. Control Dyn. 26(2):311-317.

    Example:
        >>> (Quaternion("q").size, Quaternion("q").dof)
        (4, 3)
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, name: str) -> None:
        self.names, self.units = tuple(f"{name}_{axis}" for axis in "xyzw"), ("1",) * 4
        self.tangent_names = tuple(f"{name}_rotation_{axis}" for axis in "xyz")
        self.tangent_units = ("rad",) * 3

    @property
    def curved(self) -> bool:
        return True

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return (self,)

    def plus(self, x: Float[Array, "4"], d: Float[Array, "3"]) -> Float[Array, "4"]:
        q = quaternion_multiply(x, quaternion_exp(d))
        return q / jnp.sqrt(q @ q)

    def minus(self, y: Float[Array, "4"], x: Float[Array, "4"]) -> Float[Array, "3"]:
        return quaternion_log(quaternion_multiply(quaternion_conjugate(x), y))

    def velocity(self, x: Float[Array, "4"], rate: Float[Array, "3"]) -> Float[Array, "4"]:
        return 0.5 * quaternion_multiply(x, jnp.concatenate([rate, jnp.zeros(1, x.dtype)]))

    def error_rate(
        self, x: Float[Array, "4"], d: Float[Array, "3"], moved: Float[Array, "3"], own: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        return moved - own - jnp.cross(own, d)

    def defect(self, x: Float[Array, "4"]) -> Float[Array, "4"]:
        length = jnp.sqrt(x @ x)
        off = jnp.abs(length - 1.0)
        return jnp.where(off < 1e-3, jnp.zeros_like(x), jnp.full_like(x, length - 1.0))
