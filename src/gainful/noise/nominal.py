"""The model's own noise."""

from __future__ import annotations

from jaxtyping import Array, Float

from ..models import AbstractModel
from ..updates import Update
from .base import AbstractNoise


class Nominal(AbstractNoise):
    """Q and R as the model gives them."""

    def init(self, model: AbstractModel) -> None:
        return None

    def process(self, carry: None, Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        return Q

    def measurement(self, carry: None, R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        return R

    def learn(self, carry: None, update: Update) -> None:
        return None
