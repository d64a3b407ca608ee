"""Training of a perceptron by gradients."""

from __future__ import annotations

from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, did_you_mean
from .base import AbstractTraining, TrainingReport, checked_examples
from .inputs import input_warnings, varying
from .perceptron import MultilayerPerceptron, Parameters

METHODS = ("lbfgs", "sgd")

_OUTPUT_VARIANCE = 0.01
"""Variance of the start of a unit's weighted sum in the last layer, so that the network begins near zero."""

_WORSE = 1e6
"""A loss so many times that of a constant counts as lost, like one that is not finite."""


class PerceptronTraining(AbstractTraining):
    """How a multilayer perceptron is made from examples.

    Weights start as `N(0, 1/d)`, those of the last layer smaller, biases at 0. A step after which a weight is not finite ends
    the training, and the last finite weights are kept.

    Attributes:
        hidden: units of each hidden layer.
        method: "lbfgs" on all examples at once, or "sgd" on small batches of them.
        rate: step of "sgd", on squares in units of the targets' variance.
        batch: examples per step of "sgd".
        epochs: times through the examples of "sgd", each in a new random order.
        iterations: steps of "lbfgs".

    Raises:
        ConfigError: an argument out of its range.

    Source: Liu and Nocedal (1989), Math. Program. 45:503-528, for "lbfgs".

    Example:
        >>> u = np.linspace(-1.0, 1.0, 200)[:, None]
        >>> network, report = PerceptronTraining(hidden=(4,))(u, u**3, key=jax.random.key(0))
        >>> bool(report.after[0] < 1e-3 * report.before[0])
        True
    """

    hidden: tuple[int, ...] = eqx.field(static=True, default=(10,))
    method: Literal["lbfgs", "sgd"] = eqx.field(static=True, default="lbfgs")
    rate: float = 0.05
    batch: int = eqx.field(static=True, default=8)
    epochs: int = eqx.field(static=True, default=20)
    iterations: int = eqx.field(static=True, default=200)

    def __check_init__(self) -> None:
        if self.method not in METHODS:
            raise ConfigError(f"method: {self.method!r} is not known; {did_you_mean(str(self.method), METHODS)}")
        for name, values in (
            ("hidden", self.hidden),
            ("batch", (self.batch,)),
            ("epochs", (self.epochs,)),
            ("iterations", (self.iterations,)),
        ):
            if not values or any(isinstance(n, bool) or not isinstance(n, int) or n < 1 for n in values):
                raise ConfigError(f"{name}: expected whole numbers of at least 1, got {getattr(self, name)!r}")
        if not self.rate > 0:
            raise ConfigError(f"rate: expected a number above 0, got {self.rate!r}")

    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[MultilayerPerceptron, TrainingReport]:
        inputs, targets = checked_examples(inputs, targets)
        own, key = jax.random.split(key)
        network = make_perceptron(inputs, targets, self.hidden, key=own)
        return train_perceptron(network, inputs, targets, self, key=key)


def make_perceptron(
    inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], hidden: tuple[int, ...], *, key: Array
) -> MultilayerPerceptron:
    """A perceptron that has learned nothing but the scales of its examples; inputs that do not vary are left out.

    Args:
        inputs: one row per example.
        targets: likewise.
        hidden: units of each hidden layer.
        key: random key of the weights.
    """
    columns = varying(inputs)
    chosen = inputs[:, list(columns)]
    widths = (len(columns), *hidden, targets.shape[1])
    weights = []
    for k, own in enumerate(jax.random.split(key, len(widths) - 1)):
        variance = (1.0 if k < len(hidden) else _OUTPUT_VARIANCE) / max(widths[k], 1)
        weights.append(np.sqrt(variance) * jax.random.normal(own, (widths[k + 1], widths[k]), float))
    size = targets.std(axis=0)
    return MultilayerPerceptron(
        tuple(weights),
        tuple(jnp.zeros(width) for width in widths[1:]),
        centre=jnp.asarray(chosen.mean(axis=0)),
        spread=jnp.asarray(chosen.std(axis=0)),
        size=jnp.asarray(np.where(size > 0, size, 1.0)),
        low=jnp.asarray(chosen.min(axis=0)),
        high=jnp.asarray(chosen.max(axis=0)),
        columns=columns,
        width=inputs.shape[1],
    )


