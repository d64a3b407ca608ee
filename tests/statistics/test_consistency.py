import dataclasses

import equinox as eqx
import jax
import numpy as np
import pytest
import scipy.stats

import gainful as gf
from gainful.diagnostics import chi_square_bounds, nees, nees_test, nis_test
from gainful.diagnostics.squares import correlation_time
from gainful.errors import ConfigError, Status

FILTERS = {
    "extended": gf.extended_kalman_filter,
    "unscented": gf.unscented_kalman_filter,
    "cubature": gf.cubature_kalman_filter,
}


def with_noise(case, factor):
    """The case's model with its measurement noise covariance multiplied, as a wrong belief."""

    def noises(model):
        return [part.noise.value for part in model.sensor_parts]

    return eqx.tree_at(noises, case.model, [factor * matrix for matrix in noises(case.model)])


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("plant", ["pendulum", "radar"])
def test_nees_and_nis_of_many_runs_are_inside_their_chi_square_bounds(request, many, plant, name):
    case = request.getfixturevalue(plant)
    batch = many(case, FILTERS[name]())
    runs, rows = batch.errors.shape[:2]
    # One chance in a thousand that any row of a sound filter is outside.
    lower, upper = chi_square_bounds(case.model.space.dof, runs, 1 - 1e-3 / rows)
    average = nees(batch.errors, batch.covs).mean(axis=0)
    assert lower < average.min()
    assert average.max() < upper
    lower, upper = chi_square_bounds(case.model.output.dof, runs * rows, 1 - 1e-3)
    assert lower < np.asarray(batch.info.nis).mean() < upper


@pytest.mark.parametrize("factor", [4.0, 0.25])
@pytest.mark.parametrize("name", FILTERS)
def test_wrong_measurement_noise_leaves_the_bounds_over_many_runs(pendulum, many, name, factor):
    batch = many(pendulum, FILTERS[name](), believed=with_noise(pendulum, factor))
    runs, rows = batch.errors.shape[:2]
    average = np.asarray(batch.info.nis).mean()
    lower, upper = chi_square_bounds(1, runs * rows, 1 - 1e-6)
    assert average < lower if factor > 1 else average > upper


def test_nis_test_of_one_run_passes_as_often_as_its_level_says(pendulum, many, results):
    estimator = gf.extended_kalman_filter()
    tests = [nis_test(result) for result in results(pendulum, estimator, many(pendulum, estimator))]
    inside = sum(test.lower <= test.mean <= test.upper for test in tests)
    least, most = scipy.stats.binom.interval(0.999, len(tests), 0.95)
    assert least <= inside <= most
    assert sum(test.probability > 0.05 for test in tests) == inside


def test_nees_test_of_one_run_allows_for_errors_correlated_in_time(pendulum, many, results):
    estimator = gf.extended_kalman_filter()
    tests = [nees_test(result) for result in results(pendulum, estimator, many(pendulum, estimator))]
    effective = [test.lower <= test.mean <= test.upper for test in tests]
    naive_lower, naive_upper = (bound / tests[0].degrees for bound in chi_square_bounds(tests[0].degrees))
    naive = [naive_lower <= test.mean <= naive_upper for test in tests]
    assert np.mean(effective) > 0.9
    assert np.mean(naive) < 0.7


@pytest.mark.parametrize(("factor", "word"), [(4.0, "over-stated"), (0.25, "under-stated")])
def test_wrong_measurement_noise_is_flagged_in_one_run(drifting, factor, word):
    wrong = with_noise(drifting, factor)
    test = nis_test(gf.run(gf.kalman_filter(), wrong, drifting.prior, drifting.log))
    assert test.passed is False
    assert test.probability < 1e-3
    assert word in test.sentence


def test_covariance_too_small_is_flagged_by_the_nees(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    assert nees_test(result).passed is True
    shrunk = eqx.tree_at(lambda estimates: estimates.cov, result.estimates, result.estimates.cov / 9)
    test = nees_test(dataclasses.replace(result, estimates=shrunk))
    assert test.passed is False
    assert "errors are about 3 times larger than claimed" in test.sentence


def test_missing_and_inserted_rows_do_not_count(drifting, logged):
    y = drifting.log.y.copy()
    y[::3] = np.nan
    y[1::3, 0] = np.nan
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, logged(y))
    test = nis_test(result)
    assert test.degrees == np.isfinite(y).sum() == 600
    assert test.mean == pytest.approx(result.nis[np.isfinite(y).any(axis=1)].sum() / test.degrees)
    split = gf.continuous_model(lambda x, u, t: -x, lambda x, u, t: x, states=["x"], outputs=["y"], Q=0.1, R=0.1)
    t, measured = np.arange(20.0), np.linspace(0.1, -0.1, 20)
    prior = gf.make_prior(split, [0.0], [1.0])
    fine = gf.make_log(split, t, measured, truth={"x": measured}, max_step=0.25)
    result = gf.run(gf.kalman_filter(), split, prior, fine)
    assert len(fine) > 60
    assert nis_test(result).degrees == 20
    assert nees_test(result).degrees == 20


