"""Tables from files."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import DataError, MissingExtraError, did_you_mean
from .units import convert

_CSV = (".csv", ".csv.gz", ".txt", ".txt.gz", ".tsv", ".tsv.gz")
_PARQUET = (".parquet", ".pq")


@dataclasses.dataclass(frozen=True)
class Table:
    """A file's columns, numbers checked when a column is asked for.

    Attributes:
        path: of the file, for messages.
        frame: a pandas table.
    """

    path: Path
    frame: Any

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return [str(name) for name in self.frame.columns]

    def _values(self, column: str) -> Any:
        if column not in self.columns:
            raise DataError(f"{self.path.name}: no column {column!r}; {did_you_mean(column, self.columns)}")
        return self.frame[column]

    def numbers(self, column: str) -> np.ndarray:
        """A column as floats; empty cells are NaN, dates are seconds since 1970."""
        import pandas as pd

        values = self._values(column)
        if _is_time(values):
            return _seconds(values)
        try:
            return values.to_numpy(dtype=float, na_value=np.nan)
        except (TypeError, ValueError):
            parsed = cast("Any", pd.to_numeric(values, errors="coerce"))
            text = values.astype(str).str.strip()
            bad = np.flatnonzero(parsed.isna().to_numpy() & values.notna().to_numpy() & (text != "").to_numpy())
            if not bad.size:
                return parsed.to_numpy(dtype=float)
            k = int(bad[0])
            raise DataError(
                f"{self.path.name}: column {column!r} expected numbers, got {values.iloc[k]!r} in {self.row(k)} "
                f"({bad.size} such cells); empty cells count as missing"
            ) from None

    def times(self, column: str, unit: str) -> np.ndarray:
        """A column of times in seconds; dates, also written out (ISO 8601, UTC), count from 1970."""
        import pandas as pd

        values = self._values(column)
        if _is_time(values):
            return _seconds(values)
        if not pd.api.types.is_numeric_dtype(values):
            dates = pd.to_datetime(values, errors="coerce", utc=True, format="ISO8601")
            if dates.notna().any() and (dates.notna() | values.isna()).all():
                return _seconds(dates)
        return convert(self.numbers(column), unit, "s", "time")

    def row(self, k: int) -> str:
        """What a message calls row `k` of the table: its place in the file."""
        return f"data row {self.frame.index[k]} (counted from 0)"

    def where(self, conditions: dict[str, Any]) -> Table:
        """The rows in which each named column equals its value."""
        keep = np.ones(len(self.frame), bool)
        for column, value in conditions.items():
            keep &= (self._values(column) == value).to_numpy(dtype=bool, na_value=False)
        return Table(self.path, self.frame[keep])


def _is_time(values: Any) -> bool:
    import pandas as pd

    return pd.api.types.is_datetime64_any_dtype(values) or pd.api.types.is_timedelta64_dtype(values)


def _seconds(values: Any) -> np.ndarray:
    """Dates as seconds since 1970 (UTC) and durations as seconds; missing ones are NaN."""
    plain = values.dt.tz_convert("UTC").dt.tz_localize(None) if getattr(values.dt, "tz", None) else values
    array = plain.to_numpy()
    kind = "datetime64[ns]" if array.dtype.kind == "M" else "timedelta64[ns]"
    return np.where(np.isnat(array), np.nan, array.astype(kind).astype("int64") / 1e9)


def read_table(path: Path) -> Table:
    """A CSV file (also gzip) or a Parquet file, by its ending.

    Raises:
        DataError: no such file, no permission, an unknown ending, no rows, or not readable as what its ending says.
    """
    try:
        import pandas as pd
    except ImportError as problem:
        raise MissingExtraError("reading files needs pandas: pip install 'gainful[io]'") from problem
    path = Path(path)
    name = path.name.lower()
    try:
        if not path.exists():
            beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
            hint = did_you_mean(path.name, beside) if path.parent.is_dir() else f"there is no folder {path.parent}"
            raise DataError(f"data file {path}: not found; {hint}")
        if name.endswith(_CSV):
            frame = _read_text(path, "\t" if ".tsv" in name else ",")
        elif name.endswith(_PARQUET):
            frame = pd.read_parquet(path)
        else:
            raise DataError(f"data file {path.name}: expected one of {', '.join(_CSV + _PARQUET)}, got {path.suffix!r}")
    except PermissionError as problem:
        raise DataError(f"data file {path}: no permission to read it") from problem
    except DataError:
        raise
    except pd.errors.EmptyDataError as problem:
        raise DataError(f"data file {path.name}: expected a header and rows, got an empty file") from problem
    except Exception as problem:  # parsers raise whatever they like on a broken file
        raise DataError(
            f"data file {path.name}: cannot be read: {(str(problem) or repr(problem)).splitlines()[0]}"
        ) from problem
    if not len(frame):
        raise DataError(f"data file {path.name}: expected at least one row under the header, got none")
    if not isinstance(frame.index, pd.RangeIndex):
        frame = frame.reset_index()
    frame.columns = [str(column).strip() for column in frame.columns]
    _no_column_twice(list(frame.columns), path)
    return Table(path, frame.reset_index(drop=True))


def _read_text(path: Path, separator: str) -> Any:
    import pandas as pd

    options: dict[str, Any] = {"sep": separator, "skipinitialspace": True}
    # pandas renames a second column of the same name, so that nobody would notice: look at the header itself.
    header = pd.read_csv(path, header=None, nrows=1, dtype=str, **options).iloc[0].dropna()
    names = [str(name).strip() for name in header]
    _no_column_twice(names, path)
    if len(names) == 1 and (other := next((mark for mark in ";\t|," if mark in names[0]), "")):
        raise DataError(f"data file {path.name}: expected {separator!r} between columns, got {other!r} in {names[0]!r}")
    with warnings.catch_warnings():
        # Rows longer than the header would lose cells, or shift every column by one.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            return pd.read_csv(path, low_memory=False, index_col=False, **options)
        except pd.errors.ParserWarning as problem:
            raise DataError(f"data file {path.name}: expected {len(names)} cells in every row, got more") from problem


def _no_column_twice(names: list[str], path: Path) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise DataError(f"data file {path.name}: column {twice[0]!r} appears twice")
