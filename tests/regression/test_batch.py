"""Regression from all rows at once: what the methods are of each other, and what they are to data."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.errors import Status
from gainful.regression import (
    ConstantRowNoise,
    accumulated_noise,
    average,
    bias_compensated_least_squares,
    count_rows,
    generalized_total_least_squares,
    information,
    instrumental_variables,
    least_squares,
    total_least_squares,
)

from .problems import YAW, clean_rows, noisy_rows

EYE = np.eye(4)
REGRESSAND = np.diag([0.0, 0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def rows(generator) -> np.ndarray:
    return noisy_rows(generator("batch regression"), 400, 0.1)


@pytest.fixture(scope="module")
def S(rows: np.ndarray) -> np.ndarray:
    return np.asarray(information(rows))


def test_least_squares_is_that_of_the_stacked_rows(rows: np.ndarray, S: np.ndarray) -> None:
    flat = rows.reshape(-1, 4)
    expected, squares, *_ = np.linalg.lstsq(flat[:, :3], flat[:, 3], rcond=None)
    fit = least_squares(S, len(flat))
    np.testing.assert_allclose(fit.theta, expected, rtol=1e-9)
    variance = squares[0] / (len(flat) - 3)
    np.testing.assert_allclose(fit.noise_scale, variance, rtol=1e-9)
    np.testing.assert_allclose(fit.cov, variance * np.linalg.inv(S[:3, :3]), rtol=1e-9, atol=1e-15)


def test_total_least_squares_is_the_last_singular_vector_of_the_stacked_rows(rows: np.ndarray, S: np.ndarray) -> None:
    _, values, vectors = np.linalg.svd(rows.reshape(-1, 4), full_matrices=False)
    fit = total_least_squares(S, 800)
    np.testing.assert_allclose(fit.theta, -vectors[-1, :3] / vectors[-1, 3], rtol=1e-9)
    np.testing.assert_allclose(fit.noise_scale, values[-1] ** 2 / (800 - 3), rtol=1e-9)
    np.testing.assert_allclose(fit.gap, (values[-2] / values[-1]) ** 2, rtol=1e-9)
    # The secular equation.
    shifted = S[:3, :3] - values[-1] ** 2 * np.eye(3)
    np.testing.assert_allclose(shifted @ np.asarray(fit.theta), S[:3, 3], rtol=1e-9)


def test_generalised_total_least_squares_holds_the_others(S: np.ndarray) -> None:
    general, plain = generalized_total_least_squares, total_least_squares
    np.testing.assert_allclose(general(S, EYE).theta, plain(S).theta, rtol=1e-12)
    np.testing.assert_allclose(general(S, 7.0 * EYE).theta, plain(S).theta, rtol=1e-12)
    np.testing.assert_allclose(general(S, REGRESSAND).theta, least_squares(S).theta, rtol=1e-9)
    # Data least squares: noise in the regressors alone; there S_hz^T theta_dls = S_zz.
    data = general(S, EYE - REGRESSAND).theta
    np.testing.assert_allclose(S[:3, 3] @ np.asarray(data), S[3, 3], rtol=1e-9)
    # Noise in the regressand alone leaves one finite eigenvalue, so the gap is as wide as numbers go.
    assert general(S, REGRESSAND).gap > 1e14


def test_the_quotient_is_stationary_at_generalised_total_least_squares(S: np.ndarray) -> None:
    N = np.diag([0.3, 0.1, 0.0, 2.0]) + 0.05 * np.ones((4, 4)) * np.array([1, 1, 0, 1])[:, None] * [1, 1, 0, 1]

    def quotient(theta: jax.Array) -> jax.Array:
        a = jnp.append(theta, -1.0)
        return (a @ S @ a) / (a @ N @ a)

    theta = generalized_total_least_squares(S, N).theta
    slope, bend = jax.grad(quotient)(theta), jax.hessian(quotient)(theta)
    # A step that would lower the quotient is rounding of theta itself.
    assert np.abs(np.linalg.solve(bend, slope) / theta).max() < 1e-9
    assert np.linalg.eigvalsh(bend)[0] > 0


def test_columns_in_other_units_give_parameters_in_other_units_if_their_noise_is_told(S: np.ndarray) -> None:
    T = np.diag([1e-3, 50.0, 2.0, 1e4])
    scaled = T @ S @ T
    expected = np.asarray(total_least_squares(S).theta) / np.diag(T)[:3] * T[3, 3]
    np.testing.assert_allclose(generalized_total_least_squares(scaled, T @ T).theta, expected, rtol=1e-9)
    # Total least squares that is not told is no longer the same estimator.
    plain = np.asarray(total_least_squares(scaled).theta)
    assert np.abs(plain / expected - 1).max() > 0.01


def test_noise_free_columns_and_exact_data_are_no_special_case() -> None:
    S = np.asarray(information(clean_rows(400)[:, None]))
    N = np.diag([0.0, 1.0, 0.5, 0.0])
    for fit in (least_squares(S), total_least_squares(S), generalized_total_least_squares(S, N)):
        np.testing.assert_allclose(fit.theta, YAW, rtol=1e-8)
        assert int(fit.status) == Status.ok


def test_noise_of_known_size_is_taken_out_of_the_sums(S: np.ndarray) -> None:
    # At the scale total least squares finds by itself both are the same equations.
    free = total_least_squares(S, 800)
    level = float(free.noise_scale) * (800 - 3)
    same = bias_compensated_least_squares(S, level * EYE, 800)
    np.testing.assert_allclose(same.theta, free.theta, rtol=1e-9)
    np.testing.assert_allclose(same.noise_scale, 800 / 797, rtol=1e-9)
    too_much = bias_compensated_least_squares(S, 800 * 0.5 * EYE, 800)
    assert int(too_much.status) == Status.not_positive
    assert np.isnan(too_much.theta).all()
    assert too_much.gap < 1 < same.gap


def test_too_few_rows_say_so_and_give_nothing() -> None:
    rows = clean_rows(400)[100:103, None]
    S = information(rows)
    assert int(total_least_squares(S, 3).status) == Status.insufficient_data
    assert np.isnan(total_least_squares(S, 3).theta).all()
    still = information(clean_rows(400)[:, None] * [1, 0, 1, 1])  # no motion in the second column
    for fit in (least_squares(still, 400), total_least_squares(still, 400)):
        assert int(fit.status) == Status.insufficient_data


def test_a_batch_of_matrices_is_each_alone(S: np.ndarray) -> None:
    stack = np.stack([S, 2.0 * S + np.diag([1.0, 2.0, 3.0, 4.0])]).reshape(2, 1, 4, 4)
    counts = np.array([[800.0], [500.0]])
    noise = np.broadcast_to(0.1 * EYE, stack.shape) * counts[..., None, None]
    for method, arguments in (
        (least_squares, ()),
        (total_least_squares, ()),
        (generalized_total_least_squares, (noise,)),
        (bias_compensated_least_squares, (noise,)),
    ):
        many = method(stack, *arguments, counts)
        assert many.theta.shape == (2, 1, 3)
        assert many.cov.shape == (2, 1, 3, 3)
        assert many.status.shape == (2, 1)
        for k in range(2):
            one = method(stack[k, 0], *(each[k, 0] for each in arguments), counts[k, 0])
            jax.tree.map(
                lambda batch, alone, k=k: np.testing.assert_allclose(batch[k, 0], alone, rtol=1e-9, atol=1e-12),
                many,
                one,
            )


def test_the_order_of_columns_and_of_sensors_does_not_matter(rows: np.ndarray, S: np.ndarray) -> None:
    order = np.array([2, 0, 1, 3])
    turned = information(rows[..., order])
    for method in (least_squares, total_least_squares):
        np.testing.assert_allclose(method(turned).theta, np.asarray(method(S).theta)[order[:3]], rtol=1e-10)
    np.testing.assert_allclose(information(rows[:, ::-1]), S, rtol=1e-12)
    swapped = instrumental_variables(rows[:, 1], rows[:, 0])
    straight = instrumental_variables(rows[:, 0], rows[:, 1])
    np.testing.assert_allclose(swapped.theta, straight.theta, rtol=1e-12)
    np.testing.assert_allclose(swapped.cov, straight.cov, rtol=1e-9)


def test_a_sensor_without_noise_as_its_own_instrument_is_least_squares() -> None:
    rows = clean_rows(400)
    fit = instrumental_variables(rows, rows)
    np.testing.assert_allclose(fit.theta, least_squares(information(rows[:, None])).theta, rtol=1e-9)
    np.testing.assert_allclose(fit.theta, YAW, rtol=1e-9)


def test_instruments_without_motion_say_so() -> None:
    rows = clean_rows(400) * [1, 0, 1, 1]
    assert int(instrumental_variables(rows, rows).status) == Status.ill_separated
    assert int(instrumental_variables(rows[:3], rows[:3]).status) == Status.insufficient_data


def test_missing_rows_count_for_nothing_anywhere(rows: np.ndarray) -> None:
    holed = rows.copy()
    holed[10:20, 0, 1] = np.nan
    holed[15:30, 1, 3] = np.nan
    first, second = np.delete(rows[:, 0], np.s_[10:20], 0), np.delete(rows[:, 1], np.s_[15:30], 0)
    np.testing.assert_allclose(information(holed), first.T @ first + second.T @ second, rtol=1e-12)
    assert float(count_rows(holed)) == 800 - 25
    noise = ConstantRowNoise((0.1, 0.2, 0.3, 0.4))
    expected = np.diag([0.1, 0.2, 0.3, 0.4]) * (390 + 385)
    np.testing.assert_allclose(accumulated_noise(holed, noise), expected, rtol=1e-12)
    mean = np.asarray(average(holed, [1.0, 3.0]))[:, 0]
    np.testing.assert_allclose(mean[5], 0.25 * rows[5, 0] + 0.75 * rows[5, 1], rtol=1e-12)
    np.testing.assert_allclose(mean[12], rows[12, 1], rtol=1e-14)
    assert np.isnan(mean[15:20]).all()
    whole = np.r_[0:10, 30:400]
    np.testing.assert_allclose(
        instrumental_variables(holed[:, 0], holed[:, 1]).theta,
        instrumental_variables(rows[whole, 0], rows[whole, 1]).theta,
        rtol=1e-12,
    )


def test_double_precision_is_on() -> None:
    assert jnp.zeros(1).dtype == jnp.float64, "regression in single precision loses what it looks for"
