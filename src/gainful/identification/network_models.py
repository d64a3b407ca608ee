"""A signal's next sample by a network, from a recording, beside linear equations of the same rows."""

from __future__ import annotations

import dataclasses
import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..errors import ConfigError, DataError, Status, did_you_mean
from ..networks import (
    AbstractNetwork,
    AbstractTraining,
    LinearInWeights,
    SummedNetwork,
    make_radial_basis,
    product_features_of,
)
from ..regression import DecoupledKalmanTraining, WeightFilter, WeightState
from ..regression.weak_form import WINDOW
from .assessment import Assessment, assess
from .equations import Equation, parse_equation
from .free_run import free_run_of
from .lagged_model import LaggedModel, Lags
from .methods import Problem
from .one_step import FORMS, ill_conditioned
from .recordings import Recording
from .windows import pointwise

KINDS = ("affine", "bilinear", "rbf", "mlp")
LINEAR_METHODS = ("ls", "tls")
"""Methods by which the linear equation of the same rows is found, to hold a network against."""
_MOST = 4000
"""Weights beyond which their covariance is too large to be worked with."""


@dataclasses.dataclass(frozen=True)
class NetworkRecipe:
    """How a network is made from rows.

    Attributes:
        kind: "affine" or "bilinear" regression, "rbf", or "mlp".
        form: whether the network predicts the "increment" of the signal or its "absolute" value.
        centres: of "rbf".
        kernel: of "rbf", "thin-plate" or "gaussian".
        width: of the Gaussian kernel, in units of a typical distance.
        placement: of the centres: "clusters", "examples" or "box".
        products: whether "rbf" is told products of what it is told.
        gain: size of what it is told at either end of its range.
        tail: what a network is added to: "none", an "affine" regression, or "lift", one on the products too.
        noise_variance: of the signal, in units of the variance of what is predicted.
        prior_variance: of every weight that is found by least squares.
        forgetting: how much a row counts one row later.
        random_walk: variance that every weight gains per row.
        training: of "mlp", on what the tail leaves.
        seed: of the random numbers.

    Raises:
        ConfigError: an unknown kind or form.
    """

    kind: Literal["affine", "bilinear", "rbf", "mlp"] = "rbf"
    form: Literal["increment", "absolute"] = "increment"
    centres: int = 50
    kernel: Literal["thin-plate", "gaussian"] = "thin-plate"
    width: float = 1.0
    placement: Literal["clusters", "examples", "box"] = "clusters"
    products: bool = False
    gain: float = 1.0
    tail: Literal["none", "affine", "lift"] = "affine"
    noise_variance: float = 1e-2
    prior_variance: float = 1e4
    forgetting: float = 1.0
    random_walk: float = 0.0
    training: AbstractTraining = dataclasses.field(default_factory=lambda: DecoupledKalmanTraining(noise_variance=1.0))
    seed: int = 0

    def __post_init__(self) -> None:
        for name, value, known in (("kind", self.kind, KINDS), ("form", self.form, FORMS)):
            if value not in known:
                raise ConfigError(f"{name}: {value!r} is not known; {did_you_mean(str(value), known)}")
        _ = self.weight_filter  # which checks its numbers

    @property
    def weight_filter(self) -> WeightFilter:
        """Of the weights that are found by least squares."""
        return WeightFilter(self.prior_variance, self.noise_variance, self.forgetting, self.random_walk)

    @property
    def recursive(self) -> bool:
        """Whether weights change along the rows."""
        return self.forgetting < 1.0 or self.random_walk > 0.0

    def linear(self, rows: Float[np.ndarray, "N d"]) -> LinearInWeights | None:
        """The part of the network that is linear in its weights, for such rows; None if there is none."""
        tail = {"affine": "affine", "bilinear": "lift"}.get(self.kind, self.tail)
        if self.kind == "mlp" and tail == "none":
            return None
        centres = self.centres if self.kind == "rbf" else 0
        lifting = product_features_of(rows, gain=self.gain, products=self.products or tail == "lift")
        return make_radial_basis(
            lifting,
            1,
            centres,
            kernel=self.kernel,
            tail=tail,  # type: ignore[arg-type]  # one of the tails
            width=self.width * float(np.sqrt(lifting.size / 3.0)) * self.gain,
            placement=self.placement,
            examples=rows,
            rng=self.seed,
        )


