"""Bias and covariance by formula are those of many records."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.regression import (
    average,
    bias_compensated_least_squares,
    errors_in_variables_scores,
    generalized_covariance,
    information,
    instrumental_variables,
    least_squares,
    least_squares_bias,
    sandwich_covariance,
    total_least_squares,
    total_least_squares_covariance,
)

from .problems import YAW, clean_rows, noisy_rows

RUNS, ROWS, VARIANCE = 200, 2000, 0.1
NOISE = VARIANCE * np.eye(4)


@pytest.fixture(scope="module")
def moment() -> np.ndarray:
    regressors = clean_rows(ROWS)[:, :3]
    return regressors.T @ regressors / ROWS


@pytest.fixture(scope="module")
def records() -> dict[str, np.ndarray]:
    """Information of 200 records of two sensors: stacked, of one, and averaged."""
    rng, kept = np.random.default_rng(1), {"one": [], "stacked": [], "mean": []}
    for _ in range(10):
        rows = noisy_rows(rng, ROWS, VARIANCE, runs=RUNS // 10)
        kept["one"].append(information(rows[:, :, :1]))
        kept["stacked"].append(information(rows))
        kept["mean"].append(information(average(rows)))
    return {name: np.concatenate(each) for name, each in kept.items()}


def test_theory_has_the_published_numbers(moment: np.ndarray) -> None:
    np.testing.assert_allclose(np.linalg.eigvalsh(moment), [0.07832, 0.79639, 3.05405], atol=5e-6)
    np.testing.assert_allclose(least_squares_bias(moment, YAW, NOISE), [-8.925, 3.960, -6.769], atol=5e-4)
    np.testing.assert_allclose(least_squares_bias(moment, YAW, 2 * NOISE), [-16.058, 3.814, -10.616], atol=5e-4)
    for variance, count, published in (
        (VARIANCE, ROWS, [1.134, 4.400, 2.880]),
        (VARIANCE, 2 * ROWS, [0.802, 3.111, 2.037]),
        (VARIANCE / 2, ROWS, [0.786, 2.643, 1.739]),
    ):
        cov = total_least_squares_covariance(moment, YAW, variance, count)
        np.testing.assert_allclose(np.sqrt(np.diag(cov)), published, atol=6e-4)


def test_least_squares_is_off_by_the_formula_however_many_sensors_are_stacked(
    moment: np.ndarray, records: dict[str, np.ndarray]
) -> None:
    for kind, noise in (("one", NOISE), ("stacked", NOISE), ("mean", NOISE / 2)):
        errors = np.asarray(least_squares(records[kind]).theta) - YAW
        standard_error = errors.std(axis=0, ddof=1) / math.sqrt(RUNS)
        assert (np.abs(errors.mean(axis=0) - least_squares_bias(moment, YAW, noise)) < 3 * standard_error).all()


def test_total_least_squares_scatters_by_the_formula_about_the_truth(
    moment: np.ndarray, records: dict[str, np.ndarray]
) -> None:
    for kind, variance, count in (
        ("one", VARIANCE, ROWS),
        ("stacked", VARIANCE, 2 * ROWS),
        ("mean", VARIANCE / 2, ROWS),
    ):
        fit = total_least_squares(records[kind], np.full(RUNS, float(count)))
        errors = np.asarray(fit.theta) - YAW
        theory = np.sqrt(np.diag(total_least_squares_covariance(moment, YAW, variance, count)))
        np.testing.assert_allclose(errors.std(axis=0, ddof=1), theory, rtol=0.15)
        # Consistent, not unbiased: what is left is far inside the scatter.
        assert (np.abs(errors.mean(axis=0)) < 0.25 * theory).all()
        np.testing.assert_allclose(np.median(fit.noise_scale), variance, rtol=0.02)
        # Each record's own bands hold the truth as often as they say: 95 % of 600, give or take 4 standard errors.
        held = np.abs(errors) < 1.96 * np.asarray(fit.std)
        assert abs(held.mean() - 0.95) < 4 * math.sqrt(0.95 * 0.05 / (3 * RUNS)) + 0.01


def test_compensated_least_squares_scatters_by_its_formula(records: dict[str, np.ndarray]) -> None:
    fit = bias_compensated_least_squares(records["stacked"], 2 * ROWS * NOISE, np.full(RUNS, 2.0 * ROWS))
    errors = np.asarray(fit.theta) - YAW
    np.testing.assert_allclose(errors.std(axis=0, ddof=1), np.median(fit.std, axis=0), rtol=0.15)
    # Told the size of the noise, it needs no more than total least squares of the same rows finds by itself.
    np.testing.assert_allclose(np.median(fit.noise_scale), 1.0, rtol=0.02)


def test_the_general_covariance_is_the_isotropic_one_for_equal_noise(moment: np.ndarray) -> None:
    general = generalized_covariance(ROWS * moment, ROWS * NOISE, YAW, ROWS)
    v = VARIANCE * (1 + YAW @ YAW)
    inverse = np.linalg.inv(moment)
    second = VARIANCE * inverse @ np.linalg.inv(np.eye(3) + np.outer(YAW, YAW)) @ inverse
    np.testing.assert_allclose(general, v / ROWS * (inverse + second), rtol=1e-9)
    np.testing.assert_allclose(total_least_squares_covariance(moment, YAW, VARIANCE, ROWS), general, rtol=1e-9)


def test_the_sandwich_needs_no_model_of_the_noise(moment: np.ndarray, rng: np.random.Generator) -> None:
    rows = noisy_rows(rng, ROWS, VARIANCE, sensors=1)[:, 0]
    S = information(rows[:, None])
    fit = total_least_squares(S, ROWS)
    scores = errors_in_variables_scores(rows, fit.theta, NOISE)
    # The scores vanish in sum at the estimate they belong to.
    assert np.abs(np.asarray(scores).sum(axis=0) / np.abs(scores).sum(axis=0)).max() < 1e-9
    excess = S[:3, :3] - float(fit.noise_scale) * (ROWS - 3) * np.eye(3)
    robust = np.sqrt(np.diag(sandwich_covariance(scores, excess)))
    # A sum of 2000 squares of such scores is good to some per cent.
    np.testing.assert_allclose(robust, fit.std, rtol=0.15)
    np.testing.assert_allclose(sandwich_covariance(scores, excess, lag=8).diagonal() ** 0.5, fit.std, rtol=0.25)


def test_products_of_neighbours_count_for_rows_that_were_filtered() -> None:
    scores = jnp.array([[1.0], [2.0], [3.0]])
    eye = jnp.eye(1)
    assert float(sandwich_covariance(scores, eye)[0, 0]) == 14.0
    assert float(sandwich_covariance(scores, eye, lag=1)[0, 0]) == pytest.approx(14 + 2 * 0.5 * (2 + 6))
    assert float(sandwich_covariance(scores, eye, lag=2)[0, 0]) == pytest.approx(14 + 2 * (2 / 3 * 8 + 1 / 3 * 3))


def test_instruments_scatter_by_their_scores_about_the_truth(rng: np.random.Generator) -> None:
    rows = jnp.asarray(noisy_rows(rng, 500, VARIANCE, runs=RUNS))
    fit = jax.jit(jax.vmap(lambda each: instrumental_variables(each[:, 0], each[:, 1])))(rows)
    errors = np.asarray(fit.theta) - YAW
    np.testing.assert_allclose(errors.std(axis=0, ddof=1), np.median(fit.std, axis=0), rtol=0.2)
    standard_error = errors.std(axis=0, ddof=1) / math.sqrt(RUNS)
    assert (np.abs(np.median(errors, axis=0)) < 4 * 1.2533 * standard_error).all()
