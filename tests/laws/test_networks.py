"""Every network is a plain function of its weights, every recipe repeats itself, and all features keep to what was measured."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.linearization import Taylor
from gainful.networks import AbstractNetwork, AbstractTraining
from gainful.testing.cart import cart_model, cart_prior, instant, reading
from gainful.testing.comparisons import assert_identical, assert_same_form
from gainful.updates import AbstractFeatures, Exact, Likelihood

from .networks import FEATURES, NETWORKS, TRAININGS
from .parts import flat, name_of


@pytest.fixture
def inputs(rng: np.random.Generator) -> jax.Array:
    """Some within what was trained on, some far outside."""
    return jnp.asarray(rng.normal(size=(6, 3)) * np.array([1.0, 1.0, 1.0, 1.0, 30.0, 1e6])[:, None])


@pytest.mark.parametrize("network", flat(NETWORKS), ids=name_of)
def test_a_network_is_the_same_compiled_and_in_a_batch_and_finite_everywhere(
    network: AbstractNetwork, inputs: jax.Array
) -> None:
    said = eqx.filter_jit(jax.vmap(lambda u: (network(u), network.visits(u), network.contains(u))))(inputs)
    assert said[0].shape == (len(inputs), network.outputs)
    assert inputs.shape[1] == network.inputs
    for k, u in enumerate(inputs):
        # A few products of numbers up to a million.
        np.testing.assert_allclose(said[0][k], network(u), rtol=1e-12, atol=1e-12)
        assert (said[1][k], said[2][k]) == (network.visits(u), network.contains(u))
    assert np.isfinite(said[0]).all()


@pytest.mark.parametrize("network", flat(NETWORKS), ids=name_of)
def test_gradients_reach_the_weights(network: AbstractNetwork, inputs: jax.Array) -> None:
    slopes = eqx.filter_grad(lambda each: jnp.sum(each(inputs[0]) ** 2))(network)
    assert any(bool(jnp.any(leaf != 0)) for leaf in jax.tree.leaves(slopes))


@pytest.mark.parametrize("network", flat(NETWORKS), ids=name_of)
def test_a_network_read_from_its_file_is_the_same(network: AbstractNetwork, tmp_path: Path) -> None:
    gf.save_part(tmp_path / "network", network)
    assert bool(eqx.tree_equal(gf.load_part(tmp_path / "network"), network))


@pytest.mark.parametrize("training", flat(TRAININGS), ids=name_of)
def test_a_recipe_repeats_itself_and_reports_what_is_left(training: AbstractTraining, rng: np.random.Generator) -> None:
    inputs = rng.normal(size=(120, 3))
    targets = np.tanh(inputs[:, :2])
    network, report = training(inputs, targets, key=jax.random.key(1))
    assert_identical(training(inputs, targets, key=jax.random.key(1))[0], network, "the same key")
    left = targets - np.asarray(jax.vmap(network)(jnp.asarray(inputs)))
    np.testing.assert_allclose(report.after, (left**2).mean(axis=0), rtol=1e-9)
    assert (report.after < report.before).all()
    assert report.samples == 120


@pytest.mark.parametrize("features", flat(FEATURES), ids=name_of)
def test_features_have_their_names_and_do_not_depend_on_what_was_not_measured(features: AbstractFeatures) -> None:
    model, prior = cart_model(), cart_prior()
    when = instant(model)

    @jax.jit
    def told(seen: jax.Array, y: jax.Array) -> tuple[object, jax.Array]:
        noise, process = model.measurement_noise(prior.mean, when), model.process_noise(prior.mean, when)
        likelihood = Likelihood(
            lambda x: model.observe(x, when), model.output, noise, seen, process, model.sensors, Taylor(), when=when
        )
        _, update = Exact()(None, prior, likelihood, y)
        return features(features.init(model), likelihood, update)

    y = reading(model, prior.mean, when, jax.random.key(0))
    memory, found = told(jnp.ones(3, bool), y)
    assert found.shape == (len(features.names(model)),)
    assert len(set(features.names(model))) == len(found)
    assert np.isfinite(found).all()
    assert_same_form(memory, features.init(model), "memory")
    partly = jnp.array([True, False, True])
    assert_identical(told(partly, y.at[1].set(99.0)), told(partly, y), "an unmeasured number")
