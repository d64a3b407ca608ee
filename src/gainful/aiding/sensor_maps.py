"""Sensors whose errors depend on where and how they are used, and models that know it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, did_you_mean
from ..models import AbstractModel, Instant
from ..models.extended import AbstractExtendedModel
from ..networks import AbstractNetwork
from ..spaces import AbstractSpace, Circle, wrap_angle
from ..updates.aiding_features import context_values


class SensorMap(eqx.Module):
    """The repeatable error of one sensor signal as a function of its context.

    Attributes:
        signal: the output that errs, as the covariance of the measurement has it.
        context: what the error depends on: states, inputs, outputs as they are predicted, "t" [s] or "dt" [s].
        network: from the context to the error, in the signal's tangent unit.
        std: what is left of the error once the map is taken off, one sigma.
        least_visits: visits in training that what answers must have had; elsewhere the sensor is left as it was.
    """

    signal: str = eqx.field(static=True)
    context: tuple[str, ...] = eqx.field(static=True)
    network: AbstractNetwork
    std: Float[Array, ""]
    least_visits: float = 20.0

    def __check_init__(self) -> None:
        if (self.network.inputs, self.network.outputs) != (len(self.context), 1):
            raise ConfigError(
                f"map of {self.signal!r}: expected a network of {len(self.context)} inputs and one output, got "
                f"{self.network.inputs} and {self.network.outputs}"
            )

    def known(self, context: Float[Array, " d"]) -> Bool[Array, ""]:
        """Whether the map says anything here."""
        return self.network.contains(context) & (self.network.visits(context) >= self.least_visits)

    def error(self, context: Float[Array, " d"]) -> Float[Array, ""]:
        """The expected error; 0 where nothing is known."""
        return jnp.where(self.known(context), self.network(context)[0], 0.0)


class SensorMappedModel(AbstractExtendedModel):
    """A model whose sensors read what they should plus what their maps say; made by `with_sensor_maps`.

    Attributes:
        base: the model with sensors without repeatable errors.
        maps: one per signal.
    """

    base: AbstractModel
    maps: tuple[SensorMap, ...]
    space: AbstractSpace
    output: AbstractSpace
    inputs: tuple[str, ...] = eqx.field(static=True)
    input_units: tuple[str, ...] = eqx.field(static=True)
    parameters: dict[str, Array]

    def transition(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " size"]:
        return self.base.transition(x, when)

    def process_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "dof dof"]:
        return self.base.process_noise(x, when)

    def observe(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " output_size"]:
        y = self.base.observe(x, when)
        shift = jnp.zeros(self.output.dof, x.dtype)
        for each in self.maps:
            row = self.output.tangent_names.index(each.signal)
            shift = shift.at[row].add(each.error(context_of(each.context, self.base, x, y, when)).astype(x.dtype))
        return self.output.plus(y, shift)

    def measurement_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "output_dof output_dof"]:
        noise, y = self.base.measurement_noise(x, when), self.base.observe(x, when)
        scale = jnp.ones(self.output.dof, noise.dtype)
        for each in self.maps:
            row = self.output.tangent_names.index(each.signal)
            nominal = noise[row, row]
            factor = each.std.astype(noise.dtype) / jnp.sqrt(jnp.where(nominal > 0, nominal, 1.0))
            known = each.known(context_of(each.context, self.base, x, y, when)) & (nominal > 0)
            scale = scale.at[row].set(jnp.where(known, factor, 1.0))
        return scale[:, None] * noise * scale[None, :]


def with_sensor_maps(model: AbstractModel, maps: Sequence[SensorMap]) -> SensorMappedModel:
    """The model with learned sensor errors, for any filter: what a map says is part of the expected measurement.

    Where a map is known the noise of its signal is what is left of the error; elsewhere the sensor stays as it was.

    Args:
        model: with sensors without repeatable errors.
        maps: from `learn_sensor_map`, at most one per signal.

    Raises:
        ConfigError: no map, two of one signal, or a name the model does not have.

    Example:
        >>> from gainful.models import linear_model
        >>> from gainful.networks import AffineMap
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"], outputs=["y"])
        >>> stretched = SensorMap("y", ("x",), AffineMap(jnp.array([[0.1]]), jnp.zeros(1)), jnp.asarray(0.5))
        >>> when = Instant(jnp.array(0.0), jnp.array(1.0), jnp.zeros(0))
        >>> with_sensor_maps(model, [stretched]).observe(jnp.array([10.0]), when).tolist()
        [11.0]
    """
    maps = tuple(maps)
    if not maps:
        raise ConfigError("maps: expected at least one, got none")
    taken = set()
    for each in maps:
        check_signal(each.signal, model)
        angular(each.context, model)
        if each.signal in taken:
            raise ConfigError(f"maps: expected one per signal, got two of {each.signal!r}")
        taken.add(each.signal)
    return SensorMappedModel(
        base=model,
        maps=maps,
        space=model.space,
        output=model.output,
        inputs=model.inputs,
        input_units=model.input_units,
        parameters=model.parameters,
    )


def unmapped(model: AbstractModel) -> AbstractModel:
    """The model with its sensors taken at their word again.

    Args:
        model: with or without maps, itself or under further states.
    """

    def bare(part: Any) -> Any:
        return part.base if isinstance(part, SensorMappedModel) else part

    return jax.tree.map(bare, model, is_leaf=lambda part: isinstance(part, SensorMappedModel))


def check_signal(signal: str, model: AbstractModel) -> int:
    """Where a signal stands among the outputs.

    Raises:
        ConfigError: it is none.
    """
    names = model.output.tangent_names
    if signal not in names:
        raise ConfigError(f"signal: {signal!r} is not an output of the model; {did_you_mean(signal, names)}")
    return names.index(signal)


def context_of(
    context: tuple[str, ...],
    model: AbstractModel,
    x: Float[Array, " size"],
    y: Float[Array, " output_size"],
    when: Instant,
) -> Float[Array, " d"]:
    """The numbers a map looks at, angles in [-pi, pi]."""
    known = _known(model)
    values = jnp.concatenate([context_values(x, when), y])[jnp.array([known.index(name) for name in context])]
    return jnp.where(jnp.array(angular(context, model)), wrap_angle(values), values)


def angular(context: tuple[str, ...], model: AbstractModel) -> tuple[bool, ...]:
    """Which numbers of a context are angles; inputs never are.

    Raises:
        ConfigError: a name that is no state, input, output or time.
    """
    known = _known(model)
    for name in context:
        if name not in known:
            raise ConfigError(f"context: {name!r} is no state, input, output or time; {did_you_mean(name, known)}")
    own = [model.space, model.output]
    angles = {name for space in own for part in space.parts if isinstance(part, Circle) for name in part.names}
    return tuple(name in angles for name in context)


def _known(model: AbstractModel) -> list[str]:
    """Names of all a context may hold; a name that is a state and an output is the state."""
    return [*model.space.names, *model.inputs, "t", "dt", *model.output.names]
