"""Plain vectors."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractSpace


class Euclidean(AbstractSpace):
    """Vectors: `plus` adds and `minus` subtracts.

    Example:
        >>> Euclidean(("x", "y"), ("m", "m")).size
        2
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, names: tuple[str, ...], units: tuple[str, ...] | None = None) -> None:
        self.names = self.tangent_names = tuple(names)
        self.units = self.tangent_units = tuple(units) if units is not None else ("1",) * len(names)

    @property
    def curved(self) -> bool:
        return False

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return (self,)

    def plus(self, x: Float[Array, " n"], d: Float[Array, " n"]) -> Float[Array, " n"]:
        return x + d

    def minus(self, y: Float[Array, " n"], x: Float[Array, " n"]) -> Float[Array, " n"]:
        return y - x

    def velocity(self, x: Float[Array, " n"], rate: Float[Array, " n"]) -> Float[Array, " n"]:
        return rate

    def error_rate(
        self, x: Float[Array, " n"], d: Float[Array, " n"], moved: Float[Array, " n"], own: Float[Array, " n"]
    ) -> Float[Array, " n"]:
        return moved - own

    def defect(self, x: Float[Array, " n"]) -> Float[Array, " n"]:
        return jnp.zeros_like(x)
