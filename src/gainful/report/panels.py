"""How every figure looks: colours, panels one above the other, bands."""

from __future__ import annotations

import dataclasses
import html
import itertools
from typing import Any, cast

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from .series import compact

# Okabe and Ito (2008), told apart with every kind of colour vision; lines differ in style as well.
BLUE, SKY, ORANGE, VERMILLION, BLACK = "#0072B2", "#56B4E9", "#E69F00", "#D55E00", "#1a1a1a"
GREEN, PURPLE = "#009E73", "#CC79A7"
GREY, GRID, INK = "#6b7280", "#e8eaed", "#374151"
SHADE = "rgba(0,114,178,0.16)"
PALE = "rgba(107,114,128,0.14)"

FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif'

MOST_PANELS = 5
"""Panels in one figure, so that it fits on a printed page."""

_HEIGHTS = {1: 280, 2: 205, 3: 175, 4: 145, 5: 114}  # px per panel
_LABEL, _TOP, _BOTTOM, _LEFT = 38, 40, 78, 52  # px
_FEW = 60  # points, below which they are marked
_SWINGS = 100  # turns, up to which a line is dashed whatever it does


@dataclasses.dataclass(frozen=True)
class Section:
    """One figure with its words.

    Attributes:
        title: heading; neighbours with the same title share it.
        caption: what is to be seen, one or two sentences.
        figure: the plotly figure.
        timed: whether its horizontal axes are the record's time.
    """

    title: str
    caption: str
    figure: go.Figure
    timed: bool = True


