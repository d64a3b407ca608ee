"""Noise fitted to records: what is found, how well it is known, and what it is worth where it was not fitted."""

import dataclasses

import jax
import numpy as np
import pytest

import gainful as gf
from gainful.filters import AbstractEstimator
from gainful.noise import Capped, Scaled, with_scaled_noise
from gainful.running.fitting.entries import noise_entries, typical_noise
from gainful.running.fitting.noise_fit import relative_errors
from gainful.running.fitting.problem import Outliers, Problem
from gainful.running.fitting.records import make_records

STEP = 10.0  # s
F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0]])
TRUE = (1.0, 0.05, 1.0)  # m, m/s, m
TOLD = (1.0, 0.02, 0.5)


def track(s: float, v: float, y: float) -> gf.models.AbstractModel:
    """A ship with position fixes, given the sigmas of its noise."""
    return gf.linear_model(F, H, Q=[s**2, v**2], R=y**2, states={"s": "m", "v": "m/s"}, outputs={"y": "m"})


MODEL = track(*TOLD)
PRIOR = gf.make_prior(MODEL, [0.0, 5.0], [10.0, 10.0])


def drawn(rows: int, seed: int, sigmas: tuple[float, float, float] = TRUE, gaps: int = 0) -> gf.Log:
    """A record of the ship, with its truth, every so many readings missing."""
    rng = np.random.default_rng(seed)
    x, states = np.array([0.0, 5.0]), []
    for _ in range(rows):
        x = F @ x + np.array(sigmas[:2]) * rng.normal(size=2)
        states.append(x)
    truth = np.array(states)
    y = truth[:, 0] + sigmas[2] * rng.normal(size=rows)
    if gaps:
        y[::gaps] = np.nan
    times = STEP * np.arange(1.0, rows + 1.0)
    return gf.make_log(MODEL, times, y, truth={"s": truth[:, 0], "v": truth[:, 1]}, start=0.0)


@pytest.fixture(scope="module")
def log(request: pytest.FixtureRequest) -> gf.Log:
    return drawn(600, 11 + request.config.getoption("--seed"))


@pytest.fixture(scope="module")
def fit(log: gf.Log) -> gf.running.NoiseFit:
    return gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, log, held_out=0.0)


def sigmas(fit: gf.running.NoiseFit) -> np.ndarray:
    return np.array([each.fitted[0] for each in fit.entries])


def test_the_likelihood_finds_the_noise_within_its_own_errors(fit: gf.running.NoiseFit) -> None:
    errors = np.array([each.standard_error for each in fit.entries])
    assert [each.entry.label for each in fit.entries] == ["Q s", "Q v", "R y"]
    assert fit.converged
    # Four standard errors of a logarithm, each.
    assert (np.abs(np.log(sigmas(fit) / TRUE)) < 4 * errors).all()
    assert (errors < 0.5).all()
    assert fit.fitted > fit.start


def test_at_the_largest_likelihood_its_slope_vanishes_and_its_gradient_is_that_of_differences(log: gf.Log) -> None:
    typical = typical_noise(MODEL, PRIOR, log)
    records = make_records((gf.kalman_filter(), MODEL), PRIOR, log, 0.0, 0)
    problem = Problem(gf.kalman_filter(), MODEL, noise_entries(MODEL, typical, None, None), records, Outliers.none(1))
    at, small = np.array([0.2, -0.1, 0.3]), 1e-5
    slope = problem.fitted_loss(at)[1]
    for i, unit in enumerate(np.eye(3)):
        ahead, behind = (problem.fitted_loss(at + sign * small * unit)[0] for sign in (1, -1))
        # Rounding of a mean of order 1 over 2e-5.
        assert slope[i] == pytest.approx((ahead - behind) / (2 * small), abs=1e-8)


def test_the_fitted_likelihood_is_that_of_a_run(fit: gf.running.NoiseFit, log: gf.Log) -> None:
    for estimator, told in ((gf.kalman_filter(), fit.start), (fit.estimator, fit.fitted)):
        result = gf.run(estimator, MODEL, PRIOR, log)
        assert result.log_likelihood.sum() / len(log) == pytest.approx(told, rel=1e-9)


