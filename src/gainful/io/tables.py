"""Tables from files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DataError, MissingExtraError, did_you_mean

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

    def numbers(self, column: str) -> np.ndarray:
        """A column as floats; empty cells are NaN."""
        import pandas as pd

        if column not in self.columns:
            raise DataError(f"{self.path.name}: no column {column!r}; {did_you_mean(column, self.columns)}")
        values = self.frame[column]
        if pd.api.types.is_datetime64_any_dtype(values):
            return values.astype("datetime64[ns, UTC]" if values.dt.tz else "datetime64[ns]").astype("int64") / 1e9
        try:
            return values.to_numpy(dtype=float, na_value=np.nan)
        except (TypeError, ValueError):
            parsed = pd.to_numeric(values, errors="coerce")
            text = values.astype(str).str.strip()
            bad = np.flatnonzero(parsed.isna().to_numpy() & values.notna().to_numpy() & (text != "").to_numpy())
            if not bad.size:
                return parsed.to_numpy(dtype=float)
            k = int(bad[0])
            raise DataError(
                f"{self.path.name}: column {column!r} expected numbers, got {values.iloc[k]!r} in data row {k} "
                f"({bad.size} such cells); empty cells count as missing"
            ) from None

    def where(self, conditions: dict[str, Any]) -> Table:
        """The rows in which each named column equals its value."""
        keep = np.ones(len(self.frame), bool)
        for column, value in conditions.items():
            if column not in self.columns:
                raise DataError(f"{self.path.name}: no column {column!r}; {did_you_mean(column, self.columns)}")
            keep &= (self.frame[column] == value).to_numpy()
        return Table(self.path, self.frame[keep])


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
            separator = "\t" if ".tsv" in name else ","
            frame = pd.read_csv(path, sep=separator, skipinitialspace=True, low_memory=False)
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
        raise DataError(f"data file {path.name}: cannot be read: {str(problem).splitlines()[0]}") from problem
    if not len(frame):
        raise DataError(f"data file {path.name}: expected at least one row under the header, got none")
    frame.columns = [str(column).strip() for column in frame.columns]
    twice = sorted({column for column in frame.columns if list(frame.columns).count(column) > 1})
    if twice:
        raise DataError(f"data file {path.name}: column {twice[0]!r} appears twice")
    return Table(path, frame)
