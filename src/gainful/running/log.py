"""A record: what was measured when, with which inputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import ConfigError, DataError, ShapeError, did_you_mean
from ..models import AbstractModel


@dataclasses.dataclass(frozen=True)
class Log:
    """A record ready to be filtered, one row per moment; made by `make_log` or read from files.

    Attributes:
        t: times [s], never decreasing (T,).
        dt: time since the previous row [s]; the first counts from the prior (T,).
        u: inputs held over the interval that ends at each row (T, inputs).
        y: measured points; where unseen, any valid point (T, output size).
        seen: which degrees of freedom of the output were measured (T, output dof).
        truth: reference values by state name, NaN where there is none, each (T,).
        inserted: rows that only split a long interval (T,).
        counts: what was done to the record on the way in, by name.
        missing: how often each degree of freedom of the output should have been measured and was not, by name.
    """

    t: np.ndarray
    dt: np.ndarray
    u: np.ndarray
    y: np.ndarray
    seen: np.ndarray
    truth: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)
    inserted: np.ndarray | None = None
    counts: dict[str, int] = dataclasses.field(default_factory=dict)
    missing: dict[str, int] = dataclasses.field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def kept(self) -> np.ndarray:
        """Rows of the record itself, without those that split a long interval."""
        return np.ones(len(self), bool) if self.inserted is None else ~self.inserted


def make_log(
    model: AbstractModel,
    t: Any,
    y: Any,
    u: Any = None,
    *,
    truth: dict[str, Any] | None = None,
    start: float | None = None,
    max_step: float | None = None,
) -> Log:
    """A record from arrays.

    Args:
        model: what the record was taken from.
        t: times [s], never decreasing (T,). Equal times are separate measurements of one moment.
        y: measurements (T, output size) or (T,) for one; NaN where a component was not measured. A quaternion is
            measured as a whole: one NaN makes all of it missing.
        u: inputs (T, inputs) or (T,) for one; row k is held over the interval that ends at `t[k]`.
        truth: reference values by state name, each (T,).
        start: time of the prior [s]; the first row's by default.
        max_step: longest interval predicted in one go [s]; longer ones are split.

    Raises:
        ShapeError: an array whose size does not fit the model or the times.
        DataError: times that decrease or are not finite, text, an infinite measurement, or a missing input.
        ConfigError: a longest step that is not above zero.

    Example:
        >>> from gainful.models import linear_model
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> make_log(model, [0.0, 1.0, 2.0], [0.1, float("nan"), 0.3]).seen[:, 0].tolist()
        [True, False, True]
    """
    times = _column(t, "t")
    rows = len(times)
    if not rows:
        raise DataError("t: expected at least one row, got none")
    _finite_rows(times, "t", times)
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        k = int(back[0]) + 1
        raise DataError(
            f"t: expected times that never decrease, got {times[k]:.9g} s after {times[k - 1]:.9g} s in row {k}"
        )
    y = _table(y, rows, model.output.names, "y")
    u = _table(np.zeros((rows, 0)) if u is None else u, rows, model.inputs, "u")
    for j, name in enumerate(model.output.names):
        _not_infinite(y[:, j], name, times)
    for j, name in enumerate(model.inputs):
        _finite_rows(u[:, j], f"input {name!r}", times)
    y, seen = fill_missing(model, y)
    first = times[0] if start is None else float(start)
    if not first <= times[0]:
        raise DataError(f"start: expected a time not after the first row's {times[0]:.9g} s, got {first:.9g} s")
    unseen = dict(zip(model.output.tangent_names, (~seen).sum(axis=0).tolist(), strict=True))
    log = Log(times, np.diff(times, prepend=first), u, y, seen, _truth(model, truth, rows), missing=unseen)
    return log if max_step is None else split_long_steps(log, max_step)


def _column(values: Any, name: str) -> np.ndarray:
    array = _floats(values, name)
    if array.ndim != 1:
        raise ShapeError(f"{name}: expected one dimension, got shape {array.shape}")
    return array


def _table(values: Any, rows: int, names: tuple[str, ...], name: str) -> np.ndarray:
    columns = [str(column) for column in getattr(values, "columns", ())]
    if columns and sorted(columns) == sorted(names):
        values = values[list(names)]  # a table says itself which column is which
    array = _floats(values, name)
    if array.ndim == 1 and len(names) == 1:
        array = array[:, None]
    if array.shape != (rows, len(names)):
        listed = f" ({', '.join(names)})" if names else ""
        raise ShapeError(f"{name}: expected shape ({rows}, {len(names)}){listed}, got {array.shape}")
    return array


def _floats(values: Any, name: str) -> np.ndarray:
    """Numbers as floats; masked ones are missing."""
    try:
        kind = np.asarray(values).dtype
        if kind.kind in "mM":
            raise DataError(f"{name}: expected seconds, got {kind}; use (t - t[0]) / np.timedelta64(1, 's')")
        if kind.kind == "c":
            raise DataError(f"{name}: expected real numbers, got {kind}")
        if isinstance(values, np.ma.MaskedArray):
            return np.ma.filled(values.astype(float), np.nan)
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as problem:
        if isinstance(problem, DataError):
            raise
        odd = _odd_row(values) or "rows of different lengths"
        raise DataError(f"{name}: expected numbers, got {odd}") from problem


def _odd_row(values: Any) -> str:
    """The first row that holds no numbers, in words."""
    rows = getattr(values, "to_numpy", lambda: values)()
    for k, row in enumerate(rows if isinstance(rows, Iterable) else [rows]):
        try:
            np.asarray(row, dtype=float)
        except (TypeError, ValueError):
            return f"{row.item() if isinstance(row, np.generic) else row!r} in row {k}"
    return ""


def _finite_rows(values: np.ndarray, name: str, times: np.ndarray) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        k = int(bad[0])
        when = "" if name == "t" else f" at t = {times[k]:.9g} s"
        raise DataError(f"{name}: expected finite numbers, got {values[k]} in row {k}{when} ({bad.size} such rows)")


def _not_infinite(values: np.ndarray, name: str, times: np.ndarray) -> None:
    bad = np.flatnonzero(np.isinf(values))
    if bad.size:
        k = int(bad[0])
        raise DataError(
            f"signal {name!r}: expected a finite number, or NaN for missing, got {values[k]} in row {k} "
            f"at t = {times[k]:.9g} s ({bad.size} such rows)"
        )


def fill_missing(model: AbstractModel, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measured points without NaN, and which degrees of freedom were seen."""
    y, seen, i = y.copy(), [], 0
    for part in model.output.parts:
        block = y[:, i : i + part.size]
        known = np.isfinite(block)
        if part.size == part.dof:
            seen.append(known)
            # Any valid number will do; 1 is inside most bounds, and a masked component is cut off anyway.
            block[~known] = 1.0
        else:
            whole = np.asarray(known.all(axis=1))
            seen.append(np.repeat(whole[:, None], part.dof, axis=1))
            block[~whole] = np.eye(part.size)[-1]
            length = np.linalg.norm(block, axis=1)
            off = np.flatnonzero(np.abs(length - 1.0) > 1e-2)
            if off.size:
                k = int(off[0])
                raise DataError(
                    f"signal {part.names[0].removesuffix('_x')!r}: expected a unit quaternion, got one of length "
                    f"{length[k]:.6g} in row {k} ({off.size} such rows)"
                )
            block /= length[:, None]
        i += part.size
    return y, np.concatenate(seen, axis=1)


