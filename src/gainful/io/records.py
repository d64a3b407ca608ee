"""A record from files: sensors at their own rates merged by time."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError, DataError, did_you_mean
from ..models import AbstractModel
from ..running import Log, make_log, with_outage
from ..spaces import AbstractSpace, Circle
from .series import Reader, Series, merge_duplicates
from .source import Column, Outage, Source

_TRUTH_GAP = 5.0
"""Truth is interpolated across gaps of up to this many of its median steps."""


def read_log(model: AbstractModel, source: Source, base: Path | str = ".") -> Log:
    """The record a source describes, ready for `run`.

    Every time at which something was measured or an input changed becomes a row; what was not measured then is unseen.
    Rows before all inputs are known, or after the last one that applies to a closing interval, are left out and
    counted.

    Args:
        model: names the signals and their units.
        source: where they are found.
        base: folder that `source.folder` is relative to.

    Raises:
        ConfigError: a signal that the model does not have, an input without a column, or no file.
        DataError: a file, column, time or number that cannot be used; the message says which.
        UnitError: a unit that does not convert.
    """
    reader = Reader(source, Path(base))
    groups = signal_groups(model.output)
    _known("outputs", source.outputs, list(groups))
    _known("inputs", source.inputs, list(model.inputs))
    for name in model.inputs:
        if name not in source.inputs:
            raise ConfigError(f"inputs: the model's input {name!r} has no column")
    outputs = {
        name: merge_duplicates(reader.series(name, where, groups[name][1]), name, source.duplicates)
        for name, where in source.outputs.items()
    }
    inputs = {
        name: _input_series(reader.series(name, source.inputs[name], (unit,)), name, source.duplicates)
        for name, unit in zip(model.inputs, model.input_units, strict=True)
    }
    t, turn = _timeline(outputs, inputs)
    t, turn, left_out = _crop(t, turn, source, inputs)
    y = _place(outputs, groups, model.output.size, t, turn)
    u = np.stack([_held(inputs[n], source.inputs[n], t) for n in model.inputs], axis=1) if model.inputs else None
    truth = _truth(model, source, reader, t)
    log = make_log(model, t, y, u, truth=truth, max_step=source.max_step)
    late = max((s.sorted_rows for s in (*outputs.values(), *inputs.values())), default=0)
    counts = {"late rows sorted": late, "rows before or after the inputs": left_out}
    # A sensor misses only where its own file has a row; where another one has, it was not due.
    missing, names = {}, iter(model.output.tangent_names)
    for name, (_, units) in groups.items():
        gaps = int(np.isnan(outputs[name].values).any(axis=1).sum()) if name in outputs else 0
        # A quaternion's four numbers are three degrees of freedom.
        missing |= {next(names): gaps for _ in range(3 if len(units) == 4 else 1)}
    found = {name: count for name, count in counts.items() if count}
    log = dataclasses.replace(log, counts=log.counts | found, missing=missing)
    for outage in source.outages:
        log = _without(log, model, outage)
    return log


def _without(log: Log, model: AbstractModel, outage: Outage) -> Log:
    try:
        return with_outage(log, model, outage.outputs, outage.start, math.inf if outage.stop is None else outage.stop)
    except ConfigError as problem:
        raise ConfigError(f"outages: {problem}") from problem


def signal_groups(space: AbstractSpace) -> dict[str, tuple[slice, tuple[str, ...]]]:
    """Signals as a user names them (a quaternion as one), with their place in a point and their units."""
    groups, i = {}, 0
    for part in space.parts:
        if part.size != part.dof:
            groups[part.names[0].removesuffix("_x")] = (slice(i, i + part.size), part.units)
        else:
            for j, (name, unit) in enumerate(zip(part.names, part.units, strict=True)):
                groups[name] = (slice(i + j, i + j + 1), (unit,))
        i += part.size
    return groups


def _known(role: str, given: dict[str, Column], known: list[str]) -> None:
    for name in given:
        if name not in known:
            raise ConfigError(f"{role}: {name!r} is not a signal of the model; {did_you_mean(name, known)}")
    if role == "outputs" and not given:
        raise ConfigError(f"outputs: expected at least one of {', '.join(known)}, got none")


def _input_series(series: Series, name: str, duplicates: str) -> Series:
    """An input without missing values: a gap holds what was there before, as the input itself does.

    An input has one value at a time: of several kept, the last counts.
    """
    present = np.isfinite(series.values[:, 0])
    known = Series(series.t[present], series.values[present], series.sorted_rows)
    return merge_duplicates(known, name, "last" if duplicates == "keep" else duplicates)


def _timeline(outputs: dict[str, Series], inputs: dict[str, Series]) -> tuple[np.ndarray, np.ndarray]:
    """All times, and for equal ones which turn it is: signals measured twice at one time need two rows."""
    keys = [np.stack([s.t, _turns(s.t)], axis=1) for s in outputs.values()]
    keys += [np.stack([s.t, np.zeros(len(s.t))], axis=1) for s in inputs.values()]
    rows = np.unique(np.concatenate(keys), axis=0)
    return rows[:, 0], rows[:, 1]


def _turns(t: np.ndarray) -> np.ndarray:
    start = np.flatnonzero(np.append(True, np.diff(t) > 0))
    return (np.arange(len(t)) - np.repeat(start, np.diff(np.append(start, len(t))))).astype(float)


def _crop(
    t: np.ndarray, turn: np.ndarray, source: Source, inputs: dict[str, Series]
) -> tuple[np.ndarray, np.ndarray, int]:
    keep = np.ones(len(t), bool)
    for name, series in inputs.items():
        where = source.inputs[name]
        keep &= t >= series.t[0]
        if where.increment or where.hold != "previous":
            keep &= t <= series.t[-1]
    left_out = int(np.count_nonzero(~keep))
    if source.start is not None:
        keep &= t >= source.start
    if source.stop is not None:
        keep &= t <= source.stop
    if not keep.any():
        raise DataError(
            f"no row is left: outputs and inputs span {t[0]:.9g} s to {t[-1]:.9g} s, start is {source.start}, "
            f"stop is {source.stop}, and the inputs must cover the times used"
        )
    return t[keep], turn[keep], left_out


def _place(
    outputs: dict[str, Series], groups: dict[str, Any], size: int, t: np.ndarray, turn: np.ndarray
) -> np.ndarray:
    y = np.full((len(t), size), np.nan)
    rows = {key: k for k, key in enumerate(zip(t.tolist(), turn.tolist(), strict=True))}
    for name, series in outputs.items():
        found = [rows.get(key, -1) for key in zip(series.t.tolist(), _turns(series.t).tolist(), strict=True)]
        place = np.asarray(found)
        y[place[place >= 0], groups[name][0]] = series.values[place >= 0]
    return y


def _held(series: Series, where: Column, t: np.ndarray) -> np.ndarray:
    """The input over the interval that ends at each time."""
    values = series.values[:, 0]
    before = np.concatenate([t[:1], t[:-1]])
    if where.increment or where.hold == "next":
        return values[np.minimum(np.searchsorted(series.t, t, side="left"), len(values) - 1)]
    if where.hold == "linear":
        return 0.5 * (np.interp(before, series.t, values) + np.interp(t, series.t, values))
    return values[np.maximum(np.searchsorted(series.t, before, side="right") - 1, 0)]


def _truth(model: AbstractModel, source: Source, reader: Reader, t: np.ndarray) -> dict[str, np.ndarray]:
    groups = signal_groups(model.space)
    _known("truth", source.truth, list(groups))
    circles = {name for part in model.space.parts if isinstance(part, Circle) for name in part.names}
    out: dict[str, np.ndarray] = {}
    for name, where in source.truth.items():
        place, units = groups[name]
        series = merge_duplicates(reader.series(name, where, units), name, "last")
        present = np.isfinite(series.values).all(axis=1)
        times, values = series.t[present], series.values[present]
        if name in circles:
            values = np.unwrap(values, axis=0)
        if len(units) == 4:
            values = _continuous_sign(values)
        known = _near(times, t)
        points = np.stack([np.where(known, np.interp(t, times, column), np.nan) for column in values.T], axis=1)
        if len(units) == 4:
            points /= np.linalg.norm(points, axis=1, keepdims=True)
        for column, full in zip(points.T, model.space.names[place], strict=True):
            out[full] = column
    return out


def _continuous_sign(values: np.ndarray) -> np.ndarray:
    """Quaternions of one attitude each, signs chosen so that neighbours are close."""
    flips = np.sign(np.sum(values[1:] * values[:-1], axis=1))
    return values * np.concatenate([[1.0], np.cumprod(np.where(flips == 0, 1.0, flips))])[:, None]


def _near(times: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Where truth lies close enough on both sides to interpolate."""
    if len(times) < 2:
        return np.isin(t, times)
    after = np.clip(np.searchsorted(times, t, side="left"), 0, len(times) - 1)
    before = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
    close = times[after] - times[before] <= _TRUTH_GAP * np.median(np.diff(times))
    return close & (t >= times[0]) & (t <= times[-1])
