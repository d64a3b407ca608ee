"""How soon faults are found, how often wrongly, and how well they are estimated: plain arrays, for one run or many."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ..errors import ConfigError


def detection_delay(
    t: Float[np.ndarray, " T"], alarm: Bool[np.ndarray, "... T"], onset: float, end: float = np.inf
) -> Float[np.ndarray, "..."]:
    """Time from a fault's onset to the first alarm before its end [s]; NaN where it was missed.

    Args:
        t: times [s].
        alarm: rows above the threshold, for any number of runs; not merged, or a false alarm just before the onset
            would hide the true one.
        onset: of the fault [s].
        end: of the fault [s].

    Example:
        >>> detection_delay(np.arange(4.0), np.array([[1, 0, 0, 1], [1, 0, 0, 0]], bool), onset=1.0).tolist()
        [2.0, nan]
    """
    t, alarm = np.asarray(t, float), np.asarray(alarm, bool)
    return np.asarray(_first(t, alarm & _between(t, onset, end)) - onset)


def missed_alarm_rate(delays: Float[np.ndarray, " runs"]) -> float:
    """Share of runs whose fault was not found: those with a NaN delay."""
    return float(np.mean(np.isnan(_some(delays, "delays"))))


def false_alarm_rate(
    t: Float[np.ndarray, " T"], alarm: Bool[np.ndarray, "... T"], start: float = -np.inf, end: float = np.inf
) -> float:
    """Alarms per second [1/s] of runs, or parts of runs, without a fault.

    Args:
        t: times [s].
        alarm: rows with an alarm, as `alarms` counts them.
        start: first time that counts [s].
        end: first time that does not [s], such as the onset of a fault.

    Raises:
        ConfigError: a window of less than two rows.
    """
    t, alarm = np.asarray(t, float), np.asarray(alarm, bool)
    rows = _window(t, start, end)
    runs = alarm.size // len(t)
    return float(alarm[..., rows].sum() / (runs * (t[rows][-1] - t[rows][0])))


def receiver_operating_characteristic(
    healthy: Any, faulty: Any
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], float]:
    """False-alarm and detection probabilities at all thresholds, and the area under the curve.

    Args:
        healthy: values of a statistic without a fault, such as the largest of each run; NaN is left out.
        faulty: with one.

    Returns:
        False-alarm probabilities, rising from 0 to 1; detection probabilities; the area, which is the probability that
        a faulty value exceeds a healthy one, ties counted by half.

    Raises:
        ConfigError: no values.

    Source: Hanley and McNeil (1982), Radiology 143(1):29-36.

    Example:
        >>> receiver_operating_characteristic([1.0, 2.0], [2.0, 3.0])[2]
        0.875
    """
    healthy, faulty = _some(healthy, "healthy"), _some(faulty, "faulty")
    healthy, faulty = (np.sort(values[~np.isnan(values)]) for values in (healthy, faulty))
    if not (healthy.size and faulty.size):
        raise ConfigError("healthy and faulty: expected values that are not NaN, got none")
    levels = np.unique(np.concatenate([healthy, faulty]))[::-1]
    false, found = (
        np.concatenate([[0.0], (len(values) - np.searchsorted(values, levels)) / len(values)])
        for values in (healthy, faulty)
    )
    return false, found, float(np.sum(np.diff(false) * (found[1:] + found[:-1]) / 2))


def time_to_reach(
    t: Float[np.ndarray, " T"],
    estimate: Float[np.ndarray, "... T"],
    size: float,
    since: float,
    *,
    share: float = 0.9,
    until: float = np.inf,
) -> Float[np.ndarray, "..."]:
    """Time until an estimate first reaches a share of a fault's size [s]; NaN where it never does.

    With the share 0.9 and `since` the onset this is t90.

    Args:
        t: times [s].
        estimate: of the fault, for any number of runs.
        size: of the fault, of either sign.
        since: when it begins [s].
        share: of the size.
        until: first time that does not count [s].
    """
    t, estimate = np.asarray(t, float), np.asarray(estimate, float)
    return np.asarray(_first(t, (estimate / size >= share) & _between(t, since, until)) - since)


def time_to_fall(
    t: Float[np.ndarray, " T"],
    estimate: Float[np.ndarray, "... T"],
    size: float,
    since: float,
    *,
    share: float = 0.1,
    until: float = np.inf,
) -> Float[np.ndarray, "..."]:
    """Time until an estimate first falls below a share of a fault's size [s]; NaN where it never does.

    With the share 0.1 and `since` the fault's end this is t10. The arguments are those of `time_to_reach`.
    """
    t, estimate = np.asarray(t, float), np.asarray(estimate, float)
    return np.asarray(_first(t, (estimate / size <= share) & _between(t, since, until)) - since)


def settling_time(
    t: Float[np.ndarray, " T"],
    error: Float[np.ndarray, "... T"],
    tolerance: float,
    since: float,
    *,
    until: float = np.inf,
) -> Float[np.ndarray, "..."]:
    """Time until an error is within a tolerance and stays there [s]; NaN where it is outside at the last row.

    Args:
        t: times [s].
        error: of an estimate, for any number of runs; NaN rows do not count.
        tolerance: largest absolute error, in the error's unit.
        since: from when [s].
        until: first time that does not count [s].

    Raises:
        ConfigError: a window of less than two rows.

    Example:
        >>> settling_time(np.arange(5.0), np.array([3.0, 0.1, 3.0, 0.1, 0.1]), 1.0, since=0.0).tolist()
        3.0
    """
    t, error = np.asarray(t, float), np.asarray(error, float)
    rows = _window(t, since, until)
    t, outside = t[rows], np.abs(error[..., rows]) > tolerance
    known = ~np.isnan(error[..., rows])
    after = ~np.flip(np.logical_or.accumulate(np.flip(outside, -1), axis=-1), -1)
    return np.asarray(_first(t, after & known) - since)


def window_rmse(
    t: Float[np.ndarray, " T"], error: Float[np.ndarray, "... T"], start: float = -np.inf, end: float = np.inf
) -> Float[np.ndarray, "..."]:
    """Root mean square error from one time to before another, NaN left out; NaN where nothing is left.

    Args:
        t: times [s].
        error: estimate minus truth, for any number of runs.
        start: first time that counts [s].
        end: first time that does not [s].

    Raises:
        ConfigError: a window of less than two rows.
    """
    squares = np.asarray(error, float)[..., _window(np.asarray(t, float), start, end)] ** 2
    known = ~np.isnan(squares)
    counts = known.sum(axis=-1)
    means = np.where(known, squares, 0.0).sum(axis=-1) / np.maximum(counts, 1)
    return np.where(counts > 0, np.sqrt(means), np.nan)


def _between(t: np.ndarray, start: float, end: float) -> Bool[np.ndarray, " T"]:
    return (t >= start) & (t < end)


def _window(t: np.ndarray, start: float, end: float) -> Bool[np.ndarray, " T"]:
    rows = _between(t, start, end)
    if rows.sum() < 2:
        raise ConfigError(f"window: expected two rows at least from {start:.9g} s to before {end:.9g} s")
    return rows


def _first(t: np.ndarray, rows: Bool[np.ndarray, "... T"]) -> Float[np.ndarray, "..."]:
    """Time of the first row marked, NaN without one."""
    return np.where(rows.any(axis=-1), t[np.argmax(rows, axis=-1)], np.nan)


def _some(values: Any, name: str) -> np.ndarray:
    array = np.asarray(values, float).ravel()
    if not array.size:
        raise ConfigError(f"{name}: expected at least one value, got none")
    return array
