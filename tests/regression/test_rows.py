"""Rows from signals: derivatives, weak forms, squares of noisy rates, and their noise."""

import itertools
import math

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.regression import (
    CENTRAL_DIFFERENCE,
    RateRowNoise,
    differentiate,
    identifiability,
    noise_from_differences,
    quadratic_rate,
    quadratic_rate_mean,
    rate_noise_covariance,
    rate_rows,
    sensor_lag,
    weak_form,
    weak_rows,
    weak_taps,
)

from .problems import DT, clean_rows, motion, noisy_rows


def expected_over_noise(fn, std: float) -> float:
    """The mean over normal noise, by the trapezoidal rule, which is exact to rounding for such integrands but at a kink."""
    e = np.linspace(-10.0, 10.0, 200_001)
    density = np.exp(-0.5 * e**2) / math.sqrt(2 * math.pi)
    return float(np.trapezoid(fn(std * e) * density, e))


@pytest.mark.parametrize(("rate", "std"), [(0.5, 0.1), (0.05, 0.1), (-0.3, 0.2), (0.0, 1.0)])
def test_the_mean_of_a_noisy_square_is_its_integral(rate: float, std: float) -> None:
    integral = expected_over_noise(lambda e: (rate + e) * np.abs(rate + e), std)
    assert float(quadratic_rate_mean(rate, std)) == pytest.approx(integral, abs=1e-9)


def test_the_mean_of_a_noisy_square_is_the_published_one() -> None:
    assert float(quadratic_rate_mean(0.5, 0.1)) == pytest.approx(0.2599999996, abs=5e-11)


def test_correcting_a_noisy_square_leaves_a_bias_of_higher_order() -> None:
    rate, std = 0.4, 0.08
    plain = expected_over_noise(lambda e: (rate + e) * np.abs(rate + e), std) - rate**2
    left = expected_over_noise(lambda e: np.asarray(quadratic_rate(rate + e, std)), std) - rate**2
    assert plain == pytest.approx(std**2, rel=1e-4)
    # Next to the kink at 0, five sigmas away, a share of e^-12.5 is corrected the wrong way.
    assert abs(left) < 1e-4 * plain


def test_the_covariance_of_a_row_is_that_of_its_columns(rng: np.random.Generator) -> None:
    rate, std, wrench, draws = 0.7, 0.05, 0.3, 200_000
    c = np.array([-0.5, 0.1, 0.3, 0.5, -0.4])  # with a middle, so that no entry is 0
    e = std * rng.standard_normal((draws, 5))
    # A constant rate apart from noise; the square's mean is removed by np.cov.
    square = (rate + e[:, 2]) * np.abs(rate + e[:, 2])
    columns = np.stack([e @ c / DT, e[:, 2], square, wrench * rng.standard_normal(draws)])
    noisy = rate + e[:, 2]
    found = np.asarray(rate_noise_covariance(noisy, std, wrench, DT, tuple(c))).mean(axis=0)
    measured = np.cov(columns)
    size = np.sqrt(np.outer(np.diag(measured), np.diag(measured)))
    # A sample covariance of n draws is off by 1 / sqrt(n) of the deviations, sqrt(2) of it on the diagonal.
    assert np.abs((found - measured) / size).max() < 4 * math.sqrt(2 / draws)


def test_the_central_difference_amplifies_noise_as_published() -> None:
    assert float(np.sum(np.square(CENTRAL_DIFFERENCE))) == pytest.approx(130 / 144, rel=1e-12)
    row = jnp.array([0.0, -0.7, -0.49, 1.0])
    expected = rate_noise_covariance(-0.7, 0.1, 2.0, DT)
    np.testing.assert_allclose(RateRowNoise(0.1, 2.0, DT)(row), expected, rtol=1e-12)


def test_a_stencil_differentiates_polynomials_it_is_made_for() -> None:
    t = DT * np.arange(20)
    slope = differentiate(1.0 + t - 3 * t**2 + 0.5 * t**4, DT)
    np.testing.assert_allclose(slope, (1 - 6 * t + 2 * t**3)[2:-2], rtol=1e-9)


def test_the_weak_form_is_exact_on_a_ramp() -> None:
    t = DT * np.arange(40)
    smooth, slope = weak_form(2.0 - 3.0 * t, DT)
    np.testing.assert_allclose(smooth, (2.0 - 3.0 * t)[7:-7], atol=1e-12)
    np.testing.assert_allclose(slope, np.full(26, -3.0), rtol=1e-11)


