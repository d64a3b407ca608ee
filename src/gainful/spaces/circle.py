"""Angles."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractSpace


def wrap_angle(angle: Float[Array, "..."]) -> Float[Array, "..."]:
    """The same angle in [-pi, pi] (rad); angles already there come back bit for bit."""
    return angle - 2.0 * math.pi * jnp.round(angle / (2.0 * math.pi))


class Circle(AbstractSpace):
    """One angle [rad]: differences take the short way round, results lie in [-pi, pi].

    Example:
        >>> import jax.numpy as jnp
        >>> round(float(Circle("heading").minus(jnp.array([3.1]), jnp.array([-3.1]))[0]), 3)
        -0.083
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, name: str) -> None:
        self.names = self.tangent_names = (name,)
        self.units = self.tangent_units = ("rad",)

    @property
    def curved(self) -> bool:
        return False

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return (self,)

    def plus(self, x: Float[Array, "1"], d: Float[Array, "1"]) -> Float[Array, "1"]:
        return wrap_angle(x + d)

    def minus(self, y: Float[Array, "1"], x: Float[Array, "1"]) -> Float[Array, "1"]:
        return wrap_angle(y - x)

    def velocity(self, x: Float[Array, "1"], rate: Float[Array, "1"]) -> Float[Array, "1"]:
        return rate

    def error_rate(
        self, x: Float[Array, "1"], d: Float[Array, "1"], moved: Float[Array, "1"], own: Float[Array, "1"]
    ) -> Float[Array, "1"]:
        return moved - own

    def defect(self, x: Float[Array, "1"]) -> Float[Array, "1"]:
        return jnp.zeros_like(x)
