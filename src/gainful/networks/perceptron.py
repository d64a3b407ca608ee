"""The multilayer perceptron."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .base import AbstractNetwork

Parameters = tuple[tuple[Array, ...], tuple[Array, ...]]
"""Weights, then biases, one array per layer."""


class MultilayerPerceptron(AbstractNetwork):
    """Layers of hyperbolic tangents with a linear one at the end, inputs and outputs in units of their spread.

    ```
    z = (u - centre) / spread;  z <- tanh(W z + b) in every hidden layer;  y = size (W z + b)
    ```

    It gives some output everywhere, also far from all examples; `contains` says where they were.

    Attributes:
        weights: matrix of each layer.
        biases: vector of each layer.
        centre: mean of each input looked at (d,).
        spread: standard deviation of each (d,).
        size: standard deviation of each target (outputs,).
        low: least value of each input in training (d,).
        high: largest value (d,).
        columns: which inputs it looks at.
        width: how many numbers it takes.

    Source: Rumelhart, Hinton and Williams (1986), Nature 323:533-536.
    """

    weights: tuple[Float[Array, "_ _"], ...]
    biases: tuple[Float[Array, " _"], ...]
    centre: Float[Array, " d"]
    spread: Float[Array, " d"]
    size: Float[Array, " outputs"]
    low: Float[Array, " d"]
    high: Float[Array, " d"]
    columns: tuple[int, ...] = eqx.field(static=True)
    width: int = eqx.field(static=True)

    @property
    def inputs(self) -> int:
        return self.width

    @property
    def outputs(self) -> int:
        return self.size.shape[0]

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        z = (self._looked_at(u) - self.centre) / self.spread
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            z = jnp.tanh(weight @ z + bias)
        return self.size * (self.weights[-1] @ z + self.biases[-1])

    @property
    def parameters(self) -> Parameters:
        """What training changes: the weights, then the biases."""
        return self.weights, self.biases

    def with_parameters(self, parameters: Parameters) -> MultilayerPerceptron:
        """The network with other weights and biases of the same shapes."""
        return eqx.tree_at(lambda network: network.parameters, self, parameters)

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        chosen = self._looked_at(u)
        return jnp.all((chosen >= self.low) & (chosen <= self.high))

    def _looked_at(self, u: Float[Array, " inputs"]) -> Float[Array, " d"]:
        return u[jnp.array(self.columns, int)]
