"""Perceptrons trained by Kalman filters: the decoupled filter is the whole one with blocks dropped."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

import gainful as gf
from gainful.estimates import SquareRoot
from gainful.filters import KalmanFilter
from gainful.linearization import SigmaPoints
from gainful.networks import AffineTraining, make_perceptron
from gainful.regression import DecoupledKalmanTraining, KalmanTraining, network_weights_model
from gainful.updates import HuberReweighted


@pytest.fixture
def examples(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    u = rng.normal(size=(300, 2))
    return u * [1.0, 50.0] + [0.0, 1000.0], np.stack([100 * np.tanh(2 * u[:, 0]), u[:, 0] * u[:, 1]], axis=1)


def blocks_of(network, groups: str) -> np.ndarray:
    """By weight in the order of the state, the group it is in."""
    weights, biases = [], []
    for k, (W, b) in enumerate(zip(network.weights, network.biases, strict=True)):
        unit = 100.0 * k + np.arange(len(b))
        own = {"unit": unit, "layer": np.full(len(b), float(k)), "all": np.zeros(len(b))}[groups]
        weights.append(jnp.asarray(np.broadcast_to(own[:, None], W.shape)))
        biases.append(jnp.asarray(own))
    return np.asarray(ravel_pytree((tuple(weights), tuple(biases)))[0])


@pytest.mark.parametrize("groups", ["unit", "layer", "all"])
def test_decoupled_is_the_whole_filter_with_blocks_dropped_after_each_example(
    groups: str, examples: tuple[np.ndarray, np.ndarray], key: jax.Array
) -> None:
    network = make_perceptron(*examples, (3,), key=key)
    options = {"noise_variance": 1e-2, "random_walk": 1e-4}
    decoupled, whole = DecoupledKalmanTraining((3,), groups=groups, **options), KalmanTraining((3,), **options)
    group = blocks_of(network, groups)
    mask = group[:, None] == group[None, :]
    known, carry = decoupled.start(network), whole.start(network)

    @jax.jit
    def both(known, carry, u, y):
        known, _ = decoupled.learned(network, known, u, y)
        after, _ = whole.learned(network, carry, u, y)
        estimate = after.estimate
        # The walk comes before an example here and after it there; the first has both with the prior's.
        dropped = type(estimate)(estimate.mean, estimate.cov * mask, estimate.space)
        return known, type(after)(dropped, after.update, after.noise)

    carry = type(carry)(
        type(carry.estimate)(carry.estimate.mean, carry.estimate.cov - 1e-4 * jnp.eye(len(mask)), carry.estimate.space),
        carry.update,
        carry.noise,
    )
    for u, y in zip(*(jnp.asarray(each[:20]) for each in examples), strict=True):
        known, carry = both(known, carry, u, y)
    found = ravel_pytree(decoupled.trained(network, known).parameters)[0]
    # Twenty Joseph forms against twenty differences.
    np.testing.assert_allclose(found, carry.estimate.mean, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "recipe",
    [
        KalmanTraining((4,), noise_variance=1e-2),
        DecoupledKalmanTraining((10,), noise_variance=1e-2),
        DecoupledKalmanTraining((5,), groups="all", noise_variance=1e-2),
    ],
    ids=["whole", "decoupled", "one group"],
)
def test_it_learns_a_curve_that_no_straight_line_can(recipe, examples, key: jax.Array) -> None:
    _, straight = AffineTraining()(*examples, key=key)
    _, curved = recipe(*examples, key=key)
    assert (curved.after < 0.3 * straight.after).all()
    assert curved.warnings == ()


def test_other_filters_train_it_as_well(rng: np.random.Generator, key: jax.Array) -> None:
    """Sigma points with a square root as well as slopes; and reweighting, where targets have outliers."""
    u = rng.uniform(-1.0, 1.0, (300, 1))
    y = np.sin(3.0 * u)
    _, plain = KalmanTraining((4,))(u, y, key=key)
    _, points = KalmanTraining((4,), filter=KalmanFilter(SigmaPoints(), estimate=SquareRoot))(u, y, key=key)
    assert points.after[0] < 3.0 * plain.after[0] < 0.05 * plain.before[0]
    dirty = np.where(rng.random((300, 1)) < 0.1, y + 10.0, y)
    left = []
    for update in (gf.Exact(), HuberReweighted()):
        network, _ = KalmanTraining((4,), filter=KalmanFilter(update=update), noise_variance=1e-2)(u, dirty, key=key)
        left.append(np.mean((np.asarray(jax.vmap(network)(jnp.asarray(u))) - y) ** 2))
    assert left[1] < 0.5 * left[0]


def test_the_weights_are_a_models_state_that_any_run_follows(examples, key: jax.Array) -> None:
    network = make_perceptron(*examples, (2,), key=key)
    model = network_weights_model(network, noise_variance=1e-2, random_walk=1e-6)
    start = ravel_pytree(network.parameters)[0]
    prior = gf.make_prior(model, start, np.ones(len(start)))
    log = gf.make_log(model, np.arange(300.0), examples[1], u=examples[0])
    result = gf.run(gf.extended_kalman_filter(), model, prior, log)
    trained = network.with_parameters(ravel_pytree(network.parameters)[1](jnp.asarray(result.mean[-1])))
    left = [
        np.mean((np.asarray(jax.vmap(each)(jnp.asarray(examples[0]))) - examples[1]) ** 2, axis=0)
        for each in (trained, network)
    ]
    # Two units are enough for the first output; the second is a product.
    assert left[0][0] < 0.1 * left[1][0]


def test_training_that_runs_away_ends_with_the_last_sound_weights(examples, key: jax.Array) -> None:
    network, report = DecoupledKalmanTraining((3,), prior_variance=1e200, noise_variance=1e-200)(*examples, key=key)
    assert np.isfinite(jax.vmap(network)(jnp.asarray(examples[0]))).all()
    assert any("raise noise_variance" in text for text in report.warnings)
