"""Intervals over runs, against SciPy and closed forms, and how often they cover."""

import math

import numpy as np
import pytest
import scipy.stats

from gainful.studies import (
    Measured,
    difference_interval,
    exactly,
    mean_interval,
    median_interval,
    ratio_interval,
    rms_interval,
    share_interval,
)


@pytest.mark.parametrize("level", [0.9, 0.95])
def test_the_interval_of_a_mean_is_students(rng, level):
    x = rng.normal(3.0, 2.0, 17)
    found = mean_interval(x, level=level, unit="m")
    wanted = scipy.stats.t.interval(level, 16, np.mean(x), scipy.stats.sem(x))
    assert (found.low, found.high) == pytest.approx(wanted, rel=1e-12)
    assert found.value == pytest.approx(x.mean(), rel=1e-14)
    assert (found.runs, found.unit) == (17, "m")


def test_one_run_has_a_mean_but_no_interval():
    assert mean_interval([2.0]) == Measured(2.0, -math.inf, math.inf, 1)
    assert ratio_interval([2.0], [4.0]) == Measured(0.5, -math.inf, math.inf, 1)


def test_a_run_that_failed_is_not_left_out_of_the_mean():
    for bad in (np.nan, np.inf):
        found = mean_interval([1.0, bad, 2.0])
        assert not found.known
        assert found.note == "not finite in 1 of 3 runs"
        assert not ratio_interval([1.0, bad], [1.0, 2.0]).known


def test_the_interval_of_a_root_mean_square_is_the_root_of_that_of_the_mean_square(rng):
    x = rng.normal(1.0, 2.0, 30)
    found, square = rms_interval(x, unit="m"), mean_interval(x**2)
    assert [each**2 for each in (found.value, found.low, found.high)] == pytest.approx(
        [square.value, square.low, square.high], rel=1e-12
    )
    assert (found.runs, found.unit) == (30, "m")
    assert rms_interval([1.0, 100.0]).low == 0.0
    assert rms_interval([-2.0]) == Measured(2.0, -math.inf, math.inf, 1)
    assert not rms_interval([1.0, np.nan]).known


@pytest.mark.parametrize("n", [6, 7, 20, 51])
def test_the_interval_of_a_median_is_the_tightest_pair_of_order_statistics_that_covers(n):
    found = median_interval(np.arange(n)[::-1])

    def covered(j):  # by the j-th smallest and the j-th largest
        return 1 - 2 * scipy.stats.binom.cdf(j - 1, n, 0.5)

    j = int(found.low) + 1
    assert found.high == n - j
    assert covered(j) >= 0.95 > covered(j + 1)
    assert found.value == np.median(np.arange(n))


def test_five_runs_are_too_few_for_the_interval_of_a_median():
    assert median_interval(np.arange(5.0)) == Measured(2.0, -math.inf, math.inf, 5)


def test_never_counts_as_late_in_a_median():
    found = median_interval([1.0] * 5 + [2.0] * 5 + [math.inf] * 5)
    assert (found.value, found.low, found.high) == (2.0, 1.0, math.inf)
    assert found.note == "never in 5 of 15 runs"
    assert median_interval([math.inf] * 8).value == math.inf
    assert not median_interval([1.0, np.nan]).known


@pytest.mark.parametrize(("k", "n"), [(0, 20), (1, 20), (13, 20), (20, 20), (1, 1)])
def test_the_interval_of_a_share_is_wilsons(k, n):
    found = share_interval(np.arange(n) < k)
    wanted = scipy.stats.binomtest(k, n).proportion_ci(method="wilson")
    assert (found.low, found.high) == pytest.approx((wanted.low, wanted.high), abs=1e-12)
    assert found.value == k / n


def test_a_ratio_to_something_constant_has_the_relative_interval_of_the_mean(rng):
    x = rng.uniform(1.0, 2.0, 12)
    found, mean = ratio_interval(x, np.full(12, 4.0)), mean_interval(x)
    reach = (mean.high - mean.value) / mean.value
    assert found.value == pytest.approx(mean.value / 4, rel=1e-14)
    assert math.log(found.high / found.value) == pytest.approx(reach, rel=1e-9)
    assert math.log(found.value / found.low) == pytest.approx(reach, rel=1e-9)


