"""Scores of detection and estimation, against counting by hand."""

import numpy as np
import pytest

from gainful.faults import (
    detection_delay,
    false_alarm_rate,
    missed_alarm_rate,
    receiver_operating_characteristic,
    settling_time,
    time_to_fall,
    time_to_reach,
    window_rmse,
)

NAN = float("nan")
T = np.arange(10.0)


def rows(*at):
    out = np.zeros(10, bool)
    out[list(at)] = True
    return out


def test_the_delay_counts_from_the_onset_to_the_first_alarm_and_before_the_end():
    alarm = np.stack([rows(1, 5, 7), rows(4), rows(2, 8), rows()])
    np.testing.assert_array_equal(detection_delay(T, alarm, onset=4.0, end=8.0), [1.0, 0.0, NAN, NAN])
    assert detection_delay(T, alarm[0], onset=4.0) == 1.0


def test_what_has_no_delay_was_missed():
    assert missed_alarm_rate(np.array([1.0, NAN, 0.0, NAN])) == 0.5


def test_false_alarms_are_counted_per_second_of_all_runs():
    alarm = np.stack([rows(1, 5, 7), rows(4)])
    assert false_alarm_rate(T, alarm) == pytest.approx(4 / (2 * 9.0))
    assert false_alarm_rate(T, alarm, end=5.0) == pytest.approx(2 / (2 * 4.0))
    assert false_alarm_rate(T, alarm[0], start=5.0) == pytest.approx(2 / 4.0)


def test_the_area_under_the_curve_is_the_share_of_pairs_in_order(rng):
    healthy, faulty = rng.integers(0, 6, 40).astype(float), rng.integers(2, 9, 30).astype(float)
    false, found, area = receiver_operating_characteristic(healthy, faulty)
    pairs = faulty[:, None] - healthy[None, :]
    assert area == pytest.approx(np.mean((pairs > 0) + 0.5 * (pairs == 0)), rel=1e-12)
    assert (false[0], found[0], false[-1], found[-1]) == (0, 0, 1, 1)
    assert (np.diff(false) >= 0).all()
    assert (np.diff(found) >= 0).all()


def test_a_perfect_statistic_has_area_one_and_a_missing_value_does_not_count():
    assert receiver_operating_characteristic([0.0, 1.0, NAN], [2.0, NAN, 3.0])[2] == 1.0
    assert receiver_operating_characteristic([0.0, 1.0], [0.0, 1.0])[2] == 0.5


def test_the_times_to_reach_and_to_fall_are_those_of_an_exponential():
    t = np.arange(0.0, 40.0, 0.01)
    estimate = -2.0 * np.where(t < 20, 1 - np.exp(-np.maximum(t - 5, 0)), np.exp(-(t - 20)))
    assert time_to_reach(t, estimate, -2.0, since=5.0) == pytest.approx(np.log(10), abs=0.011)
    assert time_to_fall(t, estimate, -2.0, since=20.0) == pytest.approx(np.log(10), abs=0.011)
    assert np.isnan(time_to_reach(t, estimate, -2.0, since=5.0, until=6.0))
    assert np.isnan(time_to_reach(t, 0 * estimate, -2.0, since=5.0))
    both = time_to_reach(t, np.stack([estimate, 0.5 * estimate]), -2.0, since=5.0)
    assert both[0] < 3
    assert np.isnan(both[1])


def test_an_error_has_settled_when_it_is_inside_for_good():
    error = np.array([5, 5, 0.1, 5, 0.1, NAN, -0.1, 0.1, 0.1, 0.1])
    assert settling_time(T, error, 1.0, since=1.0) == 3.0
    assert np.isnan(settling_time(T, np.append(error[:-1], 9.0), 1.0, since=1.0))
    assert settling_time(T, np.append(error[:-1], 9.0), 1.0, since=1.0, until=9.0) == 3.0


def test_the_rmse_of_a_window_leaves_out_what_is_missing():
    error = np.stack([np.where(T == 3, NAN, T), np.full(10, NAN)])
    np.testing.assert_allclose(window_rmse(T, error, 2.0, 5.0), [np.sqrt((4 + 16) / 2), NAN])
    assert window_rmse(T, error[0]) == pytest.approx(np.sqrt((np.sum(T**2) - 9) / 9))