def test_failed_rows_do_not_count(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    status, nis = result.status.copy(), result.nis.copy()
    status[10:20], nis[10:20] = Status.not_positive, np.nan
    broken = dataclasses.replace(result, status=status, nis=nis)
    assert nis_test(broken).degrees == nis_test(result).degrees - 20
    assert np.isfinite(nis_test(broken).mean)
    assert nees_test(broken).degrees == nees_test(result).degrees - 20


def test_nis_of_gated_outliers_is_left_out_and_said_to_be(drifting, logged):
    y = drifting.log.y.copy()
    y[[100, 300], 0] += 50.0
    plain = nis_test(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, logged(y)))
    gated = gf.run(gf.kalman_filter(update=gf.Gated(probability=0.9999)), drifting.model, drifting.prior, logged(y))
    test = nis_test(gated)
    assert plain.passed is False
    assert test.passed is True
    assert test.degrees == plain.degrees - 2
    assert test.share_left_out == pytest.approx(2 / plain.degrees)
    assert test.sentence.endswith("biased low by 0.17 % of the measurements left out")
    # The lower bound gives way by what the lost tail can explain, the upper one does not.
    lower, upper = (bound / test.degrees for bound in chi_square_bounds(test.degrees))
    assert test.lower < lower
    assert test.upper == upper
    total = 0.0
    for k in range(len(y)):
        used = gated.weight[k] > 0
        residual, cov = gated.residual[k][used], gated.residual_cov[k][np.ix_(used, used)]
        total += residual @ np.linalg.solve(cov, residual)
    assert test.mean == pytest.approx(total / test.degrees)


def test_lower_bound_of_a_gated_run_covers_a_gate_that_cuts_into_sound_measurements(pendulum, many, results):
    estimator = gf.extended_kalman_filter(update=gf.Gated(probability=0.95))
    tests = [nis_test(result) for result in results(pendulum, estimator, many(pendulum, estimator))]
    # Five in a hundred sound measurements refused cost a quarter of the mean square.
    assert np.mean([test.mean for test in tests]) < 0.85
    assert np.mean([test.lower <= test.mean <= test.upper for test in tests]) > 0.9


def test_nis_is_not_judged_where_too_much_was_left_out(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    weight = result.weight.copy()
    weight[::2] = 0.0
    test = nis_test(dataclasses.replace(result, weight=weight))
    assert test.degrees == 600
    assert test.passed is None
    assert "not judged: 50 % of the measurements left out" in test.sentence


def test_nis_of_few_rows_is_not_judged_unless_it_is_far_too_large(drifting, logged):
    y = drifting.log.y.copy()
    y[2] += 1e3
    few, wild = logged(drifting.log.y, rows=slice(0, 3)), logged(y, rows=slice(0, 3))
    sound = nis_test(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, few))
    assert sound.passed is None
    assert sound.sentence.endswith("not judged: 6 effective degrees, 10 are needed")
    assert nis_test(gf.run(gf.kalman_filter(), drifting.model, drifting.prior, wild)).passed is False


def test_nothing_measured_and_no_truth_are_not_judged(drifting):
    log = gf.make_log(drifting.model, drifting.log.t, np.full_like(drifting.log.y, np.nan))
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, log)
    for test in (nis_test(result), nees_test(result)):
        assert (test.degrees, test.passed) == (0, None)
        assert test.sentence == f"{test.name} not judged: no row could be counted"