@dataclasses.dataclass(frozen=True)
class NetworkIdentification:
    """A network found in a recording; made by `identify_network`.

    Attributes:
        model: that predicts.
        recipe: by which it was made.
        recording: it was found in.
        rows: how many were whole.
        weights: how many were found.
        state: what is known of those found by least squares, None if none were.
        assessment: on the recording itself.
        cautions: what a reader of the numbers should know.
    """

    model: LaggedModel
    recipe: NetworkRecipe
    recording: Recording
    rows: int
    weights: int
    state: WeightState | None
    assessment: Assessment
    cautions: tuple[str, ...]

    @property
    def condition(self) -> float:
        """Condition number of the covariance of the weights found by least squares; NaN where there are none."""
        return float("nan") if self.state is None else float(self.state.condition)

    def check(self, recording: Recording) -> Assessment:
        """The network held against another recording."""
        return check_network(self.model, recording)

    def outside(self, recording: Recording) -> float:
        """Share of rows in which the network is told what it was not trained on."""
        rows = self.model.lags.rows(recording.mean())
        rows = rows[np.isfinite(rows).all(axis=1)]
        inside = jax.jit(jax.vmap(self.model.network.contains))(jnp.asarray(rows))
        return 1.0 - float(np.mean(inside)) if len(rows) else float("nan")

    def adapted(self, recording: Recording) -> Assessment | None:
        """One row ahead while learning goes on from row to row; None unless weights change and all are by least squares."""
        network, state = self.model.network, self.state
        if state is None or not self.recipe.recursive or not isinstance(network, LinearInWeights):
            return None
        signals = recording.mean()
        rows, measured, targets = _examples(self.model, signals)
        _, left = _learned(self.recipe.weight_filter, network, state, rows, targets)
        explained = measured - float(self.model.output_scale) * left[:, 0]
        nothing = np.full(len(recording), np.nan)
        return Assessment(recording.t, measured, explained, "", nothing, nothing)

    @functools.cached_property
    def equation(self) -> Equation:
        """The linear equation of the same rows."""
        return linear_equation(self.model.lags)

    def linear_checks(self, recording: Recording) -> dict[str, Assessment]:
        """The linear equation of the same rows, found in the same recording, held against another one, by method."""
        problem = Problem(self.equation, self.recording, WINDOW)
        fits = {name: problem.fit(name) for name in LINEAR_METHODS}
        # Named: where an input acts at once, the equation could be solved for that as well.
        run, window = free_run_of(self.equation, self.model.lags.of), pointwise(recording.dt)
        return {
            name: assess(self.equation, np.asarray(fit.theta), recording, window, run)
            for name, fit in fits.items()
            if fit.status == Status.ok
        }


def check_network(model: LaggedModel, recording: Recording) -> Assessment:
    """A network held against a recording, of which the mean of all sensors counts."""
    signals = recording.mean()
    measured = np.where(np.isfinite(model.lags.rows(signals)).all(axis=1), signals[model.lags.of], np.nan)
    return Assessment(
        recording.t, measured, model.one_step(signals), model.lags.of, signals[model.lags.of], model.free_run(signals)
    )


def linear_equation(lags: Lags) -> Equation:
    """The equation that is linear in the same rows, without an offset.

    Example:
        >>> linear_equation(Lags("y", 1, {"u": 2})).parameters
        ('u_0', 'u_1', 'y_1')
    """
    names = [f"{name}_{lags.delay + k}" for name, count in lags.inputs for k in range(count)]
    names += [f"{lags.of}_{k}" for k in range(1, lags.own + 1)]
    return parse_equation(lags.of, dict(zip(names, lags.names, strict=True)), lags.signals)


