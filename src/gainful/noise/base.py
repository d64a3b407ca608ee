"""The contract of a noise law."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ..models import AbstractModel
from ..updates import Update


class AbstractNoise(eqx.Module):
    """Says what Q and R are now: read before predict and update, learned after, for the next step."""

    @abc.abstractmethod
    def init(self, model: AbstractModel) -> Any:
        """What it remembers at the start."""

    @abc.abstractmethod
    def process(self, carry: Any, Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        """The process noise to use, given the model's."""

    @abc.abstractmethod
    def measurement(self, carry: Any, R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        """The measurement noise to use, given the model's."""

    @abc.abstractmethod
    def learn(self, carry: Any, update: Update) -> Any:
        """What it remembers after an update."""