def test_a_ratio_of_runs_that_share_their_noise_is_known_better(rng):
    noise = rng.uniform(1.0, 2.0, 30)
    own = rng.uniform(1.0, 1.01, 30)
    paired, mixed = ratio_interval(noise * own, noise), ratio_interval(noise * own, rng.permutation(noise))
    assert paired.high - paired.low < 0.1 * (mixed.high - mixed.low)
    assert ratio_interval(3 * noise, noise).high == pytest.approx(3.0, rel=1e-12)


def test_the_ratio_of_two_means_agrees_with_fieller_where_these_are_known_well(rng):
    a, b = rng.normal(10.0, 0.3, 25), rng.normal(5.0, 0.2, 25)
    found = ratio_interval(a, b)
    # Fieller (1954): the ratios r for which mean(a - r b) is not told from zero.
    t = scipy.stats.t.ppf(0.975, 24) ** 2 / 25
    (saa, sab), (_, sbb) = np.cov(a, b)
    roots = np.roots([b.mean() ** 2 - t * sbb, -2 * (a.mean() * b.mean() - t * sab), a.mean() ** 2 - t * saa])
    # Both are right to first order in the relative interval, about 2 %; they differ in second order.
    np.testing.assert_allclose(sorted([found.low, found.high]), sorted(roots), rtol=1e-3)


def test_a_ratio_needs_means_above_zero():
    assert ratio_interval([1.0, 2.0], [-1.0, 1.0]).note == "a mean is not above zero"


def test_a_difference_is_the_mean_of_the_differences(rng):
    a, b = rng.normal(size=9), rng.normal(size=9)
    assert difference_interval(a, b, unit="s") == mean_interval(a - b, unit="s")


@pytest.mark.parametrize(
    ("interval", "truth"),
    [
        (lambda rng: mean_interval(rng.gamma(4.0, size=20)), 4.0),
        (lambda rng: rms_interval(rng.gamma(16.0, size=20)), math.sqrt(272.0)),
        (lambda rng: median_interval(rng.gamma(4.0, size=20)), scipy.stats.gamma.median(4.0)),
        (lambda rng: share_interval(rng.random(20) < 0.7), 0.7),
        (lambda rng: ratio_interval(rng.gamma(4.0, size=20), rng.gamma(8.0, size=20)), 0.5),
    ],
)
def test_intervals_cover_as_often_as_they_say(rng, interval, truth):
    found = [interval(rng) for _ in range(2000)]
    share = np.mean([each.low <= truth <= each.high for each in found])
    # Three sigma of 2000 trials are 1.5 %; skewness costs the mean and the ratio up to 2 %, and order statistics and
    # shares are discrete: 20 runs cover a median with 95.9 %, and a share of 0.7 with 94.5 to 97.5 %.
    assert 0.915 < share < 0.98


def test_numbers_are_shown_to_two_digits_of_their_interval():
    for found, text in [
        (Measured(0.00497, 0.00488, 0.00506, 20, "N m"), "0.004970 ± 0.000090 N m"),
        (Measured(123.4, 113.4, 133.4, 20), "123 ± 10"),
        (Measured(2.3e-7, 2.2e-7, 2.4e-7, 20), "(2.30 ± 0.10)e-7"),
        (Measured(0.917, 0.646, 0.985, 12), "0.917 [0.646, 0.985]"),
        (Measured(168.0, 160.0, 190.0, 12, "s"), "168 [160, 190] s"),
        (Measured(2.0, -math.inf, math.inf, 1, "s"), "2 s (no interval)"),
        (Measured(2.0, 1.0, math.inf, 9, "s"), "2 [1, never] s"),
        (Measured(1652.0, 1250.0, math.inf, 9), "1652 [1250, never]"),
        (Measured(1030.4, 612.0, 2980.0, 9), "1030 [612, 2980]"),
        (Measured(2.4e6, 1.2e6, 9.0e6, 9), "2.40e+06 [1.20e+06, 9.00e+06]"),
        (Measured(math.inf, 1.0, math.inf, 9, "s"), "never"),
        (exactly(0.0, "m"), "0 m"),
        (Measured(math.nan, -math.inf, math.inf, 3, "m"), "\N{EN DASH}"),
    ]:
        assert str(found) == text