def test_an_unmoving_plant_gives_the_textbook_error_of_a_standard_deviation(rng: np.random.Generator) -> None:
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.0, R=1.0)
    rows = 400
    y = 3.0 * rng.normal(size=rows)
    log = gf.make_log(model, np.arange(rows), y)
    (found,) = gf.fit_noise(gf.kalman_filter(), model, gf.make_prior(model, [0.0], [1e-6]), log, held_out=0.0).entries
    # The likelihood of independent normal numbers: the root mean square, known to 1 / sqrt(2 N).
    assert found.fitted[0] == pytest.approx(np.sqrt(np.mean(y**2)), rel=1e-4)
    assert found.standard_error == pytest.approx(1 / np.sqrt(2 * rows), rel=1e-3)


def test_expectation_and_maximisation_never_loses_likelihood_and_ends_at_the_same_noise(
    fit: gf.running.NoiseFit, log: gf.Log
) -> None:
    by_smoothing = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, log, method="em", held_out=0.0, iterations=150)
    path = np.array(by_smoothing.path)
    assert (np.diff(path) < 1e-9).all()
    # Steps that gain less than 1e-6 per row end it: a few times the root of that, over the curvature, from the end.
    assert by_smoothing.fitted == pytest.approx(fit.fitted, abs=1e-4)
    errors = np.array([each.standard_error for each in fit.entries])
    assert (np.abs(np.log(sigmas(by_smoothing) / sigmas(fit))) < 0.5 * errors).all()


def test_expectation_and_maximisation_takes_gaps_and_sigma_points() -> None:
    gappy = drawn(200, 5, gaps=4)
    found = gf.fit_noise(gf.cubature_kalman_filter(), MODEL, PRIOR, gappy, method="em", held_out=0.0, iterations=8)
    assert (np.diff(found.path) < 1e-9).all()
    assert not found.converged
    assert "the search had not ended after 8 iterations" in found.warnings


def test_moments_find_the_noise_of_a_long_record() -> None:
    long = drawn(20_000, 3)
    found = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, long, method="moments", held_out=0.0)
    # A mean of 20 000 squares has an error of 1 %, and each of the three noises is a quarter of the innovations' variance or
    # more: 4 % of a variance, 2 % of a sigma, and five times that.
    np.testing.assert_allclose(np.log(sigmas(found) / TRUE), 0.0, atol=0.1)
    assert all(each.standard_error is None for each in found.entries)


def test_moments_leave_frozen_noise_where_it_is(log: gf.Log) -> None:
    told = track(TRUE[0], TRUE[1], 3.0 * TRUE[2])
    found = gf.fit_noise(gf.kalman_filter(), told, PRIOR, drawn(5000, 4), method="moments", process=(), held_out=0.0)
    assert found.outputs["y"] == pytest.approx(1 / 3, rel=0.05)


def test_noise_fitted_to_truth_makes_estimates_better(log: gf.Log) -> None:
    found = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, log, method="truth", held_out=0.0)
    before, after = (gf.run(each, MODEL, PRIOR, log) for each in (gf.kalman_filter(), found.estimator))
    best = gf.run(gf.kalman_filter(), track(*TRUE), PRIOR, log)
    costs = [np.log((each.error() ** 2).mean(axis=0)).mean() for each in (before, after, best)]
    assert costs[1] < costs[0]
    assert costs[1] < costs[2] + 1e-6


def test_named_noise_is_fitted_together_and_all_other_stays(log: gf.Log) -> None:
    found = gf.fit_noise(
        gf.kalman_filter(), MODEL, PRIOR, log, process=[("s", "v")], measurement=(), held_out=0.0, iterations=5
    )
    assert found.states["s"] == found.states["v"] != 1.0
    assert found.outputs == {}
    assert found.estimator.noise == Scaled(found.states, {})


def test_noise_that_enters_in_two_places_is_one_entry() -> None:
    model = gf.linear_model(F, H, Q=0.01, R=1.0, G=[[50.0], [10.0]], states=["s", "v"], outputs=["y"])
    entries = noise_entries(model, typical_noise(model, PRIOR, drawn(20, 1)), None, None)
    assert [each.names for each in entries] == [("s", "v"), ("y",)]


