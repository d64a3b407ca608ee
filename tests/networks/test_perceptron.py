"""Perceptrons follow their gradients, and stop while they are sound."""

import jax
import jax.flatten_util
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.networks import AffineTraining, PerceptronTraining, make_perceptron
from gainful.networks.perceptron_training import mean_square


@pytest.fixture
def examples(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    u = rng.normal(size=(300, 2))
    return u * [1.0, 50.0] + [0.0, 1000.0], np.stack([100 * np.tanh(2 * u[:, 0]), u[:, 0] * u[:, 1]], axis=1)


def test_the_gradient_is_that_of_small_differences(examples: tuple[np.ndarray, np.ndarray], key: jax.Array) -> None:
    inputs, targets = (jnp.asarray(values) for values in examples)
    network = make_perceptron(*examples, (3, 2), key=key)
    weights = (network.weights, network.biases)
    flat, back = jax.flatten_util.ravel_pytree(weights)
    loss = jax.jit(lambda vector: mean_square(back(vector), network, inputs, targets))
    step = 1e-5
    across = np.array(
        [(loss(flat.at[k].add(step)) - loss(flat.at[k].add(-step))) / (2 * step) for k in range(len(flat))]
    )
    # Cut off at step^2 times the third derivative, a few; rounding of eps / step.
    np.testing.assert_allclose(jax.grad(loss)(flat), across, rtol=0, atol=1e-8)


@pytest.mark.parametrize("recipe", [PerceptronTraining(iterations=60), PerceptronTraining(method="sgd")])
def test_it_learns_a_curve_that_no_straight_line_can(
    examples: tuple[np.ndarray, np.ndarray], recipe: PerceptronTraining, key: jax.Array
) -> None:
    _, straight = AffineTraining()(*examples, key=key)
    _, curved = recipe(*examples, key=key)
    assert (curved.after < 0.3 * straight.after).all()


def test_a_rate_that_is_too_high_leaves_the_last_sound_weights(
    examples: tuple[np.ndarray, np.ndarray], key: jax.Array
) -> None:
    network, report = PerceptronTraining(method="sgd", rate=1e4, epochs=1)(*examples, key=key)
    assert np.isfinite(jax.vmap(network)(jnp.asarray(examples[0]))).all()
    assert any("lower the rate" in text for text in report.warnings)
    _, calm = PerceptronTraining(method="sgd", rate=0.01, epochs=1)(*examples, key=key)
    assert calm.warnings == ()


def test_the_same_key_gives_the_same_perceptron(examples: tuple[np.ndarray, np.ndarray]) -> None:
    recipe = PerceptronTraining((3,), method="sgd", epochs=1)
    first, again, other = (recipe(*examples, key=jax.random.key(k))[0] for k in (1, 1, 2))
    np.testing.assert_array_equal(first.weights[0], again.weights[0])
    assert not np.array_equal(first.weights[0], other.weights[0])


def test_a_straight_line_is_found_and_what_does_not_vary_is_left_out(rng: np.random.Generator, key: jax.Array) -> None:
    varied = rng.normal(size=(120, 2))
    inputs = np.concatenate([varied, np.full((120, 1), 3.0)], axis=1)
    network, report = AffineTraining()(inputs, varied @ [[2.0], [-1.0]] + 4.0, key=key)
    np.testing.assert_allclose(network.matrix, [[2.0, -1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(network.offset, [4.0], atol=1e-12)
    assert report.dropped == (2,)
    repeated, report = AffineTraining()(varied[:, [0, 0]], varied[:, :1], key=key)
    assert any("1 direction only" in text for text in report.warnings)
    np.testing.assert_allclose(repeated.matrix, [[0.5, 0.5]], atol=1e-9)


def test_a_perceptron_says_where_its_examples_were(examples: tuple[np.ndarray, np.ndarray], key: jax.Array) -> None:
    network = make_perceptron(*examples, (3,), key=key)
    assert bool(network.contains(jnp.asarray(examples[0][0])))
    assert not bool(network.contains(jnp.array([0.0, 0.0])))
    assert np.isinf(network.visits(jnp.zeros(2)))
