"""Models that predict the next sample of a plant, learned from rows of state, control and next state."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, DataError, ShapeError, did_you_mean
from ..networks import AbstractNetwork, LinearInWeights
from ..regression import WeightFilter, WeightState

FORMS = ("increment", "absolute")

_STILL = 1e-12
"""Standard deviation of an output, relative to its size, below which it does not vary but by rounding."""

_ILL_CONDITIONED = 1e12
"""Condition number beyond which no four digits are left of what a covariance recursion predicts."""


class OneStepModel(eqx.Module):
    """The next state of a plant, by a network that is told the control and the state.

    ```
    x(k+1) = x(k) + scale network([u(k); x(k)])     increment
    x(k+1) = scale network([u(k); x(k)])            absolute
    ```

    Where a state moves little in a step, only the increment tells what the control did: an error of a hundredth of the state
    is larger than all that the control moves.

    Attributes:
        network: takes controls, then states, and gives as many outputs as there are states.
        output_scale: unit of each output, in that of its state (n,).
        form: "increment" or "absolute".

    Raises:
        ConfigError: an unknown form.
        ShapeError: a scale that is not one number per output.

    Source: Narendra and Parthasarathy (1990), IEEE Trans. Neural Netw. 1(1):4-27, for the series-parallel form.

    Example:
        >>> from gainful.networks import AffineMap
        >>> model = OneStepModel(AffineMap(jnp.array([[0.1, 0.0]]), jnp.zeros(1)), jnp.array([2.0]))
        >>> round(float(model(jnp.array([1.0]), jnp.array([5.0]))[0]), 9)
        2.0
    """

    network: AbstractNetwork
    output_scale: Float[Array, " n"]
    form: Literal["increment", "absolute"] = eqx.field(static=True, default="increment")

    def __check_init__(self) -> None:
        if self.form not in FORMS:
            raise ConfigError(f"form: {self.form!r} is not known; {did_you_mean(str(self.form), FORMS)}")
        if self.output_scale.shape != (self.network.outputs,):
            raise ShapeError(
                f"output_scale: expected {self.network.outputs} numbers, one per output, got shape {self.output_scale.shape}"
            )

    @property
    def states(self) -> int:
        """`n`."""
        return self.network.outputs

    @property
    def controls(self) -> int:
        """`m`."""
        return self.network.inputs - self.network.outputs

    def outputs(self, x: Float[Array, " n"], u: Float[Array, " m"]) -> Float[Array, " n"]:
        """`y`, what the network says, in units of `output_scale`."""
        return self.network(jnp.concatenate([u, x]))

    def features(self, x: Float[Array, " n"], u: Float[Array, " m"]) -> Float[Array, " l"]:
        """What the weights of a network that is linear in them are applied to, as a `WeightFilter` asks for.

        Raises:
            ConfigError: the network is not linear in its weights.
        """
        return linear(self.network).features(jnp.concatenate([u, x]))

    def __call__(self, x: Float[Array, " n"], u: Float[Array, " m"]) -> Float[Array, " n"]:
        """The next state.

        Args:
            x: the state.
            u: the control that was applied, after whatever limits it.
        """
        return self.base(x) + self.output_scale * self.outputs(x, u)

    def targets(self, x: Float[Array, " n"], following: Float[Array, " n"]) -> Float[Array, " n"]:
        """The `y` that would have given the state that followed."""
        return (following - self.base(x)) / self.output_scale

    def base(self, x: Float[Array, " n"]) -> Float[Array, " n"]:
        """To what the network's output is added."""
        return x if self.form == "increment" else jnp.zeros_like(x)

    def control_jacobian(self, x: Float[Array, " n"], u: Float[Array, " m"]) -> Float[Array, "n m"]:
        """How the next state changes with the control, in their units."""
        return self.output_scale[:, None] * jax.jacfwd(lambda v: self.outputs(x, v))(u)

    def contains(self, x: Float[Array, " n"], u: Float[Array, " m"]) -> Bool[Array, ""]:
        """Whether the network knows of such states and controls."""
        return self.network.contains(jnp.concatenate([u, x]))

    def with_weights(self, weights: Float[Array, "l n"]) -> OneStepModel:
        """The model with other weights of a network that is linear in them."""
        return eqx.tree_at(lambda model: model.network, self, linear(self.network).with_weights(weights))


@dataclasses.dataclass(frozen=True)
class OneStepReport:
    """What a fit did.

    Attributes:
        samples: how many rows there were.
        parameters: weights per output.
        condition: condition number of the weights' covariance.
        before: mean square of each scaled output (n,).
        after: mean square of what is left of each on the rows themselves (n,).
        warnings: what a reader of the numbers should know.
    """

    samples: int
    parameters: int
    condition: float
    before: Float[np.ndarray, " n"]
    after: Float[np.ndarray, " n"]
    warnings: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class OneStepFit:
    """A model, and what is needed to go on learning.

    Attributes:
        model: with the fitted weights.
        weight_filter: whose `update` goes on.
        state: from where it goes on.
        report: what the fit did.
    """

    model: OneStepModel
    weight_filter: WeightFilter
    state: WeightState
    report: OneStepReport


