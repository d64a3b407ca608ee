"""Several spaces side by side."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .base import AbstractSpace
from .euclidean import Euclidean


class Product(AbstractSpace):
    """Points of several spaces, concatenated in order; neighbouring plain vectors are merged.

    Args:
        spaces: in order.
        added: how many of the last degrees of freedom a model was extended by.

    Example:
        >>> from gainful.spaces import Circle
        >>> Product((Euclidean(("x", "y")), Circle("heading"))).names
        ('x', 'y', 'heading')
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)
    members: tuple[AbstractSpace, ...]
    _added: int = eqx.field(static=True)

    def __init__(self, spaces: Sequence[AbstractSpace], *, added: int = 0) -> None:
        merged: list[AbstractSpace] = []
        for part in (part for space in spaces for part in space.parts):
            last = merged[-1] if merged else None
            if isinstance(part, Euclidean) and isinstance(last, Euclidean):
                merged[-1] = Euclidean(last.names + part.names, last.units + part.units)
            else:
                merged.append(part)
        self.members = tuple(merged)
        self._added = added
        self.names = tuple(name for part in merged for name in part.names)
        self.units = tuple(unit for part in merged for unit in part.units)
        self.tangent_names = tuple(name for part in merged for name in part.tangent_names)
        self.tangent_units = tuple(unit for part in merged for unit in part.tangent_units)

    @property
    def added(self) -> int:
        return self._added

    @property
    def curved(self) -> bool:
        return any(part.curved for part in self.members)

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return self.members

    def plus(self, x: Float[Array, " size"], d: Float[Array, " dof"]) -> Float[Array, " size"]:
        pieces, i, j = [], 0, 0
        for part in self.members:
            pieces.append(part.plus(x[i : i + part.size], d[j : j + part.dof]))
            i, j = i + part.size, j + part.dof
        return jnp.concatenate(pieces)

    def minus(self, y: Float[Array, " size"], x: Float[Array, " size"]) -> Float[Array, " dof"]:
        pieces, i = [], 0
        for part in self.members:
            pieces.append(part.minus(y[i : i + part.size], x[i : i + part.size]))
            i += part.size
        return jnp.concatenate(pieces)

    def velocity(self, x: Float[Array, " size"], rate: Float[Array, " dof"]) -> Float[Array, " size"]:
        pieces, i, j = [], 0, 0
        for part in self.members:
            pieces.append(part.velocity(x[i : i + part.size], rate[j : j + part.dof]))
            i, j = i + part.size, j + part.dof
        return jnp.concatenate(pieces)

    def error_rate(
        self, x: Float[Array, " size"], d: Float[Array, " dof"], moved: Float[Array, " dof"], own: Float[Array, " dof"]
    ) -> Float[Array, " dof"]:
        pieces, i, j = [], 0, 0
        for part in self.members:
            here, block = x[i : i + part.size], slice(j, j + part.dof)
            pieces.append(part.error_rate(here, d[block], moved[block], own[block]))
            i, j = i + part.size, j + part.dof
        return jnp.concatenate(pieces)

    def defect(self, x: Float[Array, " size"]) -> Float[Array, " size"]:
        pieces, i = [], 0
        for part in self.members:
            pieces.append(part.defect(x[i : i + part.size]))
            i += part.size
        return jnp.concatenate(pieces)