def test_mean_close_to_one_passes_however_long_the_record(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    scale = 1.04 / nis_test(result).mean
    repeated = gf.make_log(drifting.model, np.arange(60_000.0), np.tile(drifting.log.y, (100, 1)))
    tall = {
        name: np.concatenate([getattr(result, name)] * 100) for name in ("residual", "residual_cov", "weight", "status")
    }
    long = dataclasses.replace(result, log=repeated, nis=np.tile(scale * result.nis, 100), **tall)
    test = nis_test(long)
    assert test.mean > test.upper
    assert test.passed is True
    assert test.sentence.endswith("outside but within 5 % of 1")
    worse = nis_test(dataclasses.replace(long, nis=1.02 * long.nis))
    assert worse.passed is False


def test_state_without_variance_is_left_out_of_the_nees_while_it_is_right():
    model = gf.linear_model(
        [[0.9, 1.0], [0.0, 1.0]], [[1.0, 0.0]], Q=[0.1, 0.0], R=0.1, states=["x", "offset"], outputs=["y"]
    )
    prior = gf.make_prior(model, [0.0, 0.3], [1.0, 0.0])
    log = gf.draw_log(model, prior, np.arange(300.0), key=jax.random.key(11))
    result = gf.run(gf.kalman_filter(), model, prior, log)
    test = nees_test(result)
    assert test.degrees == 300
    assert test.passed is True
    off = dataclasses.replace(log, truth=log.truth | {"offset": np.full(300, 0.4)})
    test = nees_test(dataclasses.replace(result, log=off))
    assert test.passed is False
    assert test.sentence == "NEES infinite: a state with zero variance is off"


def test_truth_of_some_states_and_rows_is_judged_by_its_own_block(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    truth = {"speed": np.where(np.arange(600) % 2, np.nan, drifting.log.truth["speed"])}
    test = nees_test(dataclasses.replace(result, log=dataclasses.replace(drifting.log, truth=truth)))
    assert test.degrees == 300
    own = (result.error()[::2, 1] / result.std[::2, 1]) ** 2
    assert test.mean == pytest.approx(own.mean())


def test_smoothed_result_is_judged_by_the_filters_innovations_and_the_smoothers_errors(drifting):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    smoothed = gf.smooth(result)
    assert nis_test(smoothed) == nis_test(result)
    assert nees_test(smoothed).passed is True
    assert nees_test(smoothed).mean != nees_test(result).mean


def test_nees_equals_the_quadratic_form_and_leaves_out_unknown_components():
    generator = np.random.default_rng(3)
    roots, errors = generator.standard_normal((2, 5, 3, 3)), generator.standard_normal((2, 5, 3))
    covs = roots @ roots.swapaxes(-1, -2)
    expected = np.einsum("rti,rtij,rtj->rt", errors, np.linalg.inv(covs), errors)
    np.testing.assert_allclose(nees(errors, covs), expected, rtol=1e-8)
    errors[..., 1] = np.nan
    kept = covs[..., [0, 2], :][..., [0, 2]]
    expected = np.einsum("rti,rtij,rtj->rt", errors[..., [0, 2]], np.linalg.inv(kept), errors[..., [0, 2]])
    np.testing.assert_allclose(nees(errors, covs), expected, rtol=1e-8)


def test_nees_of_a_singular_covariance_counts_its_range_only():
    direction = np.array([1.0, 1e3])
    covs = 4.0 * np.outer(direction, direction)[None]
    np.testing.assert_allclose(nees(6.0 * direction[None], covs), [9.0])
    assert np.isinf(nees(np.array([[0.0, 1.0]]), np.diag([1.0, 0.0])[None]))[0]
    assert np.isnan(nees(np.zeros((1, 2)), np.full((1, 2, 2), np.nan)))[0]


def test_nees_does_not_depend_on_units():
    errors, cov = np.array([[1.0, 2.0]]), np.array([[[2.0, 0.5], [0.5, 1.0]]])
    scale = np.array([1e-9, 1e6])
    scaled = nees(errors * scale, cov * np.outer(scale, scale))
    np.testing.assert_allclose(scaled, nees(errors, cov), rtol=1e-12)


def test_chi_square_bounds_are_the_published_ones():
    # Bar-Shalom, Li and Kirubarajan (2001), 5.4.2: two states, 50 runs, 95 %.
    assert chi_square_bounds(2, 50) == pytest.approx((1.48, 2.59), abs=0.005)
    expected = scipy.stats.chi2.interval(0.99, 3 * 20)
    np.testing.assert_allclose(chi_square_bounds(3, 20, 0.99), np.array(expected) / 20)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_correlation_time_of_a_series_with_known_memory(memory):
    generator = np.random.default_rng(5)
    noise, series = generator.standard_normal((50_000, 2)), np.zeros((50_000, 2))
    for k in range(1, len(series)):
        series[k] = memory * series[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    # Squares of a Gaussian series are correlated as the square of its correlation.
    assert correlation_time(series) == pytest.approx((1 + memory**2) / (1 - memory**2), rel=0.1)


def test_error_that_never_changes_is_one_sample():
    assert 100 / correlation_time(np.full((100, 1), 0.7)) < 1.1


@pytest.mark.parametrize("level", [0.0, 1.0, 95.0, float("nan")])
def test_level_must_be_a_probability(drifting, level):
    result = gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)
    for check in (
        lambda: nis_test(result, level),
        lambda: nees_test(result, level),
        lambda: chi_square_bounds(1, 1, level),
    ):
        with pytest.raises(ConfigError, match="level: expected a probability between 0 and 1"):
            check()
    with pytest.raises(ConfigError, match="degrees and runs: expected numbers above 0"):
        chi_square_bounds(0, 10)