def grouped(count: int) -> list[range]:
    """Panels shared out evenly over as few figures as hold them."""
    figures = -(-count // MOST_PANELS)
    ends = [round(k * count / max(figures, 1)) for k in range(figures + 1)]
    return [range(a, b) for a, b in itertools.pairwise(ends)]


def label(name: str, unit: str, *notes: str) -> str:
    """A panel's heading: name [unit] and what follows."""
    head = f"<b>{html.escape(name)}</b>" + ("" if unit == "1" else f" [{html.escape(unit)}]")
    return "  ·  ".join([head, *notes])


def panels(labels: list[str], ends: tuple[float, float] | None = None) -> go.Figure:
    """An empty figure with one panel per label over a common time axis.

    Args:
        labels: headings of the panels.
        ends: of the time axis [s]; automatic, and not of time, if None.
    """
    count = len(labels)
    inner = count * _HEIGHTS[count] + (count - 1) * _LABEL
    figure = make_subplots(
        rows=count,
        cols=1,
        shared_xaxes=True,
        vertical_spacing=_LABEL / inner if count > 1 else 0,
        subplot_titles=labels,
    )
    figure.update_annotations(x=0, xanchor="left", xshift=-_LEFT, yshift=2, font={"size": 13, "color": BLACK})
    finish(figure, inner + _TOP + _BOTTOM)
    if ends is not None:
        room = 0.01 * (ends[1] - ends[0]) or 0.5
        figure.update_xaxes(range=[ends[0] - room, ends[1] + room], exponentformat="none", separatethousands=True)
        figure.update_xaxes(hoverformat=f".{_digits(ends)}~g")
        figure.update_xaxes(title_text="time [s]", row=count, col=1)
        figure.update_layout(hovermode="x unified")
    return figure


def _digits(ends: tuple[float, float]) -> int:
    """Digits that tell times apart, ten-thousandth of the record by ten-thousandth."""
    largest, span = max(abs(ends[0]), abs(ends[1])), ends[1] - ends[0]
    return int(np.clip(5 + np.ceil(np.log10(largest / span)), 5, 15)) if span > 0 else 9


def set_range(figure: go.Figure, panel: int, low: float, high: float, *, zero: bool = False) -> None:
    """Ends of a panel's vertical axis, with a line at zero on demand; powers of ten for extreme spans."""
    plain = bool(5e-4 <= high - low < 1e6)
    figure.update_yaxes(
        range=[low, high],
        exponentformat="none" if plain else "power",
        separatethousands=plain,
        zeroline=zero,
        zerolinecolor="#b6bac2",
        row=panel,
        col=1,
    )


def finish(figure: go.Figure, height: float) -> None:
    """Size, type, grid and legend, the same for all figures."""
    axis = {
        "showgrid": True,
        "gridcolor": GRID,
        "zeroline": False,
        "linecolor": "#b6bac2",
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#b6bac2",
        "exponentformat": "power",
        "title_standoff": 8,
    }
    figure.update_xaxes(**axis, showline=True)
    figure.update_yaxes(**axis, automargin=True, nticks=6)
    figure.update_layout(
        template="none",
        height=round(height),
        margin={"l": _LEFT, "r": 14, "t": _TOP, "b": _BOTTOM},
        font={"family": FONT, "size": 12, "color": INK},
        paper_bgcolor="white",
        plot_bgcolor="white",
        hoverlabel={"bgcolor": "white", "bordercolor": "#c9ccd2", "font": {"size": 12, "color": BLACK}},
        legend={
            "orientation": "h",
            "x": 0,
            "xanchor": "left",
            "y": -44 / (height - _TOP - _BOTTOM),
            "yanchor": "top",
            "traceorder": "normal",
            "font": {"size": 12},
        },
        modebar={"orientation": "h", "bgcolor": "rgba(0,0,0,0)", "color": "#a3a8b0", "activecolor": BLUE},
    )


def add_line(
    figure: go.Figure,
    panel: int,
    t: np.ndarray,
    y: np.ndarray,
    name: str,
    *,
    color: str,
    width: float,
    dash: str = "solid",
    between: tuple[np.ndarray, np.ndarray] | None = None,
    marked: bool = True,
) -> None:
    """A line in a panel, counted from 1; equal names share one entry in the legend.

    `between` are two ends told with the value on hovering; short lines have their points marked, if `marked`.
    """
    trace = go.Scatter(
        x=compact(t),
        y=compact(y),
        name=name,
        legendgroup=name,
        showlegend=first_of(figure, name),
        mode="lines+markers" if marked and len(t) <= _FEW else "lines",
        marker={"size": 4},
        line={"color": color, "width": width, "dash": dash},
        customdata=None if between is None else compact(np.stack(between, axis=1)),
        hovertemplate="%{y:.5g}" + ("" if between is None else "  (%{customdata[0]:.5g} … %{customdata[1]:.5g})"),
    )
    figure.add_trace(trace, row=panel, col=1)


def add_band(
    figure: go.Figure,
    panel: int,
    t: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    name: str,
    *,
    fill: str = SHADE,
    edge: str | None = None,
) -> None:
    """A shaded band between two lines, interrupted where they are NaN; with dashed edges if `edge` is a colour.

    Edges that swing to and fro all the time are thin and solid: dashes would be a haze.
    """
    x, y = _outline(t, lower, upper)
    shape = go.Scatter(
        x=compact(x),
        y=compact(y),
        name=name,
        legendgroup=name,
        showlegend=first_of(figure, name),
        mode="lines",
        line={"width": 0 if edge is None else 0.5, "color": "rgba(0,0,0,0)"},
        fill="toself",
        fillcolor=fill,
        hoverinfo="skip",
    )
    figure.add_trace(shape, row=panel, col=1)
    for side, values in () if edge is None else (("upper", upper), ("lower", lower)):
        line = go.Scatter(
            x=compact(t),
            y=compact(values),
            name=f"{side} bound",
            legendgroup=name,
            showlegend=False,
            mode="lines",
            line={"width": 0.5, "color": edge} if _swings(values) else {"width": 1, "color": edge, "dash": "dash"},
            hovertemplate="%{y:.5g}",
        )
        figure.add_trace(line, row=panel, col=1)


def _swings(values: np.ndarray) -> bool:
    """Whether a line turns around at every third point or so, more often than dashes can show."""
    steps = np.diff(values[np.isfinite(values)])
    turns = np.count_nonzero(steps[1:] * steps[:-1] < 0)
    return bool(turns > max(_SWINGS, 0.3 * len(steps)))


def add_marks(figure: go.Figure, panel: int, times: np.ndarray, ends: tuple[float, float], name: str) -> None:
    """An upright line across a panel, counted from 1, at each time."""
    gap = np.full(len(times), np.nan)
    trace = go.Scatter(
        x=np.stack([times, times, times], axis=1).ravel(),
        y=np.stack([np.full(len(times), ends[0]), np.full(len(times), ends[1]), gap], axis=1).ravel(),
        name=name,
        legendgroup=name,
        showlegend=first_of(figure, name),
        mode="lines",
        line={"color": VERMILLION, "width": 1.2, "dash": "dot"},
        hovertemplate="%{x}",
    )
    figure.add_trace(trace, row=panel, col=1)


def _outline(t: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One closed line around each stretch of a band, NaN in between."""
    # Filling to the next line, which plotly offers as well, goes astray where lines are interrupted.
    x, y = [], []
    for rows in np.split(np.arange(len(t)), np.flatnonzero(np.isnan(lower))):
        rows = rows[np.isfinite(lower[rows])]
        x += [t[rows], t[rows][::-1], [np.nan]]
        y += [lower[rows], upper[rows][::-1], [np.nan]]
    return np.concatenate(x[:-1]), np.concatenate(y[:-1])


def add_points(
    figure: go.Figure,
    panel: int,
    t: np.ndarray,
    y: np.ndarray,
    name: str,
    marker: dict[str, Any],
    shown: np.ndarray | None = None,
) -> None:
    """Points in a panel; `shown` are the values told on hovering, where points are not drawn at their own."""
    trace = go.Scatter(
        x=compact(t),
        y=compact(y),
        name=name,
        legendgroup=name,
        showlegend=first_of(figure, name),
        mode="markers",
        marker=marker,
        customdata=None if shown is None else compact(shown),
        hovertemplate="%{y:.5g}" if shown is None else "%{customdata:.5g}",
    )
    figure.add_trace(trace, row=panel, col=1)


def first_of(figure: go.Figure, name: str) -> bool:
    """Whether a name is not in the figure's legend yet."""
    return all(trace.legendgroup != name for trace in cast("Any", figure.data))
