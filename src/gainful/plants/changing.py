"""A plant that becomes another one in the course of a run."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..running.plant import AbstractPlant
from ..spaces import AbstractSpace


class ChangingPlant(AbstractPlant):
    """A plant whose numbers are others from some time on: a payload is dropped, an appendage unfolds, a motor wears.

    The state goes on as it was. Motion and sensors change; limits and what is monitored are those of the plant before.

    Attributes:
        before: until then.
        after: from then on, a plant of the same kind.
        time: of the change [s]; infinite for none.

    Raises:
        ConfigError: plants of different kinds, or with arrays of different shapes.

    Reduces to: `before` with `time` infinite.

    Example:
        >>> from gainful.plants import FlexibleSpacecraft, FlexibleStructure
        >>> light = FlexibleSpacecraft(FlexibleStructure(inertia=[1500.0, 700.0, 1200.0], coupling=[70.0, 5.0, 40.0]))
        >>> plant = ChangingPlant(FlexibleSpacecraft(), light, 50.0)
        >>> float(plant.at(jnp.asarray(60.0)).structure.inertia[0, 0])
        1500.0
    """

    before: AbstractPlant
    after: AbstractPlant
    time: float | Array
    output: AbstractSpace

    def __init__(self, before: AbstractPlant, after: AbstractPlant, time: float | Array = jnp.inf) -> None:
        if _form(before) != _form(after):
            kinds = f"{type(before).__name__} and {type(after).__name__}"
            raise ConfigError(f"after: expected a plant like before in all but its numbers, got {kinds}")
        self.before, self.after, self.time, self.output = before, after, time, before.output

    def at(self, t: Float[Array, ""]) -> AbstractPlant:
        """The plant at a time [s]."""
        arrays, rest = eqx.partition(self.before, eqx.is_array)
        later = eqx.filter(self.after, eqx.is_array)
        return eqx.combine(jax.tree.map(lambda a, b: jnp.where(t < self.time, a, b), arrays, later), rest)

    def init(self) -> Any:
        return self.before.init()

    def limit(self, state: Any, command: Float[Array, " actuators"], dt: float) -> Float[Array, " actuators"]:
        return self.before.limit(state, command, dt)

    def advance(
        self, state: Any, actuation: Float[Array, " actuators"], t: Float[Array, ""], dt: float, key: Array
    ) -> Any:
        return self.at(t).advance(state, actuation, t, dt, key)

    def read(self, state: Any, t: Float[Array, ""], key: Array) -> Float[Array, " output_size"]:
        return self.at(t).read(state, t, key)

    def monitor(self, state: Any) -> Float[Array, " monitored"]:
        return self.before.monitor(state)

    def inputs(
        self, monitored: Float[Array, " monitored"], applied: Float[Array, " actuators"]
    ) -> Float[Array, " inputs"]:
        return self.before.inputs(monitored, applied)

    def truth(self, state: Any, t: Float[Array, ""]) -> Float[Array, " size"]:
        return self.before.truth(state, t)


def _form(plant: AbstractPlant) -> Any:
    """All of a plant but its numbers."""
    arrays, rest = eqx.partition(plant, eqx.is_array)
    leaves, structure = jax.tree.flatten(arrays)
    return [leaf.shape for leaf in leaves], structure, jax.tree.flatten(rest)
