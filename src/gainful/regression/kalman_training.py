"""Training of a perceptron by a Kalman filter whose state is its weights."""

from __future__ import annotations

import abc
import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, Status
from ..estimates import Gaussian
from ..filters import KalmanFilter
from ..models import Instant, Model, Sample, discrete_model
from ..networks import AbstractTraining, MultilayerPerceptron, TrainingReport, make_perceptron
from ..networks.base import checked_examples
from ..networks.perceptron_training import perceptron_report

_CURE = "lower prior_variance or raise noise_variance"


class AbstractKalmanTraining(AbstractTraining):
    """What trainings by a Kalman filter share: the start, the order of the examples, and the report.

    Attributes:
        hidden: units of each hidden layer.
        prior_variance: of every weight about its start.
        noise_variance: of the targets, in units of their variance.
        random_walk: variance that every weight gains per example.
        epochs: times through the examples, each in a new random order.
    """

    hidden: eqx.AbstractVar[tuple[int, ...]]
    prior_variance: eqx.AbstractVar[float]
    noise_variance: eqx.AbstractVar[float]
    random_walk: eqx.AbstractVar[float]
    epochs: eqx.AbstractVar[int]

    def __check_init__(self) -> None:
        for name, values in (("hidden", self.hidden), ("epochs", (self.epochs,))):
            if not values or any(isinstance(n, bool) or not isinstance(n, int) or n < 1 for n in values):
                raise ConfigError(f"{name}: expected whole numbers of at least 1, got {getattr(self, name)!r}")
        for name, least in (
            ("prior_variance", "above 0"),
            ("noise_variance", "above 0"),
            ("random_walk", "of at least 0"),
        ):
            value = getattr(self, name)
            if isinstance(value, Tracer):
                continue
            if not (0 <= value < math.inf) or (value == 0 and least == "above 0"):
                raise ConfigError(f"{name}: expected a number {least}, got {value!r}")

    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[MultilayerPerceptron, TrainingReport]:
        inputs, targets = checked_examples(inputs, targets)
        own, key = jax.random.split(key)
        return self.train(make_perceptron(inputs, targets, self.hidden, key=own), inputs, targets, key=key)

    def train(
        self,
        network: MultilayerPerceptron,
        inputs: Float[np.ndarray, "N d"],
        targets: Float[np.ndarray, "N m"],
        *,
        key: Array,
    ) -> tuple[MultilayerPerceptron, TrainingReport]:
        """The network trained further; its scales stay.

        Args:
            network: where to start.
            inputs: one row per example.
            targets: likewise.
            key: random key of the order of the examples.
        """
        inputs, targets = checked_examples(inputs, targets)
        trained, sound = _through(self, network, jnp.asarray(inputs), jnp.asarray(targets), key)
        return trained, perceptron_report(trained, inputs, targets, None if bool(sound) else _CURE)

    @abc.abstractmethod
    def start(self, network: MultilayerPerceptron) -> Any:
        """What is known of the weights before the first example."""

    @abc.abstractmethod
    def learned(self, network: MultilayerPerceptron, known: Any, u: Array, y: Array) -> tuple[Any, Bool[Array, ""]]:
        """What is known after one example, and whether it is sound."""

    @abc.abstractmethod
    def trained(self, network: MultilayerPerceptron, known: Any) -> MultilayerPerceptron:
        """The network with what is known."""


