"""One-step models: what they predict, their slopes, and what their fit says."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.identification import OneStepModel, fit_one_step
from gainful.networks import ProductFeatures, make_radial_basis
from gainful.regression import WeightFilter

SCALE = np.array([2.0, 1.0, 1.0, 0.1])  # u, then x


def plant(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    a, b, c = x.T
    return np.stack([a + 0.1 * b, b + 0.1 * u[:, 0] * (1 + a), c + 0.01 * a * b + 0.02 * u[:, 0]], axis=1)


@pytest.fixture
def examples(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    z = rng.uniform(-1.0, 1.0, (400, 4)) * SCALE
    return z[:, 1:], z[:, :1], plant(z[:, 1:], z[:, :1])


def bilinear(outputs: int = 3):
    return make_radial_basis(ProductFeatures(SCALE), outputs, 0, tail="lift")


@pytest.mark.parametrize("form", ["increment", "absolute"])
def test_a_bilinear_plant_is_found_by_a_bilinear_network(
    form: str, examples: tuple[np.ndarray, np.ndarray, np.ndarray], rng: np.random.Generator
) -> None:
    fit = fit_one_step(bilinear(), *examples, form=form)
    z = rng.uniform(-1.0, 1.0, (20, 4)) * SCALE
    x, u = z[:, 1:], z[:, :1]
    said = jax.jit(jax.vmap(fit.model))(jnp.asarray(x), jnp.asarray(u))
    # Ridge pulls weights of some 10 by r / (lambda N phi^2), 1e-10 for features near 0.1.
    np.testing.assert_allclose(said, plant(x, u), rtol=0, atol=1e-7)
    for k in range(3):
        assert float(said[k, 1]) == pytest.approx(float(fit.model(jnp.asarray(x[k]), jnp.asarray(u[k]))[1]), rel=1e-12)
        slope = fit.model.control_jacobian(jnp.asarray(x[k]), jnp.asarray(u[k]))
        np.testing.assert_allclose(slope[:, 0], [0.0, 0.1 * (1 + x[k, 0]), 0.02], rtol=0, atol=1e-6)
    assert fit.report.warnings == ()
    assert fit.report.parameters == 11
    assert (fit.report.after < 1e-9 * fit.report.before).all()
    np.testing.assert_allclose(fit.model.targets(jnp.asarray(x[0]), said[0]), fit.model.outputs(x[0], u[0]), atol=1e-12)


def test_going_on_row_by_row_is_a_fit_of_all_rows(examples: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    network = make_radial_basis(ProductFeatures(SCALE), 3, 20)
    first = fit_one_step(network, *(each[:300] for each in examples))
    model, state = first.model, first.state
    assert (model.states, model.controls) == (3, 1)
    learn = jax.jit(
        lambda s, x, u, after: first.weight_filter.update(s, model.features(x, u), model.targets(x, after))[0]
    )
    for x, u, after in zip(*(jnp.asarray(each[300:]) for each in examples), strict=True):
        state = learn(state, x, u, after)
    features = jax.vmap(model.features)(jnp.asarray(examples[0]), jnp.asarray(examples[1]))
    targets = jax.vmap(model.targets)(jnp.asarray(examples[0]), jnp.asarray(examples[2]))
    whole = WeightFilter().fitted(features, targets)
    said = features @ model.with_weights(state.weights).network.weights
    np.testing.assert_allclose(said, features @ whole.weights, rtol=0, atol=1e-9)


def test_other_units_and_another_order_of_outputs_give_the_same_model(
    examples: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    x, u, after = examples
    units = np.array([1e3, 1e-4, 57.3])
    network = make_radial_basis(ProductFeatures(SCALE), 3, 20, tail="affine")
    other = make_radial_basis(ProductFeatures(SCALE * np.concatenate([[1e-3], units])), 3, 20, tail="affine")
    here = fit_one_step(network, x, u, after).model
    there = fit_one_step(other, x * units, u * 1e-3, after * units).model
    for k in range(3):
        said = there(jnp.asarray(x[k] * units), jnp.asarray(u[k] * 1e-3))
        np.testing.assert_allclose(said / units, here(jnp.asarray(x[k]), jnp.asarray(u[k])), rtol=1e-9)
    # Outputs do not know of each other.
    alone = WeightFilter().fitted(
        jax.vmap(here.features)(jnp.asarray(x), jnp.asarray(u)),
        jax.vmap(here.targets)(jnp.asarray(x), jnp.asarray(after))[:, ::-1],
    )
    np.testing.assert_allclose(alone.weights[:, ::-1], here.network.weights, rtol=1e-9, atol=1e-9)


def test_a_fit_warns_of_what_it_cannot_tell(examples: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    few = fit_one_step(bilinear(), *(each[:9] for each in examples)).report.warnings
    assert few == ("9 rows for 11 weights: how the outputs change with the control is not identified",)
    narrow = fit_one_step(make_radial_basis(ProductFeatures(SCALE), 3, 8), *examples).report.warnings
    assert narrow == ("8 centres represent only a part of the 10 lifted inputs: take at least 12, or a tail",)
    flat = make_radial_basis(ProductFeatures(SCALE, 1e-4), 3, 12, tail="affine")
    vague = fit_one_step(flat, *examples, weight_filter=WeightFilter(prior_variance=1e12))
    assert vague.report.condition > 1e12
    assert vague.report.warnings[0].endswith("raise the gain of the lifting")


def test_a_model_knows_where_it_was_trained(examples: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    model = OneStepModel(bilinear(), jnp.ones(3))
    assert bool(model.contains(jnp.zeros(3), jnp.array([2.9])))
    assert not bool(model.contains(jnp.zeros(3), jnp.array([3.1])))
