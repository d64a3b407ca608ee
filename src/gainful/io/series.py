"""One signal's times and values, cleaned."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from ..errors import ConfigError, DataError
from .source import Column, Source
from .tables import Table, read_table
from .units import convert


@dataclasses.dataclass(frozen=True)
class Series:
    """A signal over time.

    Attributes:
        t: times [s], never decreasing (N,).
        values: one row per time, NaN where missing (N, width).
        sorted_rows: rows that came late.
    """

    t: np.ndarray
    values: np.ndarray
    sorted_rows: int = 0


class Reader:
    """Reads each file once and finds signals in it.

    Args:
        source: of the record.
        base: folder that its folder is relative to.
        row_step: time between rows of files that have no time column [s].
    """

    def __init__(self, source: Source, base: Path, row_step: float | None = None) -> None:
        self._source = source
        self._row_step = row_step
        self._folder = (base / source.folder).resolve() if source.folder else base
        self._tables: dict[str, Table] = {}

    @property
    def files(self) -> list[str]:
        """Names of the files read so far."""
        return sorted(self._tables)

    def _table(self, name: str, signal: str) -> Table:
        name = name or self._source.file
        if not name:
            raise ConfigError(f"signal {signal!r}: no file given, neither its own nor the record's")
        if name not in self._tables:
            table = read_table(self._folder / name)
            for frame in self._source.local:
                if name in (frame.files or [self._source.file]):
                    from .geodesy import add_local_columns

                    table = add_local_columns(table, frame)
            self._tables[name] = table
        return self._tables[name]

    def series(self, name: str, where: Column, units: tuple[str, ...]) -> Series:
        """The signal `name` in the given units, one per column."""
        columns = [where.column] if isinstance(where.column, str) else list(where.column)
        if len(columns) != len(units):
            raise ConfigError(f"signal {name!r}: expected {_columns(len(units))}, got {columns}")
        table = self._table(where.file, name)
        if where.where:
            whole, table = table, table.where(where.where)
            if not len(table.frame):
                raise DataError(f"signal {name!r}: no row of {table.path.name} has {_listed(where.where, whole)}")
        time = where.time or self._source.time
        if time or self._row_step is None:
            t = table.times(time, self._source.time_unit)
        else:
            t = self._row_step * table.frame.index.to_numpy(float)
        self._check_times(t, table, name)
        values = np.stack([table.numbers(column) for column in columns], axis=1)
        for marker in where.missing:
            values[values == marker] = np.nan
        if np.isinf(values).any():
            k, j = np.argwhere(np.isinf(values))[0]
            raise DataError(
                f"signal {name!r}: expected a finite number or an empty cell, got {values[k, j]} in column "
                f"{columns[j]!r} of {table.path.name} in {table.row(int(k))} at t = {t[k]:.9g} s"
            )
        if not np.isfinite(values).any():
            raise DataError(f"signal {name!r}: column {columns[0]!r} of {table.path.name} holds no number at all")
        values = np.stack(
            [_in_unit(v * where.scale, where, unit, name) for v, unit in zip(values.T, units, strict=True)], axis=1
        )
        order = np.argsort(t, kind="stable")
        late = int(np.count_nonzero(np.diff(t) < 0))
        t, values = t[order], values[order]
        if where.increment:
            t, values = _rates(t, values, name)
        return Series(t, values, late)

    def _check_times(self, t: np.ndarray, table: Table, name: str) -> None:
        bad = np.flatnonzero(~np.isfinite(t))
        if bad.size:
            raise DataError(f"{table.path.name}: expected a time in every row, got none in {table.row(int(bad[0]))}")
        back = np.flatnonzero(np.diff(t) < 0)
        if back.size and self._source.late == "refuse":
            k = int(back[0]) + 1
            raise DataError(
                f"{table.path.name}: time goes back from {t[k - 1]:.9g} s to {t[k]:.9g} s in {table.row(k)} of signal "
                f'{name!r} ({back.size} such rows); late = "sort" sorts them'
            )


def _rates(t: np.ndarray, values: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Changes as rates over the time since the last row that has one; empty cells belong to other signals' rows."""
    present = np.isfinite(values).all(axis=1)
    t, values = t[present], values[present]
    steps = np.diff(t)
    if not steps.size:
        raise DataError(f"signal {name!r}: an increment needs at least two rows, got {len(t)}")
    if (steps <= 0).any():
        twice = t[1:][steps <= 0][0]
        raise DataError(f"signal {name!r}: an increment needs times that increase, got t = {twice:.9g} s twice")
    return t[1:], values[1:] / steps[:, None]


def _in_unit(values: np.ndarray, where: Column, unit: str, name: str) -> np.ndarray:
    """A column in the model's unit; an increment is in that unit times seconds until it is divided by its time."""
    if not where.unit:
        return values
    return convert(values, where.unit, f"({unit}) * s" if where.increment else unit, name)


def merge_duplicates(series: Series, name: str, how: str) -> Series:
    """The signal with several values at one time reduced, kept or refused; a missing one beside another is none."""
    series = _without_idle_rows(series)
    same = np.flatnonzero(np.diff(series.t) == 0)
    if not same.size or how == "keep":
        return series
    if how == "refuse":
        k = int(same[0]) + 1
        raise DataError(
            f"signal {name!r}: two values at t = {series.t[k]:.9g} s ({series.values[k - 1, 0]:.6g} and "
            f'{series.values[k, 0]:.6g}; {same.size} such rows); duplicates = "keep" takes both as measurements, '
            '"first" or "last" one'
        )
    changes = np.diff(series.t) > 0
    pick = np.append(True, changes) if how == "first" else np.append(changes, True)
    return Series(series.t[pick], series.values[pick], series.sorted_rows)


def _without_idle_rows(series: Series) -> Series:
    """The signal without missing values at times at which it has another value: that row was another signal's."""
    present = np.isfinite(series.values).any(axis=1)
    _, moment = np.unique(series.t, return_inverse=True)
    known = np.bincount(moment, weights=present)[moment] > 0
    # Where nothing is known, the first row of each time stands for all of them.
    keep = np.where(known, present, np.append(True, np.diff(series.t) > 0))
    return Series(series.t[keep], series.values[keep], series.sorted_rows)


def _columns(count: int) -> str:
    return "one column" if count == 1 else f"{count} columns"


def _listed(where: dict[str, object], whole: Table) -> str:
    asked = ", ".join(f"{column} = {value!r}" for column, value in where.items())
    if len(where) > 1:
        return f"{asked} at once"
    found = whole.frame[next(iter(where))].dropna().unique().tolist()
    return f"{asked}; it has {', '.join(map(repr, found[:6]))}{', ...' if len(found) > 6 else ''}"
