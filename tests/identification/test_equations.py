"""Rows of an equation and their noise: as those that are written out by hand, and as Monte Carlo has them."""

import numpy as np
import pytest

from gainful.errors import ConfigError, ShapeError
from gainful.identification import against_test_function, parse_equation, pointwise
from gainful.regression import quadratic_rate, rate_noise_covariance, rate_rows, weak_rows

from .problems import DT, equation, motion

POINTWISE, WEAK = pointwise(DT), against_test_function(DT)


def signals(rng) -> dict[str, np.ndarray]:
    rate, torque = motion()
    return {"r": rate + 0.05 * rng.standard_normal(len(rate)), "tau": torque}


def test_rows_are_those_of_a_rate_written_out(rng) -> None:
    given = signals(rng)
    rows = equation().rows(given, DT, POINTWISE)
    assert np.isnan(rows[[0, 1, -2, -1]]).any(axis=1).all()
    np.testing.assert_allclose(rows[2:-2], rate_rows(given["r"], given["tau"], DT), atol=1e-12)


def test_weak_rows_are_those_of_a_rate_written_out(rng) -> None:
    given = signals(rng)
    rows = equation().rows(given, DT, WEAK)[7:-7]
    np.testing.assert_allclose(rows, weak_rows(given["r"], given["tau"], DT), atol=1e-12)


def test_the_mean_of_the_noise_is_taken_out_of_squares(rng) -> None:
    given = signals(rng)
    rows = equation().rows(given, DT, POINTWISE, {"r": 0.05})
    # To second order, so beyond the width of the noise from where the sign of the rate changes.
    far = np.abs(given["r"][2:-2]) > 5 * 0.05
    np.testing.assert_allclose(rows[2:-2, 2][far], quadratic_rate(given["r"][2:-2][far], 0.05), atol=1e-8)


def test_noise_of_rows_is_that_of_a_rate_to_first_order(rng) -> None:
    given, std = signals(rng), {"r": 0.05, "tau": 0.3}
    noise = equation().noise(given, DT, POINTWISE, std)[4:-4]
    expected = np.asarray(rate_noise_covariance(given["r"][4:-4], std["r"], std["tau"], DT))
    # The fourth order of sigma is what first order leaves out.
    np.testing.assert_allclose(noise, expected, atol=2 * std["r"] ** 4 * 1.001)


@pytest.mark.parametrize("window", [POINTWISE, WEAK], ids=["pointwise", "weak"])
def test_noise_of_rows_is_what_monte_carlo_finds(rng, window) -> None:
    relation = parse_equation("d(q)", {"a": "lag(q, 2)", "b": "sin(q)*v", "c": "d(q*v)"}, ["q", "v"])
    t, std = DT * np.arange(40), {"q": 1e-3, "v": 2e-3}
    clean = {"q": np.sin(t), "v": 1.0 + 0.3 * np.cos(2.0 * t)}
    runs = 4000
    found = np.stack(
        [
            relation.rows(
                {name: each + std[name] * rng.standard_normal(40) for name, each in clean.items()}, DT, window
            )[20]
            for _ in range(runs)
        ]
    )
    expected = relation.noise(clean, DT, window, std)[20]
    size = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
    # An entry of a sample covariance has a standard error of at most sqrt(2 / runs) of the sizes; five of them.
    np.testing.assert_allclose(np.cov(found.T), expected, atol=5 * np.sqrt(2 / runs) * size.max(), rtol=0)
    assert (np.abs(np.cov(found.T) - expected) < 5 * np.sqrt(2 / runs) * size).all()


def test_a_missing_sample_takes_away_the_rows_that_need_it_and_no_others(rng) -> None:
    given = signals(rng)
    given["r"][100] = np.nan
    missing = np.flatnonzero(np.isnan(equation().rows(given, DT, WEAK)).any(axis=1))
    assert missing.tolist() == [*range(7), *range(93, 108), *range(len(given["r"]) - 7, len(given["r"]))]


def test_rows_count_only_where_the_condition_holds(rng) -> None:
    given = signals(rng)
    rows = equation(where="r > 0.2").rows(given, DT, POINTWISE)
    whole = np.isfinite(rows).all(axis=1)
    assert whole.any()
    np.testing.assert_array_equal(whole[2:-2], given["r"][2:-2] > 0.2)


def test_second_derivatives_are_exact_for_parabolas() -> None:
    relation = parse_equation("d(q, 2)", {"a": "d(q)"}, ["q"])
    t = DT * np.arange(60)
    for window in (POINTWISE, WEAK):
        rows = relation.rows({"q": 3.0 + 2.0 * t + 1.5 * t**2}, DT, window)
        middle = rows[20:40]
        # Rounding of values near 20 over a step squared.
        np.testing.assert_allclose(middle[:, 1], 3.0, atol=1e-11 / DT**2)
        np.testing.assert_allclose(middle[:, 0], 2.0 + 3.0 * t[20:40], atol=1e-11 / DT)


def test_a_weak_method_refuses_a_derivative_inside_a_term() -> None:
    relation = parse_equation("tau", {"a": "d(q)*abs(d(q))"}, ["q", "tau"])
    with pytest.raises(ConfigError, match=r"a: 'd\(q\)\*abs\(d\(q\)\)': a weak method needs derivatives in front"):
        relation.rows({"q": np.zeros(30), "tau": np.zeros(30)}, DT, WEAK)


def test_fewer_samples_than_a_window_are_refused() -> None:
    with pytest.raises(ShapeError, match="signals: expected at least 15 samples, got 9"):
        equation().rows({"r": np.zeros(9), "tau": np.zeros(9)}, DT, WEAK)
