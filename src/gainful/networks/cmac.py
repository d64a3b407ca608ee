"""The cerebellar model articulation controller: tables with overlapping tiles."""

from __future__ import annotations

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError
from .base import AbstractNetwork
from .tiling import Tiling


class CMAC(AbstractNetwork):
    """The sum of the weights of all cells an input belongs to, one in every layer.

    ```
    y(u) = sum_l W[a_l(u)];  e = target - y;  cr_l = (f[a_l] + 1)^-k;  g_l = cr_l / sum_l' cr_l'
    W[a_l] += rate g_l e;  f[a_l] += 1
    ```

    Cells that were visited often have earned their weights and take less of the blame for an error (credit assignment);
    the shares sum to 1, so one step leaves `(1 - rate) e` of the error whatever they are, shared cells included. Where
    few examples were, the counts say so.

    With several tilings, each of few of the inputs, it is a sum of low-dimensional tables that learn from one error.

    Attributes:
        tilings: which cells an input belongs to, of one table after the other.
        weights: one row per cell (cells, outputs).
        counts: how often each cell was visited in training (cells,).
        width: how many numbers it takes.

    Source: Albus (1975), J. Dyn. Sys. Meas. Control 97(3):220-227; credit assignment: Su, Tao and Hung (2003), IEEE
        Trans. Syst. Man Cybern. B 33(4):608-615.
    Differs: a cell that tiles of several layers share has its share counted as often as it is hit.
    Reduces to: Albus' rule, `rate / c` to each cell, for an exponent of 0.

    Example:
        >>> import numpy as np
        >>> from gainful.networks import empty_cmac, make_tiling
        >>> network = empty_cmac((make_tiling(np.linspace(-1.0, 1.0, 9)[:, None], compress="none"),), inputs=1, outputs=1)
        >>> network.learned(jnp.array([0.5]), jnp.array([2.0]), rate=0.5)(jnp.array([0.5])).tolist()
        [1.0]
    """

    tilings: tuple[Tiling, ...]
    weights: Float[Array, "cells outputs"]
    counts: Float[Array, " cells"]
    width: int = eqx.field(static=True)

    def __check_init__(self) -> None:
        if not self.tilings:
            raise ConfigError("tilings: expected at least one, got none")

    @property
    def inputs(self) -> int:
        return self.width

    @property
    def outputs(self) -> int:
        return self.weights.shape[1]

    @property
    def active(self) -> int:
        """How many cells an input belongs to."""
        return sum(tiling.layers for tiling in self.tilings)

    def addresses(self, u: Float[Array, " inputs"]) -> Int[Array, " active"]:
        """The cells an input belongs to."""
        return cells_of(self.tilings, u)

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return jnp.sum(self.weights[self.addresses(u)], axis=0)

    def visits(self, u: Float[Array, " inputs"]) -> Float[Array, ""]:
        return jnp.min(self.counts[self.addresses(u)])

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        return jnp.all(jnp.stack([tiling.contains(u) for tiling in self.tilings]))

    def learned(
        self, u: Float[Array, " inputs"], target: Float[Array, " outputs"], rate: float = 0.05, exponent: float = 1.2
    ) -> CMAC:
        """The network after one example.

        Args:
            u: the input.
            target: what it should have given.
            rate: share of the error taken away, between 0 and 2.
            exponent: `k`, how much less often visited cells are blamed; 0 for not at all.
        """
        check_rule(rate, exponent)
        tables = credited(self.weights, self.counts, self.addresses(u), target, rate, exponent, self.collides)
        return eqx.tree_at(lambda network: (network.weights, network.counts), self, tables)

    @property
    def collides(self) -> bool:
        """Whether an input may belong to one cell twice."""
        return any(tiling.hashed for tiling in self.tilings)


def cells_of(tilings: tuple[Tiling, ...], u: Float[Array, " inputs"]) -> Int[Array, " active"]:
    """The cells of several tables, one behind the other, that an input belongs to."""
    found, start = [], 0
    for tiling in tilings:
        found.append(start + tiling.addresses(u))
        start += tiling.cells
    return jnp.concatenate(found)


def check_rule(rate: float, exponent: float) -> None:
    """Raise unless learning is stable and the credits make sense; numbers that are being traced are not known yet."""
    if isinstance(rate, int | float) and not 0 < rate < 2:
        raise ConfigError(f"rate: expected a number above 0 and below 2, got {rate!r}")
    if isinstance(exponent, int | float) and not 0 <= exponent < math.inf:
        raise ConfigError(f"exponent: expected a number of at least 0, got {exponent!r}")


def credited(
    weights: Float[Array, "cells outputs"],
    counts: Float[Array, " cells"],
    cells: Int[Array, " active"],
    target: Float[Array, " outputs"],
    rate: float,
    exponent: float,
    collides: bool,
) -> tuple[Float[Array, "cells outputs"], Float[Array, " cells"]]:
    """Weights and counts after one example in some cells."""
    error = target - jnp.sum(weights[cells], axis=0)
    visited = counts[cells]
    power = -exponent * jnp.log1p(visited)
    credit = jnp.exp(power - jnp.max(power))  # the largest is 1, however large the counts
    # A cell hit twice is read twice and gets two shares, so it counts four times in what the step takes away.
    times = jnp.sum(cells[:, None] == cells[None, :], axis=1) if collides else 1.0
    share = credit / jnp.sum(credit * times)
    return weights.at[cells].add(rate * share[:, None] * error), counts.at[cells].set(visited + 1.0)


def empty_cmac(tilings: tuple[Tiling, ...], inputs: int, outputs: int) -> CMAC:
    """A CMAC that has learned nothing: it gives zero everywhere.

    Args:
        tilings: which cells an input belongs to.
        inputs: how many numbers it takes.
        outputs: how many it gives.
    """
    cells = sum(tiling.cells for tiling in tilings)
    return CMAC(tilings, jnp.zeros((cells, outputs)), jnp.zeros(cells), inputs)
