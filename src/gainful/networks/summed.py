"""Networks side by side, whose outputs are added."""

from __future__ import annotations

import functools
import operator

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ShapeError
from .base import AbstractNetwork


class SummedNetwork(AbstractNetwork):
    """The sum of networks, such as a straight line and one that has learned what the line leaves.

    Attributes:
        networks: all with the same inputs and outputs.

    Raises:
        ShapeError: no networks, or networks of different sizes.
    """

    networks: tuple[AbstractNetwork, ...]

    def __check_init__(self) -> None:
        sizes = {(each.inputs, each.outputs) for each in self.networks}
        if len(sizes) != 1:
            raise ShapeError(f"networks: expected some of one size, got (inputs, outputs) of {sorted(sizes)}")

    @property
    def inputs(self) -> int:
        return self.networks[0].inputs

    @property
    def outputs(self) -> int:
        return self.networks[0].outputs

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return functools.reduce(operator.add, [each(u) for each in self.networks])

    def visits(self, u: Float[Array, " inputs"]) -> Float[Array, ""]:
        return jnp.min(jnp.stack([each.visits(u) for each in self.networks]))

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        return jnp.all(jnp.stack([each.contains(u) for each in self.networks]))
