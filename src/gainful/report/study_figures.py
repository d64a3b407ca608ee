"""A study's figures drawn: the same name in the same colour and stroke throughout."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ..studies import Band, Chart, Figure, Line, Measured
from .panels import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Section,
    add_band,
    add_line,
    finish,
    grouped,
    label,
    panels,
)
from .series import POINTS, extremes

_COLORS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, GREY)
_DASHES = ("solid", "dash", "dot", "dashdot", "longdash")
_REFERENCES = ("dash", "dot", "longdash", "dashdot")
_MOST_ROWS = 12  # of a legend, beyond the first
_ROW, _AROUND = 30, 92  # px per bar, and for what is above and below
_WIDEST = 24  # letters of a bar's name in a row

Stroke = tuple[str, str]
"""Colour and dash."""


def study_sections(figures: Sequence[Figure | Chart], *, among: Sequence[Figure | Chart] = ()) -> list[Section]:
    """The figures of a study as the page wants them.

    Args:
        figures: to be drawn.
        among: all figures of the study, if these are some of them: a name then looks as it does in the whole.
    """
    strokes = _strokes(among or figures)
    out: list[Section] = []
    for figure in figures:
        if isinstance(figure, Chart):
            out.append(Section(figure.title, figure.caption, _chart(figure, strokes), timed=False))
            continue
        for k, rows in enumerate(grouped(len(figure.panels))):
            caption = "Continued." if k else figure.caption
            drawn = _figure(figure, rows, strokes)
            out.append(Section(figure.title, caption, drawn, timed=not figure.x_label))
    return out


def _strokes(figures: Sequence[Figure | Chart]) -> dict[str, Stroke]:
    """A look for every name, by the order in which names appear: colours first, then dashes."""
    # Five dashes and seven colours have no common divisor: 35 names look different.
    plain, references = (
        zip(itertools.cycle(_COLORS), itertools.cycle(_DASHES), strict=False),
        itertools.cycle(_REFERENCES),
    )
    strokes: dict[str, Stroke] = {}
    for figure in figures:
        marks = [] if isinstance(figure, Chart) else [mark for panel in figure.panels for mark in panel.marks]
        for mark in marks:
            if isinstance(mark, Line) and mark.reference and mark.name not in strokes:
                strokes[mark.name] = (BLACK, next(references))
        names = figure.bars if isinstance(figure, Chart) else [mark.name for mark in marks]
        for name in names:
            if name not in strokes:
                strokes[name] = next(plain)
    return strokes


def _figure(figure: Figure, rows: range, strokes: Mapping[str, Stroke]) -> go.Figure:
    chosen = [figure.panels[row] for row in rows]
    x = np.concatenate([np.asarray(mark.x, float) for panel in chosen for mark in panel.marks])
    x = x[np.isfinite(x)]
    timed = not figure.x_label
    ends = (float(x.min()), float(x.max())) if timed and len(x) else None
    drawn = panels([label(panel.label, panel.unit) for panel in chosen], ends)
    for row, panel in enumerate(chosen, start=1):
        for mark in panel.marks:
            _draw(drawn, row, mark, strokes[mark.name], log=panel.log)
        if panel.log:
            drawn.update_yaxes(**_log_axis(itertools.chain(*map(_heights, panel.marks))), row=row, col=1)
    if not timed:
        drawn.update_xaxes(title_text=figure.x_label, row=len(chosen), col=1)
        drawn.update_layout(hovermode="closest")
    if figure.x_log:
        drawn.update_xaxes(**_log_axis(x))
    names = {mark.name if isinstance(mark, Line) else _band_name(mark) for panel in chosen for mark in panel.marks}
    _room_for_legend(drawn, names)
    return drawn


def _draw(figure: go.Figure, row: int, mark: Line | Band, stroke: Stroke, *, log: bool) -> None:
    color, dash = stroke
    if isinstance(mark, Band):
        x, low, high = _thinned(mark.x, mark.low, mark.high, log=log)
        if len(x) and np.isfinite(low).any():
            add_band(figure, row, x, low, high, _band_name(mark), fill=_pale(color))
        return
    x, y = _thinned(mark.x, mark.y, log=log)
    width = 1.4 if mark.reference else 1.8
    add_line(figure, row, x, y, mark.name, color=color, width=width, dash=dash, marked=not mark.reference)


def _heights(mark: Line | Band) -> np.ndarray:
    return np.asarray(mark.y if isinstance(mark, Line) else mark.high, float)


def _band_name(band: Band) -> str:
    return f"{band.name}, {band.what}"


def _thinned(x: np.ndarray, *lines: np.ndarray, log: bool) -> list[np.ndarray]:
    """The lines with few enough points, NaN together and, on a logarithmic axis, where they are not above zero."""
    given = [np.asarray(line, float) for line in lines]
    known = np.isfinite(np.stack([np.asarray(x, float), *given])).all(axis=0)
    if log:
        known &= (np.stack(given) > 0).all(axis=0)
    given = [np.where(known, line, np.nan) for line in given]
    rows = extremes(given, POINTS) if len(given[0]) else np.arange(0)
    return [np.asarray(x, float)[rows], *(line[rows] for line in given)]


def _pale(color: str) -> str:
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.16)"


def _room_for_legend(figure: go.Figure, names: set[str]) -> None:
    """Height for a legend of several rows, as many as a phone needs, so that it does not press on the panels."""
    # On a phone all columns are as wide as the longest name, in letters of about 6.5 px on 330 px.
    columns = max(1, 50 // (max(map(len, names)) + 7))
    more = 19 * min(math.ceil(len(names) / columns) - 1, _MOST_ROWS)
    margin, height = figure.layout.margin, figure.layout.height  # type: ignore[attr-defined]  # plotly's own
    figure.update_layout(height=height + more, margin_b=margin.b + more)


def _chart(chart: Chart, strokes: Mapping[str, Stroke]) -> go.Figure:
    figure = go.Figure()
    finish(figure, _AROUND + _ROW * len(chart.bars))
    names = {name: "<br>".join(textwrap.wrap(name, _WIDEST)) for name in chart.bars}
    shown = {name: found for name, found in chart.bars.items() if _drawable(found, log=chart.log)}
    colors = [strokes[name][0] for name in shown]
    ends = [_interval(found) for found in shown.values()]
    error = {
        "type": "data",
        "symmetric": False,
        "array": [high - found.value for (_, high), found in zip(ends, shown.values(), strict=True)],
        "arrayminus": [found.value - low for (low, _), found in zip(ends, shown.values(), strict=True)],
        "color": BLACK,
        "thickness": 1.4,
        "width": 4,
    }
    common = {
        "x": [found.value for found in shown.values()],
        "y": [names[name] for name in shown],
        "error_x": error,
        "customdata": [found.number for found in shown.values()],
        "hovertemplate": "%{customdata}<extra></extra>",
        "showlegend": False,
    }
    if chart.log:
        # A bar has no foot on a logarithmic axis.
        figure.add_trace(go.Scatter(mode="markers", marker={"size": 10, "color": colors}, **common))
        figure.update_xaxes(**_log_axis(itertools.chain(*ends)))
    else:
        figure.add_trace(go.Bar(orientation="h", marker={"color": colors}, width=0.62, **common))
        figure.update_xaxes(zeroline=True, zerolinecolor="#b6bac2")
    for name, found in chart.bars.items():
        if name not in shown:
            figure.add_annotation(
                x=0, xref="paper", xanchor="left", y=names[name], text=found.number, showarrow=False, xshift=6
            )
    unit = "" if chart.unit == "1" else f" [{chart.unit}]"
    figure.update_xaxes(title_text=chart.label + unit, nticks=5)
    order = list(names.values())
    figure.update_yaxes(
        categoryorder="array",
        categoryarray=order[::-1],
        range=[-0.6, len(order) - 0.4],
        showgrid=False,
        ticks="",
        tickmode="linear",
        dtick=1,
    )
    figure.update_layout(hovermode="closest", margin={"t": 34, "b": 58})
    return figure


def _log_axis(values: Iterable[float]) -> dict[str, Any]:
    """Ticks that a phone has room for: all digits within a factor of five, 1, 2, 5 within two decades, else decades."""
    above = [value for value in values if math.isfinite(value) and value > 0]
    decades = math.log10(max(above) / min(above)) if above else 0.0
    if decades < 2:
        return {"type": "log", "dtick": "D2" if decades > 0.7 else "D1", "tickformat": ".6~g"}
    return {"type": "log", "dtick": math.ceil(decades / 6), "exponentformat": "power"}


def _drawable(found: Measured, *, log: bool) -> bool:
    return math.isfinite(found.value) and (not log or found.value > 0)


def _interval(found: Measured) -> tuple[float, float]:
    """Ends of the error bar: none where the runs were too few."""
    finite = math.isfinite(found.low) and math.isfinite(found.high)
    return (found.low, found.high) if finite else (found.value, found.value)
