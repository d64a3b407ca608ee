"""Statistics by hand, alarms as events, and thresholds that keep the rate they state."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import chi2

import gainful as gf
from gainful.faults import (
    actuator_offset,
    alarms,
    calibrate_threshold,
    check_threshold,
    chi_square_threshold,
    cusum,
    detection_statistics,
    fault_free_statistics,
    fault_scores,
    mean_jump,
    normalised_innovations,
    result_statistics,
    sensor_bias,
    windowed_mean,
)

from .plants import STEP, cart, faulty

NAN = float("nan")


# Statistics -----------------------------------------------------------------------------------------------------------


def test_the_windowed_mean_passes_over_what_is_missing():
    values = np.array([NAN, 1.0, 2.0, NAN, 6.0, 4.0])
    np.testing.assert_array_equal(windowed_mean(values, 3), [NAN, NAN, NAN, NAN, 3.0, 4.0])
    np.testing.assert_array_equal(windowed_mean(values, 1), [NAN, 1.0, 2.0, 2.0, 6.0, 4.0])


def test_the_windowed_mean_forgets_however_large_a_value_was():
    assert windowed_mean(np.array([1e20, 1.0, 1.0]), 2).tolist() == [pytest.approx(NAN, nan_ok=True), 5e19, 1.0]


def test_the_cumulative_sum_of_a_constant_rises_by_what_exceeds_the_drift():
    rows = np.arange(1, 6)
    np.testing.assert_allclose(cusum(np.full(5, 3.0), drift=1.0), 2.0 * rows)
    np.testing.assert_allclose(cusum(np.full(5, -3.0), drift=1.0), 2.0 * rows)
    assert not cusum(np.full(5, 1.0), drift=1.0).any()
    assert not cusum(np.array([0.9, -0.9] * 3), drift=1.0).any()


def test_the_cumulative_sum_falls_back_to_zero_and_not_below():
    assert cusum(np.array([4.0, 0.0, 0.0, 0.0, 2.5]), drift=1.0).tolist() == [3.0, 2.0, 1.0, 0.0, 1.5]


def test_the_cumulative_sum_stands_still_where_nothing_is_known():
    assert cusum(np.array([4.0, NAN, 2.0]), drift=1.0).tolist() == [3.0, 3.0, 4.0]


def test_columns_are_summed_by_themselves():
    both = np.stack([np.full(4, 3.0), np.full(4, -2.0)], axis=1)
    np.testing.assert_allclose(cusum(both)[:, 1], cusum(both[:, 1]))


def test_the_likelihood_ratio_of_a_jump_is_the_best_over_its_onsets(rng):
    z = rng.standard_normal(40)
    z[7] = NAN
    window, bound = 12, 2.0
    found = mean_jump(z, window, bound)
    for k in (0, 5, 20, 39):
        best = 0.0
        for begin in range(max(0, k - window + 1), k + 1):
            part = z[begin : k + 1]
            part = part[~np.isnan(part)]
            best = max(best, part.sum() ** 2 / (len(part) + bound**-2))
        assert float(found[k]) == pytest.approx(best, rel=1e-12)


def test_the_likelihood_ratio_of_a_noiseless_jump_grows_by_its_square_each_row():
    np.testing.assert_allclose(mean_jump(np.array([0.0, 0.0, 2.0, 2.0, 2.0]), 60), [0, 0, 4, 8, 12])
    assert not np.asarray(mean_jump(np.array([NAN, NAN]), 60)).any()


def test_scores_are_estimates_in_their_sigmas_and_zero_where_nothing_is_uncertain():
    mean, cov = jnp.array([[9.0, 2.0, 5.0]]), jnp.diag(jnp.array([1.0, 0.25, 0.0]))[None]
    assert fault_scores(mean, cov, 2).tolist() == [[4.0, 0.0]]


def test_innovations_are_counted_in_their_own_sigmas_and_missing_ones_are_nan():
    found = normalised_innovations(
        jnp.array([[1.0, 0.0]]), jnp.array([[[4.0, 1.0], [1.0, 1.0]]]), jnp.array([[True, False]])
    )
    np.testing.assert_array_equal(found, [[0.5, NAN]])


def test_the_chi_square_threshold_is_its_quantile():
    assert chi_square_threshold(6, 1e-4) == pytest.approx(chi2.isf(1e-4, 6), rel=1e-12)
    assert chi_square_threshold(6, 1e-4, window=20) == pytest.approx(chi2.isf(1e-4, 120) / 20, rel=1e-12)


def test_a_batch_of_runs_has_the_statistics_of_each(rng):
    nis, scores = rng.standard_exponential((3, 50)), rng.standard_normal((3, 50, 2))
    both = jax.vmap(lambda nis, z: detection_statistics(nis, z, window=5))(jnp.asarray(nis), jnp.asarray(scores))
    for k in range(3):
        one = detection_statistics(nis[k], scores[k], window=5)
        for name, values in one.items():
            np.testing.assert_allclose(both[name][k], values, rtol=1e-14)


# Alarms ---------------------------------------------------------------------------------------------------------------


def test_exceedances_close_together_are_one_alarm():
    t, high = np.arange(9.0), np.array([0, 9, 9, 0, 9, 0, 0, 0, 9.0])
    assert np.flatnonzero(alarms(t, high, 5.0)).tolist() == [1, 2, 4, 8]
    assert np.flatnonzero(alarms(t, high, 5.0, merge=1.0)).tolist() == [1, 4, 8]
    assert np.flatnonzero(alarms(t, high, 5.0, merge=2.0)).tolist() == [1, 8]
    assert np.flatnonzero(alarms(t, high, 5.0, merge=4.0)).tolist() == [1]


def test_nothing_is_an_alarm_while_it_is_held_off_missing_or_at_the_threshold():
    t, high = np.arange(5.0), np.array([9, 9, NAN, 5.0, 9.0])
    assert np.flatnonzero(alarms(t, high, 5.0, hold_off=1.5)).tolist() == [4]


# Thresholds -----------------------------------------------------------------------------------------------------------


def test_the_threshold_is_the_peak_of_the_nth_highest_burst():
    t = np.arange(12.0)
    values = np.array([0, 7, 8, 7, 0, 0, 9, 0, 0, 6, 5, 0.0])
    found = [calibrate_threshold(values, t, n / 11.0, merge=1.0).value for n in (1, 2, 3)]
    assert found == [9.0, 8.0, 6.0]
    # Merged over three seconds, the two highest bursts are apart while only their peaks count, and one from 0 on.
    assert calibrate_threshold(values, t, 2 / 11.0, merge=3.0).value == 8.0


def test_a_burst_that_bridges_two_makes_them_one():
    # 9 and 8 are two until 7 joins them; 5 is then the second and 4 the third.
    values = np.array([9, 7, 8, 0, 5, 0, 4.0])
    assert calibrate_threshold(values, np.arange(7.0), 3 / 6, merge=1.0).value == 4.0


@pytest.fixture(scope="module")
def sound():
    """Statistics of a sound filter with fault states along 48 runs of 60 s: correlated in time."""
    model, prior = faulty(
        cart(), actuator_offset("left", sigma=0.5, walk=0.05), sensor_bias("range0", sigma=1e-3, walk=1e-4)
    )
    t = STEP * np.arange(601)
    u = np.stack([np.sin(t), np.cos(t)], axis=1)
    found = fault_free_statistics(
        Statistics(model.space.added), gf.kalman_filter(), model, prior, t, u, runs=48, key=jax.random.key(5)
    )
    return t, found


@dataclasses.dataclass(frozen=True)
class Statistics:
    """The usual statistics of a run's reports."""

    count: int

    def __call__(self, info):
        scores = fault_scores(info.estimate.mean, info.estimate.cov, self.count)
        return detection_statistics(info.nis, scores, window=20)


