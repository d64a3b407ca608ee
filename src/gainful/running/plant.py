"""What a closed loop asks of a plant and of a controller."""

import abc
from typing import Any

import equinox as eqx
from jaxtyping import Array, Bool, Float

from ..filters import Info
from ..spaces import AbstractSpace


class AbstractPlant(eqx.Module):
    """The truth: a state that moves by itself, actuators that take a command as far as they can, and sensors.

    The state is any tree of arrays. Nothing here knows of faults: a loop changes commands and readings on their way.

    Attributes:
        output: where a reading of all sensors lives, in the order of the model's output.
    """

    output: eqx.AbstractVar[AbstractSpace]

    @abc.abstractmethod
    def init(self) -> Any:
        """The state at time 0."""

    @abc.abstractmethod
    def limit(self, state: Any, command: Float[Array, " actuators"], dt: float) -> Float[Array, " actuators"]:
        """The part of a command that the actuators can carry out during the next `dt` [s]."""

    @abc.abstractmethod
    def advance(
        self, state: Any, actuation: Float[Array, " actuators"], t: Float[Array, ""], dt: float, key: Array
    ) -> Any:
        """The state `dt` [s] after `t`, with what the actuators do held and noise drawn from `key`."""

    @abc.abstractmethod
    def read(self, state: Any, t: Float[Array, ""], key: Array) -> Float[Array, " output_size"]:
        """What the sensors read, with noise drawn from `key`."""

    @abc.abstractmethod
    def monitor(self, state: Any) -> Float[Array, " monitored"]:
        """What the plant tells of itself without an estimator, such as the momentum of its wheels."""

    @abc.abstractmethod
    def inputs(
        self, monitored: Float[Array, " monitored"], applied: Float[Array, " actuators"]
    ) -> Float[Array, " inputs"]:
        """Inputs of the plant's model for an interval, from what was told at its start and the command applied in it."""

    @abc.abstractmethod
    def truth(self, state: Any, t: Float[Array, ""]) -> Float[Array, " size"]:
        """The state in the coordinates of the plant's model."""


class Reading(eqx.Module):
    """What a controller may know at a moment.

    Attributes:
        y: latest reading of the sensors, faults and noise included; a missing component keeps its last value.
        monitored: what the plant tells of itself.
        info: latest report of the estimator in the loop; None without one.
        seen: which components of `y` were read at this moment; None where nobody says, which means all.
    """

    y: Float[Array, " output_size"]
    monitored: Float[Array, " monitored"]
    info: Info | None
    seen: Bool[Array, " output_size"] | None = None


class AbstractController(eqx.Module):
    """Turns readings into commands, at its own rate."""

    @abc.abstractmethod
    def init(self) -> Any:
        """What it remembers at the start."""

    @abc.abstractmethod
    def act(self, carry: Any, t: Float[Array, ""], reading: Reading) -> tuple[Any, Float[Array, " actuators"]]:
        """What it remembers from now on, and the command held until it acts again."""

    def report(self, carry: Any) -> Any:
        """What of its memory goes into the record: a tree of arrays, or None for nothing. It is stored for every row."""
        return None
