"""Networks whose outputs are linear in their weights, which a Kalman filter learns exactly."""

from __future__ import annotations

import abc
from typing import Self

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ShapeError
from .base import AbstractNetwork


class LinearInWeights(AbstractNetwork):
    """`y = weights^T features(u)`: every output has the same features, so one covariance of the weights serves all.

    Attributes:
        weights: one row per feature (l, outputs).
    """

    weights: eqx.AbstractVar[Float[Array, "l outputs"]]

    @abc.abstractmethod
    def features(self, u: Float[Array, " inputs"]) -> Float[Array, " l"]:
        """What the weights are applied to."""

    @property
    def outputs(self) -> int:
        return self.weights.shape[1]

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return self.weights.T @ self.features(u)

    def with_weights(self, weights: Float[Array, "l outputs"]) -> Self:
        """The network with other weights.

        Raises:
            ShapeError: weights of another shape.
        """
        if weights.shape != self.weights.shape:
            raise ShapeError(f"weights: expected shape {self.weights.shape}, got {weights.shape}")
        return eqx.tree_at(lambda network: network.weights, self, weights)

    def cautions(self) -> tuple[str, ...]:
        """What the features cannot represent, in words."""
        return ()