def fit_one_step(
    network: LinearInWeights,
    states: Float[np.ndarray, "N n"],
    controls: Float[np.ndarray, "N m"],
    following: Float[np.ndarray, "N n"],
    *,
    form: Literal["increment", "absolute"] = "increment",
    weight_filter: WeightFilter | None = None,
    names: Sequence[str] | None = None,
) -> OneStepFit:
    """Fit the weights of a network that is linear in them to rows that need not follow each other.

    Args:
        network: takes controls, then states; its weights are replaced.
        states: one row per example.
        controls: what was applied, likewise.
        following: the states one step later, likewise.
        form: "increment" or "absolute".
        weight_filter: how well weights are known before, and how noisy outputs are.
        names: of the states, for messages.

    Raises:
        ShapeError: arrays that do not fit each other or the network.
        DataError: numbers that are not finite, or an output that does not vary.
        ConfigError: the network is not linear in its weights, or an unknown form.

    Example:
        >>> from gainful.networks import ProductFeatures, make_radial_basis
        >>> x, u = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 200, 1))
        >>> bilinear = make_radial_basis(ProductFeatures([1.0, 1.0]), 1, 0, tail="lift")
        >>> model = fit_one_step(bilinear, x, u, 0.9 * x + 0.2 * u + 0.1 * u * x).model
        >>> round(float(model(jnp.array([0.5]), jnp.array([1.0]))[0]), 6)
        0.7
    """
    chosen = WeightFilter() if weight_filter is None else weight_filter
    rows = _checked(linear(network), states, controls, following)
    states, controls, following = rows
    base = states if form == "increment" else np.zeros_like(states)
    scale = _scale(following, base, [f"x{k}" for k in range(network.outputs)] if names is None else list(names))
    model = OneStepModel(network, jnp.asarray(scale), form)
    features = jax.jit(jax.vmap(model.features))(jnp.asarray(states), jnp.asarray(controls))
    targets = (following - base) / scale
    state = chosen.fitted(np.asarray(features), targets)
    left = targets - np.asarray(features @ state.weights)
    condition, parameters = float(state.condition), len(state.weights)
    warnings = list(network.cautions())
    if len(states) < parameters:
        warnings.append(
            f"{len(states)} rows for {parameters} weights: how the outputs change with the control is not identified"
        )
    if not condition < _ILL_CONDITIONED:
        warnings.append(
            f"the weights' covariance has a condition number of {condition:.0e}: raise the gain of the lifting"
        )
    before, after = np.mean(targets**2, axis=0), np.mean(left**2, axis=0)
    report = OneStepReport(len(states), parameters, condition, before, after, tuple(warnings))
    return OneStepFit(model.with_weights(state.weights), chosen, state, report)


def ill_conditioned(condition: float) -> list[str]:
    """What to say of a condition number of weights, if anything."""
    if condition < _ILL_CONDITIONED:
        return []
    return [f"the weights' covariance has a condition number of {condition:.0e}: raise the gain of the lifting"]


def linear(network: AbstractNetwork) -> LinearInWeights:
    """The network, if it is linear in its weights.

    Raises:
        ConfigError: it is not.
    """
    if not isinstance(network, LinearInWeights):
        raise ConfigError(f"network: expected one that is linear in its weights, got a {type(network).__name__}")
    return network


def _checked(network: AbstractNetwork, *arrays: np.ndarray) -> list[np.ndarray]:
    names = ("states", "controls", "following")
    widths = (network.outputs, network.inputs - network.outputs, network.outputs)
    tables = [np.asarray(values, float) for values in arrays]
    for name, width, values in zip(names, widths, tables, strict=True):
        if values.ndim != 2 or values.shape[1] != width or len(values) != len(tables[0]):
            raise ShapeError(f"{name}: expected shape {(len(tables[0]), width)}, got {values.shape}")
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise DataError(f"{name}: expected finite numbers, got {values[bad[0]]} in row {bad[0]}")
    return tables


def _scale(following: np.ndarray, base: np.ndarray, names: list[str]) -> np.ndarray:
    """Standard deviation of every output."""
    scale = (following - base).std(axis=0)
    still = np.flatnonzero(scale <= _STILL * np.maximum(np.abs(following).max(axis=0), np.abs(base).max(axis=0)))
    if still.size:
        raise DataError(f"following: expected outputs that vary, got a constant for {names[still[0]]}")
    return scale
