"""Signals of one motion from files, at equally spaced times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import ConfigError, DataError
from ..identification import Recording
from .series import Reader, Series, merge_duplicates
from .source import Column, Source

Resample = Literal["none", "linear"]
"""What is done with samples that are not equally spaced."""

_JITTER = 0.05
"""Share of a step by which a sample's time may be off."""
_GAP = 2.5
"""Steps of a signal, its own or the recording's, whichever are longer, across which it is interpolated."""


def read_recording(
    units: Mapping[str, str],
    columns: Mapping[str, Sequence[Column]],
    source: Source,
    base: Path | str = ".",
    *,
    noise: Mapping[str, float] | None = None,
    dt: float | None = None,
    resample: Resample = "none",
) -> Recording:
    """Signals from files, each by one sensor or several.

    Args:
        units: of the signals, by name; "angle" for an angle [rad], whose turns are counted on.
        columns: where each signal is found, one per sensor.
        source: files and times; its own signals are left aside. Without a time column rows are equally spaced by `dt`.
        base: folder that `source.folder` is relative to.
        noise: standard deviation of one sensor's noise by signal, in the signal's unit.
        dt: time between rows [s]; by default the commonest of the signal with the most samples.
        resample: "none" takes samples as they are, with NaN where one is missing; "linear" interpolates them.

    Raises:
        ConfigError: steps that are no time.
        DataError: a file, column, time or number that cannot be used, or samples that are not equally spaced.
        UnitError: a unit that does not convert.
    """
    if dt is not None and not (dt > 0 and math.isfinite(dt)):
        raise ConfigError(f"dt: expected a time above 0 s, got {dt!r}")
    if not source.time and dt is None:
        raise ConfigError("time: expected a column, or dt for rows that are equally spaced, got neither")
    reader = Reader(source, Path(base), row_step=None if source.time else dt)
    found = {
        name: [
            _whole(merge_duplicates(reader.series(name, each, (units[name],)), name, source.duplicates), name, source)
            for each in columns[name]
        ]
        for name in columns
    }
    if "angle" in units.values():
        found |= {name: list(map(_unwrapped, each)) for name, each in found.items() if units[name] == "angle"}
    every = [series for each in found.values() for series in each]
    densest = max(every, key=lambda series: len(series.t))
    step = _commonest(np.diff(densest.t)) if dt is None else dt
    first, last = max(series.t[0] for series in every), min(series.t[-1] for series in every)
    rows = math.floor((last - first) / step + _JITTER) + 1
    if rows < 3:
        raise DataError(f"signals: expected at least 3 rows that all have in common, got {max(rows, 0)}")
    t = first + step * np.arange(rows)
    place = _placed if resample == "none" else _interpolated
    values = {name: np.stack([place(series, t, step, name) for series in each], axis=1) for name, each in found.items()}
    return Recording(t, values, dict(noise or {}))


def _whole(series: Series, name: str, source: Source) -> Series:
    """Without missing values, within the times asked for."""
    keep = np.isfinite(series.values[:, 0])
    keep &= (series.t >= (-np.inf if source.start is None else source.start)) & (
        series.t <= (np.inf if source.stop is None else source.stop)
    )
    if keep.sum() < 2:
        raise DataError(f"signal {name!r}: expected at least two values between start and stop, got {int(keep.sum())}")
    return Series(series.t[keep], series.values[keep], series.sorted_rows)


def _unwrapped(series: Series) -> Series:
    return Series(series.t, np.unwrap(series.values, axis=0), series.sorted_rows)


def _commonest(steps: np.ndarray) -> float:
    """The step that occurs most often, jitter aside: mean of those near the median of the mode."""
    size, counts = np.unique(np.round(steps / np.median(steps), 2), return_counts=True)
    near = np.abs(steps / np.median(steps) - size[counts.argmax()]) <= _JITTER
    return float(steps[near].mean())


def _placed(series: Series, t: np.ndarray, step: float, name: str) -> np.ndarray:
    """The samples at their rows, NaN where there is none."""
    inside = (series.t >= t[0] - 0.5 * step) & (series.t <= t[-1] + 0.5 * step)
    at = (series.t[inside] - t[0]) / step
    rows = np.rint(at).astype(int)
    off = np.abs(at - rows) > _JITTER
    twice = np.append(False, np.diff(rows) == 0)
    if off.any() or twice.any():
        k = int((off | twice).argmax())
        raise DataError(
            f"signal {name!r}: expected samples every {step:.6g} s from t = {t[0]:.9g} s, got one at t = "
            f'{series.t[inside][k]:.9g} s ({int((off | twice).sum())} such); resample = "linear" interpolates'
        )
    out = np.full(len(t), np.nan)
    out[rows] = series.values[inside, 0]
    return out


def _interpolated(series: Series, t: np.ndarray, step: float, name: str) -> np.ndarray:
    """Values between samples, NaN inside of long gaps."""
    values = np.interp(t, series.t, series.values[:, 0])
    after = np.clip(np.searchsorted(series.t, t), 1, len(series.t) - 1)
    gap = series.t[after] - series.t[after - 1]
    return np.where(gap > _GAP * max(step, float(np.median(np.diff(series.t)))), np.nan, values)
