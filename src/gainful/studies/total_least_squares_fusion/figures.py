"""Figures that several chapters show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ..figures import Band, Line
from ..outcome import Outcome

SPREAD = (5.0, 95.0)  # percentiles


def first(name: str, x: Float[np.ndarray, "T"], values: Float[np.ndarray, "n T"]) -> Line:
    """The first run."""
    return Line(name, x, values[0])


def middle(
    name: str, x: Float[np.ndarray, "T"], values: Float[np.ndarray, "n T"], *, band: bool = False
) -> tuple[Band | Line, ...]:
    """The median of the runs, and where nine in ten of them are.

    Args:
        name: of the line.
        x: where.
        values: of all runs.
        band: whether the runs' spread is drawn too.
    """
    line = Line(name, x, np.median(values, axis=0))
    if not band:
        return (line,)
    low, high = np.percentile(values, SPREAD, axis=0)
    return Band(name, x, low, high, "9 of 10 runs"), line


def medians(
    outcome: Outcome,
    experiment: str,
    trace: str,
    names: Sequence[str],
    x: Float[np.ndarray, "T"],
    rows: slice = slice(None),
    *,
    banded: Sequence[str] = (),
    column: int | None = None,
) -> tuple[Band | Line, ...]:
    """Medians of a series of every run, bands first so that no line is covered.

    Args:
        outcome: of the study.
        experiment: by name.
        trace: by name, one that the experiment keeps.
        names: of the contenders.
        x: where, along the rows of the series.
        rows: that are drawn.
        banded: contenders whose spread is drawn too.
        column: of a series of vectors.
    """
    marks = []
    for name in names:
        values = outcome.every(experiment, name, trace)
        values = values if column is None else values[..., column]
        marks += middle(name, x[rows], values[:, rows], band=name in banded)
    return tuple(sorted(marks, key=lambda mark: isinstance(mark, Line)))
