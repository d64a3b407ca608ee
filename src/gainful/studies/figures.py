"""Figures and tables as data: what a study wants shown, and nothing of how it is drawn."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ..errors import ConfigError, ShapeError
from .statistics import Measured


@dataclasses.dataclass(frozen=True)
class Line:
    """A line in a panel; NaN interrupts it. Equal names look alike in all figures of a study.

    Attributes:
        name: in the legend.
        x: where (T,).
        y: how much (T,).
        reference: drawn as what the others are compared with: truth, a threshold, a published curve.
    """

    name: str
    x: Float[np.ndarray, "T"]
    y: Float[np.ndarray, "T"]
    reference: bool = False

    def __post_init__(self) -> None:
        _same_length(self.name, self.x, y=self.y)


@dataclasses.dataclass(frozen=True)
class Band:
    """A band in a panel, of the line of the same name: an interval, or the spread of runs; NaN interrupts it.

    Attributes:
        name: of its line.
        x: where (T,).
        low: lower end (T,).
        high: upper end (T,).
        what: it shows, such as "95 % interval".
    """

    name: str
    x: Float[np.ndarray, "T"]
    low: Float[np.ndarray, "T"]
    high: Float[np.ndarray, "T"]
    what: str

    def __post_init__(self) -> None:
        _same_length(self.name, self.x, low=self.low, high=self.high)


@dataclasses.dataclass(frozen=True)
class Panel:
    """One coordinate system.

    Attributes:
        label: what is shown.
        marks: lines and bands, drawn in this order.
        unit: of the vertical axis, "1" for none.
        log: whether that axis is logarithmic; what is not above zero is left out then.
    """

    label: str
    marks: tuple[Line | Band, ...]
    unit: str = "1"
    log: bool = False


@dataclasses.dataclass(frozen=True)
class Figure:
    """Panels one above the other over a common horizontal axis.

    Attributes:
        title: heading; neighbours with the same title share it.
        caption: what is to be seen, one or two sentences.
        panels: from top to bottom.
        x_label: of the horizontal axis, if that is not time [s].
        x_log: whether that axis is logarithmic.
        telling: whether it stands for the study in the gallery of all studies; one or two of a study should.
    """

    title: str
    caption: str
    panels: tuple[Panel, ...]
    x_label: str = ""
    x_log: bool = False
    telling: bool = False

    def __post_init__(self) -> None:
        if not self.panels or not all(panel.marks for panel in self.panels):
            raise ConfigError(f"figure {self.title!r}: expected at least one panel, and in each a line or a band")


@dataclasses.dataclass(frozen=True)
class Chart:
    """Numbers with their intervals, one below the other.

    Attributes:
        title: heading; neighbours with the same title share it.
        caption: what is to be seen, one or two sentences.
        label: what the numbers are.
        bars: the numbers by name.
        unit: of the numbers, "1" for none.
        log: whether their axis is logarithmic.
        telling: whether it stands for the study in the gallery of all studies; one or two of a study should.
    """

    title: str
    caption: str
    label: str
    bars: Mapping[str, Measured]
    unit: str = "1"
    log: bool = False
    telling: bool = False

    def __post_init__(self) -> None:
        if not self.bars:
            raise ConfigError(f"chart {self.title!r}: expected at least one number, got none")


@dataclasses.dataclass(frozen=True)
class Table:
    """A table; a `Measured` cell shows its number and interval, its unit belongs in the heading.

    Attributes:
        title: what it shows.
        columns: headings.
        rows: cells (text, numbers, `Measured` or None), the first of each row naming it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ShapeError(
                    f"table {self.title!r}: expected {len(self.columns)} cells in each row, got {len(row)}"
                )


def curve(name: str, x: Float[np.ndarray, "n"], found: Sequence[Measured]) -> tuple[Band | Line, ...]:
    """Numbers along an axis with their intervals."""
    known = [each if np.isfinite(each.low) else Measured(each.value, each.value, each.value, 1) for each in found]
    ends = [np.array([getattr(each, end) for each in known]) for end in ("low", "high")]
    return Band(name, x, ends[0], ends[1], "95 % interval"), Line(name, x, np.array([each.value for each in known]))


def heading(title: str, unit: str) -> str:
    """A column's heading.

    Example:
        >>> heading("RMSE", "N m"), heading("ratio", "1")
        ('RMSE [N m]', 'ratio')
    """
    return title if unit == "1" else f"{title} [{unit}]"


def _same_length(name: str, x: Any, **others: Any) -> None:
    for what, values in others.items():
        if np.ndim(x) != 1 or np.shape(values) != np.shape(x):
            raise ShapeError(
                f"{what} of {name!r}: expected a vector as long as x {np.shape(x)}, got {np.shape(values)}"
            )