def identify_network(lags: Lags, recording: Recording, recipe: NetworkRecipe | None = None) -> NetworkIdentification:
    """Find a network that predicts a signal's next sample.

    Args:
        lags: which rows it is told.
        recording: of the signals.
        recipe: kind and size of the network, and how it learns.

    Raises:
        ConfigError: a signal that is not recorded, or an argument out of its range.
        DataError: too few rows, or a signal that does not vary.

    Example:
        >>> u = np.sin(np.arange(200.0) ** 1.5)
        >>> y = np.zeros(200)
        >>> for k in range(1, 200):
        ...     y[k] = 0.8 * y[k - 1] + 0.5 * u[k] - 0.1 * u[k] * y[k - 1]
        >>> recording = Recording(np.arange(200.0), {"y": y, "u": u})
        >>> found = identify_network(Lags("y", 1, {"u": 1}), recording, NetworkRecipe("bilinear"))
        >>> round(found.assessment.simulated_share, 6)
        1.0
    """
    recipe = NetworkRecipe() if recipe is None else recipe
    for name in lags.signals:
        if name not in recording.values:
            raise ConfigError(f"recording: expected all of {', '.join(lags.signals)}, got no {name!r}")
    signals = recording.mean()
    rows, measured = lags.rows(signals), signals[lags.of]
    whole = np.isfinite(rows).all(axis=1) & np.isfinite(measured)
    if whole.sum() <= rows.shape[1]:
        told = f"the {rows.shape[1]} numbers that the network is told of each"
        raise DataError(f"rows: expected more whole ones than {told}, got {whole.sum()}")
    base = rows[whole, -lags.own] if recipe.form == "increment" else 0.0
    scale = float((measured[whole] - base).std())
    if scale <= 1e-12 * float(np.abs(measured[whole]).max()):
        raise DataError(f"{lags.of}: expected a signal that varies, got a constant in the rows that are whole")
    inputs, targets = rows[whole], ((measured[whole] - base) / scale)[:, None]
    network, state, weights, cautions = _fitted(recipe, inputs, targets)
    model = LaggedModel(network, jnp.asarray(scale), lags, recipe.form)
    own = check_network(model, recording)
    return NetworkIdentification(model, recipe, recording, int(whole.sum()), weights, state, own, cautions)


def _fitted(
    recipe: NetworkRecipe, inputs: np.ndarray, targets: np.ndarray
) -> tuple[AbstractNetwork, WeightState | None, int, tuple[str, ...]]:
    """The network, what is known of the weights found by least squares, how many there are, and cautions."""
    line, state, parts, weights, cautions = recipe.linear(inputs), None, [], 0, []
    if line is not None:
        count = len(line.weights)
        if count > _MOST:
            raise ConfigError(
                f"network: expected at most {_MOST} weights, got {count}: take fewer lags, or no products"
            )
        if recipe.recursive:
            start = recipe.weight_filter.init(count, 1)
            state, _ = _learned(recipe.weight_filter, line, start, inputs, targets)
        else:
            state = recipe.weight_filter.fitted(_features(line, inputs), targets)
        line, weights = line.with_weights(state.weights), count
        parts.append(line)
        cautions += [*line.cautions(), *ill_conditioned(float(state.condition))]
        targets = targets - np.asarray(jax.jit(jax.vmap(line))(jnp.asarray(inputs)))
    if recipe.kind == "mlp":
        network, report = recipe.training(inputs, targets, key=jax.random.key(recipe.seed))
        weights += sum(leaf.size for leaf in jax.tree.leaves(getattr(network, "parameters", ())))
        parts.append(network)
        cautions += report.warnings
    if weights > len(inputs):
        cautions.append(f"{weights} weights from {len(inputs)} rows: the prior tells what the rows do not")
    return parts[0] if len(parts) == 1 else SummedNetwork(tuple(parts)), state, weights, tuple(cautions)


def _features(network: LinearInWeights, inputs: np.ndarray) -> np.ndarray:
    return np.asarray(jax.jit(jax.vmap(network.features))(jnp.asarray(inputs)))


def _examples(model: LaggedModel, signals: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, the signal, and the targets of the network, NaN where anything is missing."""
    rows, measured = model.lags.rows(signals), signals[model.lags.of]
    base = rows[:, -model.lags.own] if model.form == "increment" else 0.0
    return rows, measured, ((measured - base) / float(model.output_scale))[:, None]


def _learned(
    weight_filter: WeightFilter, network: LinearInWeights, state: WeightState, inputs: np.ndarray, targets: np.ndarray
) -> tuple[WeightState, np.ndarray]:
    """What is known after all rows one after the other, and what was left of each before it was learned from."""

    @jax.jit
    def through(state: WeightState, inputs: jax.Array, targets: jax.Array) -> tuple[WeightState, jax.Array]:
        return jax.lax.scan(
            lambda held, row: weight_filter.update(held, network.features(row[0]), row[1]), state, (inputs, targets)
        )

    after, left = through(state, jnp.asarray(inputs), jnp.asarray(targets))
    return after, np.asarray(left)