def test_noise_that_the_record_does_not_tell_is_called_flat_or_below_its_floor() -> None:
    # Fixes a hundred times better than the motion between them: any smaller R does as well.
    still = drawn(300, 8, sigmas=(5.0, 0.05, 0.01))
    free = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, still, held_out=0.0, floor=1e-6)
    held = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, still, held_out=0.0, floor=0.9)
    (told,) = [each for each in free.entries if each.entry.names == ("y",)]
    assert told.flat or told.bound == "floor"
    # Half the innovations' variance or so in R would show, R like the motion itself would show plainly.
    assert told.limit is not None
    assert 0.01 < told.limit * TOLD[2] < 5.0
    assert any(text.startswith("R y: ") for text in free.warnings)
    (bounded,) = [each for each in held.entries if each.entry.names == ("y",)]
    assert bounded.bound == "floor"
    assert bounded.factor == pytest.approx(0.9)
    assert bounded.standard_error is None
    assert bounded.remark == "at its floor: the record tells no size but a largest one"


def test_noise_that_is_not_felt_leaves_what_is_known_of_the_rest() -> None:
    curvature = np.array([[4.0, 1e-5, 0.0], [1e-5, -1e-9, 0.0], [0.0, 0.0, 100.0]])
    np.testing.assert_allclose(relative_errors(curvature, np.array([True] * 3)), [0.5, np.inf, 0.1], rtol=1e-9)
    held = relative_errors(curvature, np.array([True, False, False]))
    np.testing.assert_allclose(held, [0.5, np.nan, np.nan])


def test_rows_held_out_are_not_fitted_and_show_what_the_fit_is_worth(log: gf.Log) -> None:
    found = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, log, skip=10)
    assert (found.rows, found.held_rows) == (413, 177)  # 590 rows that count, 30 % of them held out
    assert found.held_fitted > found.held_start
    result = gf.run(found.estimator, MODEL, PRIOR, log)
    assert result.log_likelihood[-177:].mean() == pytest.approx(found.held_fitted, rel=1e-9)


def test_records_are_pooled_whatever_their_lengths_and_the_last_are_held_out() -> None:
    logs = [drawn(rows, rows, gaps=7) for rows in (80, 50, 120)]
    found = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, logs, iterations=3)
    measured = [int(each.seen.sum()) for each in logs]
    assert (found.rows, found.held_rows) == (sum(measured[:2]), measured[2])
    whole = gf.fit_noise(gf.kalman_filter(), MODEL, [PRIOR] * 3, logs[:2], held_out=logs[2], iterations=3)
    assert whole.fitted == pytest.approx(found.fitted, rel=1e-12)
    assert whole.held_fitted == pytest.approx(found.held_fitted, rel=1e-12)
    totals = [gf.run(found.estimator, MODEL, PRIOR, each).log_likelihood.sum() for each in logs]
    assert found.fitted == pytest.approx(sum(totals[:2]) / found.rows, rel=1e-9)


def test_a_record_that_changes_is_told_by_the_rows_held_out() -> None:
    quiet, loud = drawn(200, 2), drawn(200, 3, sigmas=(0.5, 0.05, 15.0))
    found = gf.fit_noise(gf.kalman_filter(), track(0.5, 0.05, 15.0), PRIOR, quiet, held_out=loud)
    assert any("the rows held out are predicted worse than before" in text for text in found.warnings)


def test_outliers_that_the_filter_rejects_do_not_make_the_noise_large() -> None:
    clean = drawn(500, 21)
    y = clean.y.copy()
    y[10::25] += 60.0
    wild = dataclasses.replace(clean, y=y)
    told = track(*TRUE)
    chosen = {"process": (), "held_out": 0.0}
    gated = gf.fit_noise(gf.kalman_filter(update=gf.Gated(reacquire=0)), told, PRIOR, wild, **chosen)
    plain = gf.fit_noise(gf.kalman_filter(), told, PRIOR, wild, **chosen)
    assert (gated.contamination, plain.contamination) == (0.01, 0.0)
    assert gated.outputs["y"] < 1.3
    assert plain.outputs["y"] > 3