@pytest.mark.parametrize("name", ["nis", "nis_mean", "score", "cusum"])
def test_a_calibrated_threshold_keeps_its_rate_on_fresh_runs(sound, name):
    t, found = sound
    values = found[name]
    threshold = calibrate_threshold(values[:24], t, 0.02, merge=2.0, hold_off=5.0)
    assert threshold.events == 26  # 24 runs of 55 s at 0.02 per second are 26.4 alarms
    low, high = threshold.bounds()
    assert low < threshold.rate < high
    test = check_threshold(threshold, values[24:], t, level=0.9999)
    assert test.passed, test.sentence
    assert 0 < test.lower < test.expected < test.upper < 4 * test.expected


def test_a_threshold_that_is_too_low_is_found_out(sound):
    t, found = sound
    threshold = calibrate_threshold(found["nis"][:24], t, 0.02)
    half = dataclasses.replace(threshold, value=0.5 * threshold.value)
    test = check_threshold(half, found["nis"][24:], t)
    assert not test.passed
    assert test.events > test.upper
    assert test.sentence.startswith(f"{test.events} false alarms in 1440 s, 28.8 stated")


def test_the_bounds_on_fresh_alarms_hold_as_often_as_stated(rng):
    t, passed = np.arange(401.0), []
    for _ in range(200):
        values = rng.standard_normal((2, 4, 401))
        threshold = calibrate_threshold(values[0], t, 0.02)
        passed.append(check_threshold(threshold, values[1], t, level=0.9).passed)
    # At least 0.9 of the time, since counts are whole numbers; five standard errors below is 0.79.
    assert np.mean(passed) > 0.79
    assert np.mean(passed) < 1.0


def test_a_chi_square_threshold_keeps_its_rate_where_rows_are_independent(sound):
    _, found = sound
    probability = 0.005
    above = found["nis"] > chi_square_threshold(1, probability)
    expected = probability * above.size
    assert abs(above.sum() - expected) < 4 * np.sqrt(expected)


def test_fault_scores_are_no_independent_normals_which_is_why_they_are_calibrated(sound):
    t, found = sound
    score = found["score"]
    level = np.quantile(score, 0.9)
    bursts = int(jax.vmap(lambda values: alarms(t, values, level, merge=2.0))(jnp.asarray(score)).sum())
    assert 0 < bursts < (score > level).sum() / 3
    # The filter allows for faults that are not there: of two independent normals a fortieth would exceed this.
    assert (score > 2.5).mean() < 1 / 400


def test_runs_without_faults_are_reproducible_and_differ_among_themselves():
    model, prior = faulty(cart(), actuator_offset("left", sigma=0.5))
    given = (Statistics(1), gf.kalman_filter(), model, prior, STEP * np.arange(20))
    first = fault_free_statistics(*given, runs=3, key=jax.random.key(1))["nis"]
    again = fault_free_statistics(*given, runs=3, key=jax.random.key(1))["nis"]
    assert first.tolist() == again.tolist()
    assert len({tuple(run) for run in first.tolist()}) == 3


def test_the_statistics_of_a_result_are_those_of_its_arrays():
    model, prior = faulty(cart(), actuator_offset("left", sigma=0.5))
    log = gf.draw_log(model, prior, STEP * np.arange(40), np.ones((40, 2)), key=jax.random.key(0))
    y = log.y.copy()
    y[10] = NAN
    result = gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, log.t, y, log.u))
    found = result_statistics(result, window=4)
    np.testing.assert_allclose(found["score"], np.abs(result.mean[:, 2] / result.std[:, 2]), rtol=1e-12)
    assert np.isnan(found["nis"][10])
    assert np.isfinite(found["nis_mean"][4:]).all()
