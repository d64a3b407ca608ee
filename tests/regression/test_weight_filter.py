"""The filter of weights with one covariance: ridge regression, row by row."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.networks import ProductFeatures, make_radial_basis
from gainful.regression import WeightFilter, WeightState, fit_weights

PRIOR, NOISE = 1e4, 1e-4


def followed(weight_filter: WeightFilter, features: np.ndarray, targets: np.ndarray) -> tuple[WeightState, jax.Array]:
    start = weight_filter.init(features.shape[1], targets.shape[1])
    rows = (jnp.asarray(features), jnp.asarray(targets))
    return jax.jit(lambda state: jax.lax.scan(lambda s, row: weight_filter.update(s, *row), state, rows))(start)


@pytest.fixture
def rows(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    features = rng.normal(size=(60, 5))
    return features, features @ rng.normal(size=(5, 3)) + 0.1 * rng.normal(size=(60, 3))


@pytest.mark.parametrize(("form", "tolerance"), [("square_root", 1e-9), ("covariance", 1e-4)])
def test_it_is_ridge_regression_also_on_thin_plates_that_are_nearly_one_another(
    form: str, tolerance: float, rng: np.random.Generator
) -> None:
    network = make_radial_basis(ProductFeatures(np.ones(15)), 2, 200, rng=rng)
    z = rng.uniform(-1.0, 1.0, (3200, 15))
    features = np.asarray(jax.jit(jax.vmap(network.features))(jnp.asarray(z)))
    targets = np.stack([z[:, 0] + z[:, 3] * z[:, 7], z[:, 1] - 0.2 * z[:, 4] * z[:, 5] + 0.05 * z[:, 2] ** 2], axis=1)
    ridge = fit_weights(features[:3000], targets[:3000], PRIOR, NOISE)
    assert 1e10 < float(ridge.condition) < 1e12
    state, _ = followed(WeightFilter(PRIOR, NOISE, form=form), features[:3000], targets[:3000])
    held = features[3000:]
    # Rounding times the condition number, of the root or of the covariance itself.
    np.testing.assert_allclose(held @ state.weights, held @ ridge.weights, rtol=0, atol=tolerance)
    # From the root, where there is one: the products of P, of 1e4, cancel to 1e-6.
    spread = np.sum((held @ state.spread) * (held @ state.spread if form == "square_root" else held), axis=1)
    np.testing.assert_allclose(spread, np.sum((held @ ridge.spread) ** 2, axis=1), rtol=0, atol=tolerance * NOISE)
    assert int(state.resets) == 0


def test_all_rows_at_once_are_the_normal_equations(rows: tuple[np.ndarray, np.ndarray]) -> None:
    features, targets = rows
    state = fit_weights(*rows, PRIOR, NOISE)
    information = features.T @ features / NOISE + np.eye(5) / PRIOR
    np.testing.assert_allclose(state.weights, np.linalg.solve(information, features.T @ targets / NOISE), rtol=1e-12)
    np.testing.assert_allclose(state.cov, np.linalg.inv(information), rtol=1e-10, atol=1e-18)
    assert float(state.condition) == pytest.approx(np.linalg.cond(information), rel=1e-9)
    for form in ("square_root", "covariance"):
        fitted = WeightFilter(PRIOR, NOISE, form=form).fitted(*rows)
        np.testing.assert_allclose(fitted.cov, state.cov, rtol=1e-12, atol=1e-20)
        assert float(fitted.trace) == pytest.approx(np.trace(state.cov), rel=1e-12)


@pytest.mark.parametrize("form", ["square_root", "covariance"])
def test_one_covariance_for_all_outputs_is_one_filter_for_each(form: str, rows: tuple[np.ndarray, np.ndarray]) -> None:
    features, targets = rows
    weight_filter = WeightFilter(PRIOR, NOISE, forgetting=0.98, random_walk=1e-3, form=form)
    together, left = followed(weight_filter, features, targets)
    for k in range(3):
        alone, own = followed(weight_filter, features, targets[:, k : k + 1])
        np.testing.assert_allclose(together.weights[:, k], alone.weights[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(left[:, k], own[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(together.cov, alone.cov, rtol=0, atol=1e-12)


def test_both_forms_are_the_recursion_written_out(rows: tuple[np.ndarray, np.ndarray]) -> None:
    features, targets = rows
    f, q = 0.97, 1e-3
    weights, P = np.zeros((5, 3)), 10.0 * np.eye(5)
    for phi, y in zip(features, targets, strict=True):
        K = P @ phi / (f * NOISE + phi @ P @ phi)
        weights = weights + np.outer(K, y - weights.T @ phi)
        P = (P - np.outer(K, P @ phi)) / f + q * np.eye(5)
    for form in ("square_root", "covariance"):
        state, _ = followed(WeightFilter(10.0, NOISE, f, q, trace_cap=np.inf, form=form), features, targets)
        np.testing.assert_allclose(state.weights, weights, rtol=0, atol=1e-11)
        np.testing.assert_allclose(state.cov, P, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(state.cov, state.cov.T)


@pytest.mark.parametrize("form", ["square_root", "covariance"])
def test_a_row_that_is_not_finite_changes_nothing(form: str, rows: tuple[np.ndarray, np.ndarray]) -> None:
    weight_filter = WeightFilter(PRIOR, NOISE, forgetting=0.9, random_walk=1e-3, form=form)
    state, _ = followed(weight_filter, *rows)
    phi, y = jnp.ones(5), jnp.ones(3)
    for row in ((phi.at[1].set(jnp.nan), y), (phi, y.at[2].set(jnp.inf))):
        after, innovation = weight_filter.update(state, *row)
        np.testing.assert_array_equal(after.weights, state.weights)
        np.testing.assert_array_equal(after.spread, state.spread)
        assert np.isnan(innovation).all()
        assert (int(after.seen), int(after.skipped)) == (60, 1)
    holed = np.where(np.arange(60)[:, None] == 7, np.nan, rows[1])
    fitted = fit_weights(rows[0], holed, PRIOR, NOISE)
    np.testing.assert_allclose(
        fitted.weights, fit_weights(*(np.delete(each, 7, axis=0) for each in rows)).weights, rtol=1e-12
    )
    assert (int(fitted.seen), int(fitted.skipped)) == (59, 1)


def test_forgetting_without_excitation_winds_up_only_to_the_cap() -> None:
    features, targets = np.tile([1.0, 0.0, 0.0], (2000, 1)), np.ones((2000, 1))
    for form in ("square_root", "covariance"):
        capped, _ = followed(WeightFilter(1.0, NOISE, 0.99, trace_cap=50.0, form=form), features, targets)
        free, _ = followed(WeightFilter(1.0, NOISE, 0.99, trace_cap=np.inf, form=form), features, targets)
        assert float(capped.trace) <= 50.0 * (1 + 1e-12)
        # 0.99^-2000 of the two directions that nothing is told of.
        assert float(free.trace) == pytest.approx(2 * 0.99**-2000, rel=1e-6)
        direction = WeightFilter(1.0, NOISE, 0.99, forgets="direction", form=form)
        kept, _ = followed(direction, features, targets)
        np.testing.assert_allclose(np.diagonal(kept.cov)[1:], 1.0, rtol=1e-12)
        # h = h / (f (1 + h / r)): what a row tells and what is forgotten of it balance.
        assert float(kept.cov[0, 0]) == pytest.approx(NOISE * (1 / 0.99 - 1), rel=1e-9)


def test_forgetting_in_one_direction_follows_weights_that_walk(rng: np.random.Generator) -> None:
    features = rng.normal(size=(3000, 3))
    weights = np.cumsum(0.02 * rng.normal(size=(3000, 3)), axis=0)
    targets = np.sum(features * weights, axis=1, keepdims=True) + 0.01 * rng.normal(size=(3000, 1))
    plain, left = followed(WeightFilter(), features, targets)
    _, directed = followed(WeightFilter(forgetting=0.9, forgets="direction"), features, targets)
    _, walked = followed(WeightFilter(random_walk=4e-4), features, targets)
    late = slice(1500, None)
    assert np.std(directed[late]) < 0.2 * np.std(left[late])
    assert np.std(walked[late]) < 0.2 * np.std(left[late])
    assert int(plain.seen) == 3000


def test_after_a_jump_a_reset_learns_anew_from_a_few_rows(rows: tuple[np.ndarray, np.ndarray]) -> None:
    features, _ = rows
    weight_filter = WeightFilter(PRIOR, NOISE)
    state, _ = followed(weight_filter, *rows)
    again = weight_filter.reset(state)
    np.testing.assert_array_equal(again.weights, state.weights)
    for phi in features[:5]:
        again, _ = weight_filter.update(again, jnp.asarray(phi), jnp.zeros(3))
    assert np.abs(again.weights).max() < 1e-4 * np.abs(state.weights).max()


def test_a_lost_covariance_is_begun_anew_and_counted() -> None:
    weight_filter = WeightFilter(PRIOR, NOISE, form="covariance")
    state = weight_filter.init(2, 1)
    lost = WeightState(state.weights, -state.spread, state.seen, state.skipped, state.resets, state.form)
    after, _ = weight_filter.update(lost, jnp.ones(2), jnp.ones(1))
    np.testing.assert_array_equal(after.spread, PRIOR * np.eye(2))
    assert int(after.resets) == 1


def test_options_may_be_mapped_over(rows: tuple[np.ndarray, np.ndarray]) -> None:
    walks = jnp.array([0.0, 1e-3])

    def last(walk: jax.Array) -> jax.Array:
        weight_filter = WeightFilter(PRIOR, NOISE, random_walk=walk)
        start = weight_filter.init(5, 3)
        return jax.lax.scan(
            lambda s, row: weight_filter.update(s, *row), start, (jnp.asarray(rows[0]), jnp.asarray(rows[1]))
        )[0].weights

    together = jax.jit(jax.vmap(last))(walks)
    for k, walk in enumerate((0.0, 1e-3)):
        state, _ = followed(WeightFilter(PRIOR, NOISE, random_walk=walk), *rows)
        np.testing.assert_allclose(together[k], state.weights, rtol=0, atol=1e-10)
