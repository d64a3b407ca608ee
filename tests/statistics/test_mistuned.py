"""A stationary filter with the wrong gain: its exact error, what its innovations could give back, and what they say."""

import itertools

import jax
import numpy as np
import pytest
import scipy.linalg

import gainful as gf
from gainful.diagnostics import innovation_lag_bound, noise_advice, stationary_mistuned_error
from gainful.linalg import stationary_gain

STEP = 10.0  # s
F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0]])
TRUE = np.diag([1.4**2, 0.046**2]), np.array([[0.08**2]])
TOLD = np.diag([1.4**2, 0.005**2]), np.array([[0.4**2]])
GAIN = stationary_gain(F, H, *TOLD)


def test_the_gain_a_filter_settles_to_solves_the_riccati_equation() -> None:
    P = scipy.linalg.solve_discrete_are(F.T, H.T, *TOLD)
    # The gain changed by less than 1e-12 of itself in the last step, and modes of 0.965 are left to settle.
    np.testing.assert_allclose(GAIN, P @ H.T / (H @ P @ H.T + TOLD[1]), rtol=1e-8)


def test_a_constant_that_is_measured_has_no_gain_that_settles() -> None:
    # The gain falls like one over the number of readings, for ever.
    assert stationary_gain(np.eye(1), np.eye(1), np.zeros((1, 1)), np.eye(1)) is None


def test_the_error_of_a_mistuned_filter_is_that_of_many_simulated_ones(rng: np.random.Generator) -> None:
    found = stationary_mistuned_error(F, H, GAIN, *TRUE)
    runs, error, innovations = 4000, np.zeros((4000, 2)), []
    for _ in range(400):
        error = error @ F.T + np.sqrt(np.diag(TRUE[0])) * rng.normal(size=(runs, 2))
        innovation = error[:, :1] + np.sqrt(TRUE[1][0, 0]) * rng.normal(size=(runs, 1))
        error = error - innovation @ GAIN.T
    innovations = innovation
    # A variance from 4000 numbers is known to 2.2 %; four times that.
    np.testing.assert_allclose(np.diag(found.cov), (error**2).mean(axis=0), rtol=0.09)
    np.testing.assert_allclose(found.innovation_cov, (innovations**2).mean(), rtol=0.09)
    correlation = (error * innovations).mean(axis=0) / np.sqrt(np.diag(found.cov) * found.innovation_cov[0, 0])
    exact = found.cross[:, 0] / np.sqrt(np.diag(found.cov) * found.innovation_cov[0, 0])
    np.testing.assert_allclose(exact, correlation, atol=4 / np.sqrt(runs))


def test_the_right_gain_leaves_nothing_in_its_innovations() -> None:
    found = stationary_mistuned_error(F, H, stationary_gain(F, H, *TRUE), *TRUE)
    scale = np.sqrt(np.diag(found.cov)[:, None] * found.innovation_cov)
    assert np.abs(found.cross / scale).max() < 1e-10
    np.testing.assert_allclose(found.corrected, found.cov, rtol=1e-9)


def test_with_more_innovations_a_correction_can_do_more_up_to_the_optimal_filter() -> None:
    best = stationary_mistuned_error(F, H, stationary_gain(F, H, *TRUE), *TRUE).cov
    wrong = stationary_mistuned_error(F, H, GAIN, *TRUE)
    bounds = [np.diag(innovation_lag_bound(F, H, GAIN, *TRUE, lags)) for lags in (1, 2, 5, 12, 60)]
    np.testing.assert_allclose(bounds[0], np.diag(wrong.corrected), rtol=1e-12)
    assert all((after <= before).all() for before, after in itertools.pairwise(bounds))
    # The slower mode of the mistuned filter is 0.965 per step, that of the optimal one far below.
    np.testing.assert_allclose(bounds[-1], np.diag(best), rtol=1e-9)


def test_several_outputs_are_corrected_together(rng: np.random.Generator) -> None:
    root = rng.normal(size=(2, 2))
    R = root @ root.T + np.eye(2)
    gain = stationary_gain(F, np.eye(2), TOLD[0], np.eye(2))
    best = stationary_mistuned_error(F, np.eye(2), stationary_gain(F, np.eye(2), TRUE[0], R), TRUE[0], R).cov
    np.testing.assert_allclose(innovation_lag_bound(F, np.eye(2), gain, TRUE[0], R, 300), best, rtol=1e-6)


@pytest.mark.parametrize(
    ("Q", "R", "words"),
    [
        (0.001, 1.0, "Q is too small beside R"),
        (300.0, 1.0, "Q is too large beside R"),
        (100.0, 100.0, "both too large, by about 0.1 in sigma"),
        (1.0, 1.0, "nothing speaks against Q and R"),
    ],
)
def test_innovations_say_which_noise_is_wrong(Q: float, R: float, words: str) -> None:
    true, told = (gf.linear_model([[1.0]], [[1.0]], Q=q, R=r) for q, r in ((1.0, 1.0), (Q, R)))
    prior = gf.make_prior(told, [0.0], [1.0])
    log = gf.draw_log(true, prior, np.arange(800.0), key=jax.random.key(4))
    advice = noise_advice(gf.run(gf.kalman_filter(), told, prior, log))
    assert words in advice.sentences[0]


def test_a_bias_is_not_taken_for_noise_and_a_short_record_not_for_proof() -> None:
    model = gf.linear_model([[0.5]], [[1.0]], Q=1.0, R=1.0)
    prior = gf.make_prior(model, [0.0], [1.0])
    y = np.random.default_rng(2).normal(size=400) + 4.0
    long, short = (gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, np.arange(n), y[:n])) for n in (400, 5))
    assert any("which no noise explains" in text for text in noise_advice(long).sentences)
    assert noise_advice(short).sentences == ("too few innovations to judge Q and R by",)