class KalmanTraining(AbstractKalmanTraining):
    """A perceptron's weights as the state of a model with a random walk, which a filter of one's choice follows.

    ```
    w <- w + N(0, random_walk);   y = network(u; w) + N(0, noise_variance size^2)
    ```

    Every part of a filter applies: sigma points in place of slopes, a square root where the covariance is ill-conditioned,
    robust updates for targets with outliers, noise that is learned. The filter treats all weights together, at a cost of the
    cube of their number per example: for more than a hundred take `DecoupledKalmanTraining`.

    Attributes:
        hidden: units of each hidden layer.
        filter: of the weights; by default the extended Kalman filter.
        prior_variance: of every weight about its start.
        noise_variance: of the targets, in units of their variance.
        random_walk: variance that every weight gains per example.
        epochs: times through the examples, each in a new random order.

    Raises:
        ConfigError: an argument out of its range.

    Source: Singhal and Wu (1989), Advances in Neural Information Processing Systems 1:133-140.

    Example:
        >>> u = np.linspace(-1.0, 1.0, 200)[:, None]
        >>> network, report = KalmanTraining(hidden=(4,))(u, u**3, key=jax.random.key(0))
        >>> bool(report.after[0] < 1e-2 * report.before[0])
        True
    """

    hidden: tuple[int, ...] = eqx.field(static=True, default=(5,))
    filter: KalmanFilter = KalmanFilter()
    prior_variance: float = 1.0
    noise_variance: float = 1e-3
    random_walk: float = 0.0
    epochs: int = eqx.field(static=True, default=2)

    def start(self, network: MultilayerPerceptron) -> Any:
        model, weights = self._model(network), ravel_pytree(network.parameters)[0]
        return self.filter.init(model, Gaussian(weights, self.prior_variance * jnp.eye(len(weights)), model.space))

    def learned(self, network: MultilayerPerceptron, known: Any, u: Array, y: Array) -> tuple[Any, Bool[Array, ""]]:
        when = Instant(jnp.zeros(()), jnp.ones(()), u)
        after, info = self.filter.step(self._model(network), known, Sample(when, y, jnp.ones(len(y), bool)))
        return after, info.status < Status.not_positive

    def trained(self, network: MultilayerPerceptron, known: Any) -> MultilayerPerceptron:
        return network.with_parameters(ravel_pytree(network.parameters)[1](known.estimate.mean))

    def _model(self, network: MultilayerPerceptron) -> Model:
        return network_weights_model(network, noise_variance=self.noise_variance, random_walk=self.random_walk)


def network_weights_model(
    network: MultilayerPerceptron, *, noise_variance: float = 1e-3, random_walk: float = 0.0
) -> Model:
    """The model whose state is a perceptron's weights: they walk at random, and the network's output is measured.

    Args:
        network: whose inputs are the model's, and whose weights and biases, layer by layer, its state.
        noise_variance: of the targets, in units of their variance.
        random_walk: variance that every weight gains per step.
    """
    size = len(ravel_pytree(network.parameters)[0])
    noise = noise_variance * network.size**2
    said, walk = _Said(network), random_walk * jnp.ones(size)
    return discrete_model(_stay, said, states=size, outputs=network.outputs, inputs=network.inputs, Q=walk, R=noise)


class _Said(eqx.Module):
    """What a network says with the state as its weights."""

    network: MultilayerPerceptron

    def __call__(self, x: Float[Array, " n"], u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return self.network.with_parameters(ravel_pytree(self.network.parameters)[1](x))(u)


def _stay(x: Float[Array, " n"]) -> Float[Array, " n"]:
    return x


@eqx.filter_jit
def _through(
    recipe: AbstractKalmanTraining, network: MultilayerPerceptron, inputs: Array, targets: Array, key: Array
) -> tuple[MultilayerPerceptron, Bool[Array, ""]]:
    """The network after all examples, and whether none of them did harm; after the first that did nothing is learned."""

    def step(carry: tuple[Any, Array], row: Array) -> tuple[tuple[Any, Array], None]:
        known, sound = carry
        after, good = recipe.learned(network, known, inputs[row], targets[row])
        good = good & sound
        return (jax.tree.map(lambda new, old: jnp.where(good, new, old), after, known), good), None

    keys = jax.random.split(key, recipe.epochs)
    order = jax.vmap(lambda own: jax.random.permutation(own, len(inputs)))(keys).ravel()
    (known, sound), _ = jax.lax.scan(step, (recipe.start(network), jnp.array(True)), order)
    return recipe.trained(network, known), sound