def test_a_likelihood_that_jumps_is_searched_by_values_and_bends_like_one_without_jumps() -> None:
    told, log = track(*TRUE), drawn(900, 12)
    # Clipping at two sigmas takes one reading in twenty, and each changes the covariance where it changes sides.
    clipping = gf.kalman_filter(update=gf.MasreliezMartin(threshold=2.0))
    plain, robust = (gf.fit_noise(each, told, PRIOR, log, held_out=0.0) for each in (gf.kalman_filter(), clipping))
    assert robust.converged
    errors = [np.array([each.standard_error for each in fit.entries]) for fit in (plain, robust)]
    # A parabola through 30 values that jump by a nat or two, over what they fall by at 0.3: to a factor of two.
    np.testing.assert_array_less(errors[1], 2.0 * errors[0])
    np.testing.assert_array_less(0.5 * errors[0], errors[1])
    assert (np.abs(np.log(sigmas(robust) / TRUE)) < 4 * errors[0]).all()


def test_of_several_starts_the_best_is_kept(log: gf.Log, fit: gf.running.NoiseFit) -> None:
    found = gf.fit_noise(gf.kalman_filter(), MODEL, PRIOR, log, held_out=0.0, starts=3, seed=1)
    assert found.fitted == pytest.approx(fit.fitted, abs=1e-7)


def _bank() -> AbstractEstimator:
    members = (gf.kalman_filter(), gf.KalmanFilter(noise=Scaled({"v": 4.0})))
    return gf.InteractingMultipleModel(members, ((0.9, 0.1), (0.1, 0.9)))


@pytest.mark.parametrize(
    "estimator",
    [
        gf.unscented_kalman_filter(square_root=True),
        gf.KalmanFilter(noise=gf.SageHusa()),
        gf.kalman_filter(update=gf.MasreliezMartin()),
        _bank(),
    ],
    ids=["square_root", "adaptive", "robust", "bank"],
)
def test_every_filter_can_be_fitted(estimator: AbstractEstimator) -> None:
    found = gf.fit_noise(estimator, MODEL, PRIOR, drawn(120, 6), held_out=0.0, iterations=6)
    assert found.fitted > found.start + 0.05


def test_scaling_goes_beneath_all_that_noise_laws_do_and_keeps_the_members_of_a_bank_apart() -> None:
    bank = with_scaled_noise(_bank(), {"v": 3.0}, {"y": 2.0})
    assert [member.noise for member in bank.members] == [
        Scaled({"v": 3.0}, {"y": 2.0}),
        Scaled({"v": 12.0}, {"y": 2.0}),
    ]
    capped = with_scaled_noise(gf.KalmanFilter(noise=Capped({"v": 1.0}, gf.SageHusa())), {"v": 3.0}, {})
    assert capped.noise == Capped({"v": 1.0}, gf.SageHusa(inner=Scaled({"v": 3.0}, {})))


def test_a_parameter_that_walks_and_a_nonlinear_plant_are_fitted_like_the_rest(key: jax.Array) -> None:
    def fall(x, u, t, p):
        return jax.numpy.stack([x[1], -p["drag"] * x[1] * jax.numpy.abs(x[1])])

    def height(x, u, t):
        return x[:1]

    def plant(R):
        base = gf.continuous_model(
            fall, height, states=["x", "v"], outputs=["y"], Q=[0.0, 0.1], R=R, parameters={"drag": 0.1}
        )
        return gf.augment(base, parameters={"drag": 0.01}, bounds={"drag": (0.0, None)})

    told, true = plant(0.01), plant(0.04)
    prior = gf.make_prior(told, {"x": 0.0, "v": 2.0, "drag": 0.1}, {"x": 0.1, "v": 0.1, "drag": 0.05})
    log = gf.draw_log(true, prior, np.arange(0.0, 30.0, 0.1), key=key)
    found = gf.fit_noise(gf.extended_kalman_filter(), told, prior, log, process=("log(drag)",), held_out=0.0)
    # 300 readings: 4 % for a standard deviation; five of them.
    assert found.outputs["y"] == pytest.approx(2.0, rel=0.2)