def train_perceptron(
    network: MultilayerPerceptron,
    inputs: Float[np.ndarray, "N d"],
    targets: Float[np.ndarray, "N m"],
    recipe: PerceptronTraining,
    *,
    key: Array,
) -> tuple[MultilayerPerceptron, TrainingReport]:
    """The network trained further; its scales stay.

    Args:
        network: where to start.
        inputs: one row per example.
        targets: likewise.
        recipe: method, rate, batch and length.
        key: random key of the order of the examples.
    """
    inputs, targets = checked_examples(inputs, targets)
    data = jnp.asarray(inputs), jnp.asarray(targets)
    train = _by_lbfgs if recipe.method == "lbfgs" else _by_descent
    # The rate is an array, so that trainings that differ in it share a program.
    tunable = eqx.tree_at(lambda each: each.rate, recipe, jnp.asarray(recipe.rate, float))
    trained, lost = train(network, *data, tunable, key)
    hint = "lower the rate" if recipe.method == "sgd" else "look for outliers among the examples"
    return trained, perceptron_report(trained, inputs, targets, hint if bool(lost) else None)


def perceptron_report(
    trained: MultilayerPerceptron,
    inputs: Float[np.ndarray, "N d"],
    targets: Float[np.ndarray, "N m"],
    cure: str | None = None,
) -> TrainingReport:
    """What training did.

    Args:
        trained: the network after it.
        inputs: one row per example.
        targets: likewise.
        cure: what to do about training that ran away, None if it did not.
    """
    rank, warnings = input_warnings(inputs, trained.columns)
    if cure is not None:
        warnings += (f"training ran away and was ended with the last weights that were sound: {cure}",)
    left = targets - np.asarray(jax.vmap(trained)(jnp.asarray(inputs)))
    dropped = tuple(k for k in range(trained.inputs) if k not in trained.columns)
    before, after = np.mean(targets**2, axis=0), np.mean(left**2, axis=0)
    return TrainingReport(len(inputs), before, after, dropped, rank, None, warnings)


def mean_square(
    parameters: Parameters, network: MultilayerPerceptron, inputs: Array, targets: Array
) -> Float[Array, ""]:
    """Mean square of what is left of the targets, in units of their variance."""
    left = (targets - jax.vmap(network.with_parameters(parameters))(inputs)) / network.size
    return jnp.mean(jnp.sum(left**2, axis=1))


def _sound(weights: Any, loss: Any) -> Bool[Array, ""]:
    flat = jnp.concatenate([leaf.ravel() for leaf in jax.tree.leaves(weights)])
    return jnp.all(jnp.isfinite(flat)) & (loss < _WORSE)


def _keep(sound: Array, new: Any, old: Any) -> Any:
    return jax.tree.map(lambda now, then: jnp.where(sound, now, then), new, old)


@eqx.filter_jit
def _by_descent(
    network: MultilayerPerceptron, inputs: Array, targets: Array, recipe: PerceptronTraining, key: Array
) -> tuple[MultilayerPerceptron, Bool[Array, ""]]:
    batch = min(recipe.batch, len(inputs))
    steps = len(inputs) // batch
    optimiser = optax.sgd(recipe.rate)

    def step(carry: Any, rows: Array) -> tuple[Any, None]:
        weights, memory, lost = carry
        loss, slope = jax.value_and_grad(mean_square)(weights, network, inputs[rows], targets[rows])
        moves, after = optimiser.update(slope, memory)
        new = optax.apply_updates(weights, moves)
        sound = _sound(new, loss) & ~lost
        return (_keep(sound, new, weights), _keep(sound, after, memory), ~sound), None

    def epoch(carry: Any, own: Array) -> tuple[Any, None]:
        order = jax.random.permutation(own, len(inputs))[: steps * batch]
        return jax.lax.scan(step, carry, order.reshape(steps, batch))

    start = network.parameters
    first = (start, optimiser.init(start), jnp.array(False))
    (weights, _, lost), _ = jax.lax.scan(epoch, first, jax.random.split(key, recipe.epochs))
    return network.with_parameters(weights), lost


@eqx.filter_jit
def _by_lbfgs(
    network: MultilayerPerceptron, inputs: Array, targets: Array, recipe: PerceptronTraining, key: Array
) -> tuple[MultilayerPerceptron, Bool[Array, ""]]:
    optimiser = optax.lbfgs()

    def loss_of(weights: Parameters) -> Array:
        return mean_square(weights, network, inputs, targets)

    recall = optax.value_and_grad_from_state(loss_of)

    def step(carry: Any, _: None) -> tuple[Any, None]:
        weights, memory, lost = carry
        loss, slope = recall(weights, state=memory)
        moves, after = optimiser.update(slope, memory, weights, value=loss, grad=slope, value_fn=loss_of)
        new = optax.apply_updates(weights, moves)
        sound = _sound(new, loss) & ~lost
        return (_keep(sound, new, weights), _keep(sound, after, memory), ~sound), None

    start = network.parameters
    first = (start, optimiser.init(start), jnp.array(False))
    (weights, _, lost), _ = jax.lax.scan(step, first, length=recipe.iterations)
    return network.with_parameters(weights), lost
