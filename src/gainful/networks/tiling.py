"""Overlapping layers of tiles: which cells of a table an input belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError, did_you_mean
from .inputs import varying

COMPRESSIONS = ("none", "asinh")
TABLES = ("auto", "dense", "hashed")

_DENSE_LIMIT = 2**20
"""Cells beyond which a table that holds every tile gives way to a hashed one."""

MOST_CELLS = 2**24
"""Cells beyond which a table is refused."""


class Tiling(eqx.Module):
    """`c` layers of tiles, each `c` quanta wide and shifted against the others by one quantum along a diagonal.

    ```
    i_j = clip(floor((u_j - low_j) / (high_j - low_j) q), 0, q - 1)
    b_l,j = floor((i_j + (l p_j mod c)) / c),  l = 0..c-1;  one cell per layer, numbered by (l, b_l,1, ..., b_l,d)
    ```

    Inputs `s` quanta apart share `c - s` cells, and none beyond. A hashed table is smaller than the number of tiles; tiles
    that meet in one cell share it.

    Attributes:
        low: lower end of each input's box (d,).
        high: upper end (d,).
        centre: what is taken off each input before compression (d,).
        spread: what it is divided by then (d,).
        columns: which of a network's inputs it looks at.
        levels: `q`, quanta per input.
        layers: `c`, the width of a tile.
        displacement: `p`, shift of one layer against the next along each input, in quanta.
        compress: "asinh" to give small values more of the levels than large ones, or "none".
        hashed: whether cells are found by a hash.
        cells: size of the table.

    Raises:
        ConfigError: levels or layers out of range, or a table too large.

    Source: Albus (1975), J. Dyn. Sys. Meas. Control 97(3):220-227.
    """

    low: Float[Array, " d"]
    high: Float[Array, " d"]
    centre: Float[Array, " d"]
    spread: Float[Array, " d"]
    columns: tuple[int, ...] = eqx.field(static=True)
    levels: int = eqx.field(static=True)
    layers: int = eqx.field(static=True)
    displacement: tuple[int, ...] = eqx.field(static=True)
    compress: Literal["none", "asinh"] = eqx.field(static=True)
    hashed: bool = eqx.field(static=True)
    cells: int = eqx.field(static=True)

    def __check_init__(self) -> None:
        check_sizes(self.levels, self.layers)
        if not 1 <= self.cells <= MOST_CELLS:
            raise ConfigError(f"cells: expected a number from 1 to {MOST_CELLS}, got {self.cells!r}")
        if len(self.displacement) != len(self.columns):
            raise ConfigError(f"displacement: expected {len(self.columns)} numbers, got {self.displacement!r}")

    @property
    def blocks(self) -> int:
        """Tiles per layer along one input."""
        return blocks_of(self.levels, self.layers)

    def mapped(self, u: Float[Array, " inputs"]) -> Float[Array, " d"]:
        """The inputs looked at, compressed."""
        chosen = u[jnp.array(self.columns, int)]
        return jnp.arcsinh((chosen - self.centre) / self.spread) if self.compress == "asinh" else chosen

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        """Whether the input is inside the box."""
        mapped = self.mapped(u)
        return jnp.all((mapped >= self.low) & (mapped <= self.high))

    def addresses(self, u: Float[Array, " inputs"]) -> Int[Array, " layers"]:
        """The cell of each layer that the input belongs to; beyond the box that of the nearest edge."""
        width = self.high - self.low
        share = (self.mapped(u) - self.low) / jnp.where(width > 0, width, 1.0)
        quantum = jnp.clip(jnp.floor(share * self.levels), 0, self.levels - 1).astype(jnp.int32)
        layer = np.arange(self.layers)
        shift = (layer[:, None] * np.array(self.displacement, int)) % self.layers
        block = (quantum[None, :] + shift) // self.layers
        if not self.hashed:
            address = jnp.asarray(layer, jnp.int32)
            for j in range(len(self.columns)):
                address = address * self.blocks + block[:, j]
            return address.astype(jnp.int32)
        # Fowler, Noll and Vo's hash, whose multiplications wrap at 2^32.
        mixed = jnp.full(self.layers, 2166136261, jnp.uint32)
        for j in range(-1, len(self.columns)):
            value = jnp.asarray(layer, jnp.uint32) if j < 0 else block[:, j].astype(jnp.uint32)
            mixed = (mixed ^ value) * jnp.uint32(16777619)
        mixed = mixed ^ (mixed >> 15)
        return (mixed % jnp.uint32(self.cells)).astype(jnp.int32)


def blocks_of(levels: int, layers: int) -> int:
    """Tiles per layer along one input."""
    return (levels + layers - 2) // layers + 1


def check_sizes(levels: int, layers: int) -> None:
    """Raise unless there is at least one layer and no fewer levels than layers."""
    if isinstance(layers, bool) or not isinstance(layers, int) or layers < 1:
        raise ConfigError(f"layers: expected a whole number of at least 1, got {layers!r}")
    if isinstance(levels, bool) or not isinstance(levels, int) or levels < layers:
        raise ConfigError(f"levels: expected a whole number of at least the {layers} layers, got {levels!r}")


def make_tiling(
    inputs: Float[np.ndarray, "N inputs"],
    *,
    columns: Sequence[int] | None = None,
    levels: int = 64,
    layers: int = 16,
    compress: Literal["none", "asinh"] = "asinh",
    table: Literal["auto", "dense", "hashed"] = "auto",
    cells: int | None = None,
    displacement: Sequence[int] | None = None,
) -> Tiling:
    """The tiling whose box holds all examples; inputs that do not vary are left out.

    Args:
        inputs: examples (N, inputs).
        columns: which inputs to look at; all by default.
        levels: quanta per input.
        layers: width of a tile in quanta.
        compress: "asinh" divides by 1.4826 times the median distance from the median, or "none".
        table: "dense" holds every tile, "hashed" as many cells as `cells` says; "auto" is dense up to a million cells.
        cells: size of a hashed table; a power of two of about a million by default.
        displacement: shift of one layer against the next along each input looked at; all 1 by default.

    Raises:
        ConfigError: an argument out of range, with the range.
    """
    for name, value, known in (("compress", compress, COMPRESSIONS), ("table", table, TABLES)):
        if value not in known:
            raise ConfigError(f"{name}: {value!r} is not known; {did_you_mean(str(value), known)}")
    check_sizes(levels, layers)
    wanted = tuple(range(inputs.shape[1])) if columns is None else tuple(columns)
    for column in wanted:
        if not 0 <= column < inputs.shape[1]:
            raise ConfigError(f"columns: expected numbers from 0 to {inputs.shape[1] - 1}, got {column!r}")
    shifts = (1,) * len(wanted) if displacement is None else tuple(displacement)
    if len(shifts) != len(wanted):
        raise ConfigError(f"displacement: expected {len(wanted)} numbers, got {shifts!r}")
    moving = set(varying(inputs))
    kept = [k for k, column in enumerate(wanted) if column in moving]
    chosen = inputs[:, [wanted[k] for k in kept]]
    centre, spread = np.zeros(len(kept)), np.ones(len(kept))
    if compress == "asinh":
        centre = np.median(chosen, axis=0)
        spread = 1.4826 * np.median(np.abs(chosen - centre), axis=0)
        # More than half of the values are equal: their standard deviation still tells of a size.
        spread = np.where(spread > 0, spread, chosen.std(axis=0))
        chosen = np.arcsinh((chosen - centre) / spread)
    size = layers * blocks_of(levels, layers) ** len(kept)
    hashed = table == "hashed" or (table == "auto" and size > _DENSE_LIMIT)
    return Tiling(
        low=jnp.asarray(chosen.min(axis=0)),
        high=jnp.asarray(chosen.max(axis=0)),
        centre=jnp.asarray(centre),
        spread=jnp.asarray(spread),
        columns=tuple(wanted[k] for k in kept),
        levels=levels,
        layers=layers,
        displacement=tuple(shifts[k] for k in kept),
        compress=compress,
        hashed=hashed,
        cells=(_DENSE_LIMIT if cells is None else cells) if hashed else size,
    )
