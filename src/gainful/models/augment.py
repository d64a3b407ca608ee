"""Parameters and sensor biases as states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ModelError
from ..spaces import AbstractSpace, Product, make_space
from .base import AbstractModel, Instant, block_diagonal
from .extended import AbstractExtendedModel
from .model import unknown_name


class AugmentedModel(AbstractExtendedModel):
    """A model whose state carries parameters and biases as well; made by `augment`.

    Attributes:
        base: the model it extends.
        extra: space of the added states.
        walk: their random-walk densities, in tangent units squared per second (k,).
        parameter_names: which of them are parameters of the base model, in order, before the biases.
        output_rows: for each bias, the output it shifts, or -1.
        input_rows: for each bias, the input it shifts, or -1.
    """

    base: AbstractModel
    extra: AbstractSpace
    walk: Float[Array, " k"]
    space: AbstractSpace
    output: AbstractSpace
    inputs: tuple[str, ...] = eqx.field(static=True)
    input_units: tuple[str, ...] = eqx.field(static=True)
    parameters: dict[str, Array]
    parameter_names: tuple[str, ...] = eqx.field(static=True)
    output_rows: tuple[int, ...] = eqx.field(static=True)
    input_rows: tuple[int, ...] = eqx.field(static=True)

    def _split(self, x: Array, when: Instant) -> tuple[AbstractModel, Array, Array, Instant]:
        """The base model with its parameters set, its state, the added states, and the corrected inputs."""
        n, k = self.base.space.size, len(self.parameter_names)
        state, extra = x[:n], x[n:]
        model = self.base
        if k:
            model = model.with_parameters({name: extra[i] for i, name in enumerate(self.parameter_names)})
        u = when.u
        for i, row in enumerate(self.input_rows):
            if row >= 0:
                u = u.at[row].add(-extra[k + i])
        return model, state, extra, Instant(when.t, when.dt, u)

    def transition(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " size"]:
        model, state, extra, then = self._split(x, when)
        return jnp.concatenate([model.transition(state, then), extra])

    def process_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "dof dof"]:
        model, state, _, then = self._split(x, when)
        return block_diagonal([model.process_noise(state, then), jnp.diag(self.walk.astype(x.dtype) * when.dt)])

    def observe(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " output_size"]:
        model, state, extra, then = self._split(x, when)
        y = model.observe(state, then)
        shift = jnp.zeros(self.output.dof, x.dtype)
        for i, row in enumerate(self.output_rows):
            if row >= 0:
                shift = shift.at[row].add(extra[len(self.parameter_names) + i])
        return self.output.plus(y, shift) if any(row >= 0 for row in self.output_rows) else y

    def measurement_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "output_dof output_dof"]:
        model, state, _, then = self._split(x, when)
        return model.measurement_noise(state, then)


def augment(
    model: AbstractModel,
    *,
    parameters: Mapping[str, float] | None = None,
    biases: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
) -> AugmentedModel:
    """The model with parameters and sensor biases estimated as further states.

    Args:
        model: the model to extend.
        parameters: names of the model's parameters, each with the sigma of its random walk per square root of a second;
            0 makes it constant. Under bounds the walk is in the unbounded coordinate: relative for a positive parameter.
        biases: names of outputs or inputs that read their true value plus a bias, each with its walk likewise; the
            added state is called `bias_<name>`.
        bounds: per parameter `(0, None)` to keep it positive or `(lower, upper)` to keep it between.

    Raises:
        ModelError: an unknown name, a negative walk, or nothing to add.

    Example:
        >>> from gainful.models import linear_model
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"], outputs=["y"])
        >>> augment(model, biases={"y": 0.0}).space.names
        ('x', 'bias_y')
    """
    parameters, biases, bounds = dict(parameters or {}), dict(biases or {}), dict(bounds or {})
    if not parameters and not biases:
        raise ModelError("augment: expected at least one parameter or bias, got none")
    walks = []
    for name, walk in (parameters | biases).items():
        if not isinstance(walk, (int, float)) or not walk >= 0:
            raise ModelError(f"walk of {name!r}: expected a number of at least 0, got {walk!r}")
        walks.append(float(walk) ** 2)
    for name in parameters:
        if name not in model.parameters:
            raise unknown_name("parameter", name, list(model.parameters))
        if model.parameters[name].ndim:
            raise ModelError(f"parameter {name!r}: expected a single number, got shape {model.parameters[name].shape}")
    for name in bounds:
        if name not in parameters:
            raise unknown_name("bounds: parameter", name, list(parameters))
    outputs, rows_out, rows_in, units = list(model.output.tangent_names), [], [], []
    for name in biases:
        if name not in outputs and name not in model.inputs:
            raise unknown_name("bias: signal", name, [*outputs, *model.inputs])
        rows_out.append(outputs.index(name) if name in outputs else -1)
        rows_in.append(model.inputs.index(name) if name in model.inputs else -1)
        units.append(model.output.tangent_units[rows_out[-1]] if rows_out[-1] >= 0 else model.input_units[rows_in[-1]])
    signals: dict[str, Any] = {name: bounds.get(name, "1") for name in parameters}
    signals |= {f"bias_{name}": unit for name, unit in zip(biases, units, strict=True)}
    taken = set(signals) & set(model.space.names)
    if taken:
        raise ModelError(f"augment: {sorted(taken)[0]!r} is already a state of the model")
    extra = make_space(signals)
    return AugmentedModel(
        base=model,
        extra=extra,
        walk=jnp.asarray(walks),
        space=Product([model.space, extra], added=model.space.added + extra.dof),
        output=model.output,
        inputs=model.inputs,
        input_units=model.input_units,
        parameters={name: value for name, value in model.parameters.items() if name not in parameters},
        parameter_names=tuple(parameters),
        output_rows=tuple(rows_out),
        input_rows=tuple(rows_in),
    )