def _truth(model: AbstractModel, truth: dict[str, Any] | None, rows: int) -> dict[str, np.ndarray]:
    out = {}
    for name, values in (truth or {}).items():
        if name not in model.space.names:
            raise DataError(f"truth: {name!r} is not a state of the model; {did_you_mean(name, model.space.names)}")
        column = _column(values, f"truth {name!r}")
        if len(column) != rows:
            raise ShapeError(f"truth {name!r}: expected {rows} rows, got {len(column)}")
        out[name] = column
    return out


def split_long_steps(log: Log, max_step: float) -> Log:
    """The record with rows inserted, measuring nothing, so that no interval is longer than `max_step` [s]."""
    if not (np.isfinite(max_step) and max_step > 0):
        raise ConfigError(f"max_step: expected a time above 0 s, got {max_step!r}")
    pieces = np.maximum(1, np.ceil(log.dt / max_step - 1e-9).astype(int))
    if pieces.max() == 1:
        return log
    source = np.repeat(np.arange(len(log)), pieces)
    # Position within its interval, counted from 1; the last piece is the row itself.
    place = np.arange(len(source)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1
    inserted = place < pieces[source]
    dt = (log.dt / pieces)[source]
    t = np.where(inserted, log.t[source] - log.dt[source] * (1 - place / pieces[source]), log.t[source])
    seen = log.seen[source] & ~inserted[:, None]
    truth = {name: np.where(inserted, np.nan, values[source]) for name, values in log.truth.items()}
    counts = log.counts | {"split intervals": int((pieces > 1).sum())}
    return Log(t, dt, log.u[source], log.y[source], seen, truth, inserted, counts, log.missing)
