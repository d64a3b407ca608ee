"""Thresholds for a stated rate of false alarms, found on runs without faults and checked on others."""

from __future__ import annotations

import bisect
import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.special
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, DataError
from .alarms import alarms


@dataclasses.dataclass(frozen=True)
class Threshold:
    """A threshold for a stated rate of false alarms, and what it rests on.

    Attributes:
        value: what the statistic must exceed.
        rate: false alarms per second asked for [1/s].
        events: the value is the peak of the alarm with this place among the runs' highest.
        duration: length of all runs together, without their hold-off [s].
        merge: exceedances at most so far apart are one alarm [s].
        hold_off: no alarm within so long of the first row [s].
    """

    value: float
    rate: float
    events: int
    duration: float
    merge: float
    hold_off: float

    def bounds(self, level: float = 0.95) -> tuple[float, float]:
        """Between which rates [1/s] the true one lies, if alarms are independent: the fewer events, the wider."""
        tail = 0.5 * (1 - level)
        low, high = scipy.special.gammaincinv(self.events, [tail, 1 - tail]) / self.duration
        return float(low), float(high)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        low, high = (1000 * rate for rate in self.bounds())
        return (
            f"threshold {self.value:.4g} for {1000 * self.rate:.3g} false alarms per 1000 s "
            f"(95 % bounds {low:.2g} to {high:.2g}, from {self.events} in {self.duration:.4g} s)"
        )

    def alarms(self, t: Float[Array, " T"], statistic: Float[Array, " T"]) -> Bool[Array, " T"]:
        """Rows in which an alarm is raised."""
        return alarms(t, statistic, self.value, merge=self.merge, hold_off=self.hold_off)


def calibrate_threshold(
    statistics: Any, t: Any, rate: float, *, merge: float = 0.0, hold_off: float = 0.0
) -> Threshold:
    """The threshold that fault-free runs exceed at a stated rate, counted as alarms, not as rows.

    Statistics are correlated in time, so exceedances come in bursts; those at most `merge` seconds apart are one alarm.
    The threshold is the peak of the `n`-th highest burst, `n = rate` times the length of the runs: new runs of that
    length exceed the `n`-th highest of as many old ones `n` times on average.

    Args:
        statistics: of runs without faults (runs, T), or of one (T,).
        t: times [s], the same for all runs (T,).
        rate: false alarms per second [1/s]; `1e-3` is one per 1000 s.
        merge: exceedances at most so far apart are one alarm [s].
        hold_off: no alarm within so long of the first row [s].

    Raises:
        ConfigError: a rate that is not above zero, or times that do not fit.
        DataError: runs too short for one alarm at that rate, or bursts so long that there are fewer.

    Example:
        >>> import numpy as np
        >>> calibrate_threshold([0.0, 5.0, 4.0, 1.0, 3.0, 0.0], np.arange(6.0), 0.4, merge=1.0).value
        3.0
    """
    values, times = np.atleast_2d(np.asarray(statistics, float)), np.asarray(t, float)
    if values.ndim != 2 or times.shape != values.shape[1:]:
        raise ConfigError(f"statistics: expected shape (runs, {times.size}), got {values.shape}")
    if not rate > 0:
        raise ConfigError(f"rate: expected false alarms per second above 0, got {rate!r}")
    counted = times - times[0] >= hold_off
    values, times = values[:, counted], times[counted]
    duration = values.shape[0] * float(times[-1] - times[0]) if times.size else 0.0
    allowed = int(rate * duration * (1 + 1e-12))  # a product that is a whole number but for rounding
    if allowed < 1:
        raise DataError(f"statistics: expected runs of {1 / rate:.6g} s together at least, got {duration:.6g} s")
    value = _peak(values, times, allowed, merge)
    return Threshold(value, float(rate), allowed, duration, float(merge), float(hold_off))


def _peak(values: np.ndarray, times: np.ndarray, count: int, merge: float) -> float:
    """The highest level that so many separate exceedances reach."""
    order = np.argsort(np.where(np.isnan(values), -np.inf, values), axis=None)[::-1]
    above: list[list[float]] = [[] for _ in range(values.shape[0])]
    events = 0
    for place in order[: int((~np.isnan(values)).sum())]:
        run, row = divmod(int(place), values.shape[1])
        events += _joined(above[run], float(times[row]), merge)
        if events == count:
            return float(values[run, row])
    raise DataError(f"statistics: expected {count} separate exceedances of some level, found fewer; is merge too long?")


def _joined(times: list[float], t: float, merge: float) -> int:
    """Enter a time, and say by how much the number of separate events grows: 1, 0, or -1 where it joins two."""
    place = bisect.bisect(times, t)
    left = place > 0 and t - times[place - 1] <= merge
    right = place < len(times) and times[place] - t <= merge
    apart = 0 < place < len(times) and times[place] - times[place - 1] > merge
    times.insert(place, t)
    if left and right:
        return -1 if apart else 0
    return 0 if left or right else 1


@dataclasses.dataclass(frozen=True)
class FalseAlarmTest:
    """False alarms of new runs against those a threshold was calibrated on.

    Attributes:
        events: false alarms of the new runs.
        duration: their length without the hold-off [s].
        expected: how many the stated rate promises.
        lower: fewest that are plausible at `level`, given that the calibration was itself uncertain.
        upper: most.
        level: probability of lying between the two.
    """

    events: int
    duration: float
    expected: float
    lower: int
    upper: int
    level: float

    @property
    def passed(self) -> bool:
        """Whether the rate is what was stated."""
        return self.lower <= self.events <= self.upper

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        head = f"{self.events} false alarms in {self.duration:.4g} s, {self.expected:.3g} stated"
        return f"{head} ({100 * self.level:.3g} % bounds {self.lower} to {self.upper})"


def check_threshold(threshold: Threshold, statistics: Any, t: Any, level: float = 0.95) -> FalseAlarmTest:
    """Whether new fault-free runs have as many false alarms as stated.

    Given `n` events in calibration over a length `T`, those of new runs over `T'` are negative binomial: each further
    event is a new one with probability `T' / (T + T')`, until the `n`-th old one.

    Args:
        threshold: from `calibrate_threshold`, on other runs.
        statistics: of runs without faults (runs, T).
        t: times [s] (T,).
        level: probability between the bounds if the rate is as stated.
    """
    values, times = np.atleast_2d(np.asarray(statistics, float)), np.asarray(t, float)
    found = jax.vmap(lambda values: threshold.alarms(jnp.asarray(times), values))(jnp.asarray(values))
    counted = times[times - times[0] >= threshold.hold_off]
    duration = values.shape[0] * float(counted[-1] - counted[0])
    old = threshold.duration / (threshold.duration + duration)
    tail = 0.5 * (1 - level)
    most = np.arange(int(20 + 20 * threshold.events * (1 + (1 - old) / old)))
    below = scipy.special.betainc(threshold.events, most + 1, old)  # of at most so many new ones
    lower, upper = int(np.searchsorted(below, tail)), int(np.searchsorted(below, 1 - tail))
    return FalseAlarmTest(int(np.asarray(found).sum()), duration, threshold.rate * duration, lower, upper, level)