def test_the_weak_derivative_of_a_sine_is_the_sines_smoothed_derivative_to_second_order() -> None:
    errors = []
    for w in (2.0, 1.0, 0.5):
        t = 0.01 * np.arange(2000)
        smooth, _ = weak_form(w * np.cos(w * t), 0.01, 31)
        _, slope = weak_form(np.sin(w * t), 0.01, 31)
        errors.append(np.abs(slope - smooth).max() / w)
    assert errors[0] < 1e-3
    # The filters agree on constants and ramps, and differ at the next order of W dt w.
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine == pytest.approx(4.0, rel=0.05)


def test_weak_taps_are_a_smoother_and_a_derivative() -> None:
    phi, g = weak_taps(15, DT)
    j = np.arange(-7, 8)
    assert phi.sum() == pytest.approx(1.0, abs=1e-14)
    assert (g @ j) * DT == pytest.approx(1.0, abs=1e-14)
    assert abs(g.sum()) < 1e-12
    np.testing.assert_allclose(phi, phi[::-1], atol=1e-15)


def test_rows_of_a_clean_rate_are_those_of_the_motion() -> None:
    rate, _ = motion(401)
    clean = clean_rows(401)
    found = np.asarray(rate_rows(rate, clean[:, 3], DT))
    np.testing.assert_array_equal(found[:, 1:], clean[2:-2, 1:])
    # Five harmonics of 20 s: rate times (w dt)^4 / 30 = (1.57 * 0.05)^4 / 30 of the acceleration.
    np.testing.assert_allclose(found[:, 0], clean[2:-2, 0], atol=1e-4)
    weak = np.asarray(weak_rows(rate, clean[:, 3], DT))
    # Both sides of the equation through the same window: it still holds, but for the derivative's taps being sampled.
    force = weak[:, :3] @ np.array([80.0, 50.0, 100.0])
    assert np.abs(force - weak[:, 3]).max() < 2e-3 * np.abs(weak[:, 3]).max()


def test_differences_of_sensors_tell_their_noise(rng: np.random.Generator) -> None:
    root = np.array([[0.3, 0, 0, 0], [0.1, 0.2, 0, 0], [0, 0.1, 0.1, 0], [0, 0, 0, 0.5]])
    first, second = (clean_rows(4000) + rng.standard_normal((4000, 4)) @ root.T for _ in range(2))
    second[17] = np.nan
    found, true = np.asarray(noise_from_differences(first, second)), root @ root.T
    size = np.sqrt(np.outer(np.diag(true), np.diag(true)))
    assert np.abs((found - true) / size).max() < 4 * math.sqrt(2 / 4000)


@pytest.mark.parametrize("late", [-0.2, 0.0, 0.12, 0.05])
def test_a_late_sensor_is_found_out_to_a_fraction_of_a_sample(late: float) -> None:
    t = DT * np.arange(600)
    first, second = (np.sin(1.3 * s) + 0.5 * np.cos(2.9 * s) for s in (t, t - late))
    # A parabola through three samples of a cosine of at most 2.9 rad/s, off by less than (w dt)^2 / 24 of a step.
    assert sensor_lag(first, second, DT, 0.5) == pytest.approx(late, abs=2e-3 * DT + 1e-3)


def test_the_report_names_columns_alike_and_noise_unequal(rng: np.random.Generator) -> None:
    names = ("rdot", "r", "r|r|")
    rows = noisy_rows(rng, 1000, 0.01)
    fine = identifiability(rows, 0.01, columns=names)
    assert fine.cautions == ()
    assert fine.worst_pair[:2] == ("r", "r|r|")
    assert fine.contraction == pytest.approx(1 / fine.gap)
    flat = rows.copy()
    flat[..., 2] = flat[..., 1] * np.abs(flat[..., 1]).mean()  # one level of rate
    nearly = identifiability(flat, np.diag([0.5, 0.01, 0.01, 0.0]), columns=names)
    assert any("'r' and 'r|r|' are nearly alike" in words for words in nearly.cautions)
    assert any("some columns have none" in words for words in nearly.cautions)
    noise = identifiability(0.1 * rng.standard_normal((200, 1, 4)), 0.01)
    assert noise.cautions[0].startswith("the parameters are not told from noise: eigenvalue gap 1.")
    unequal = identifiability(rows, np.diag([0.04, 0.01, 0.01, 0.01]))
    assert "by a factor of 2" in unequal.cautions[0]
