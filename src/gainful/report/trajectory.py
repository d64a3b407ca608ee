"""The path in the plane, where the states hold one."""

from __future__ import annotations

import re

import numpy as np
import plotly.graph_objects as go
import scipy.special

from ..running import Result
from ..spaces import AbstractSpace, Euclidean
from .panels import BLACK, BLUE, GREY, ORANGE, SHADE, Section, finish
from .series import compact, strided

_ELLIPSES = 25
_MORE = 4
"""A path is drawn once, and may wind more than a line over time: so many times the points."""
_POSITION = re.compile(r"(?:(?:p|r|pos|position|loc|location)_?)?(x|e|east|easting)(_?(?:pos|position|m|\d+))?")
_SECOND = {"x": "y", "e": "n", "east": "north", "easting": "northing"}


def position_pairs(space: AbstractSpace) -> list[tuple[str, str]]:
    """Pairs of plain states in metres named like positions: x and y, e and n, east and north, px and py."""
    plain = [name for part in space.parts if isinstance(part, Euclidean) for name in part.names]
    metres = [name for name in plain if space.units[space.names.index(name)] == "m"]
    pairs = []
    for name in metres:
        found = _POSITION.fullmatch(name.lower())
        if found is None:
            continue
        a, b = found.span(1)
        # Capital names stay capital: E and N, Px and Py.
        second = _SECOND[found[1]].upper() if name[a:b].isupper() else _SECOND[found[1]]
        other = name[:a] + second + name[b:]
        if other in metres:
            pairs.append((name, other))
    return pairs


def trajectory_sections(result: Result, limit: int) -> list[Section]:
    """Estimate, truth and 95 % ellipses of every pair of positions, drawn to scale."""
    return [_trajectory(result, pair, limit) for pair in position_pairs(result.model.space)]


def _trajectory(result: Result, pair: tuple[str, str], limit: int) -> Section:
    kept = np.flatnonzero(result.log.kept)
    limit = _MORE * limit
    rows = kept[strided(len(kept), limit)]
    path = np.stack([result[name] for name in pair], axis=1)
    centre, reach = (path[kept].max(axis=0) + path[kept].min(axis=0)) / 2, np.ptp(path[kept], axis=0)
    reach = np.maximum(1.16 * reach, 0.08 * reach.max()) if reach.max() > 0 else np.ones(2)
    figure = go.Figure()
    finish(figure, 140 + np.clip(900 * reach[1] / reach[0], 280, 520))
    ellipses, dropped = _ellipses(result, pair, path, kept, reach.max() / 2)
    figure.add_trace(ellipses)
    if result.filtered is not None:
        line = np.stack([result.filtered[name][rows] for name in pair], axis=1)
        figure.add_trace(_line(result.t[rows], line, "filtered", {"color": ORANGE, "width": 1, "dash": "dot"}))
    kind = "smoothed estimate" if result.smoothed else "estimate"
    figure.add_trace(_line(result.t[rows], path[rows], kind, {"color": BLUE, "width": 1.8}))
    truth = [result.log.truth.get(name) for name in pair]
    if truth[0] is not None and truth[1] is not None:
        both = np.stack([truth[0], truth[1]], axis=1)[kept]
        known = np.flatnonzero(np.isfinite(both).all(axis=1))
        known = known[strided(len(known), limit)]
        if len(known):
            style = {"color": BLACK, "width": 1.3, "dash": "dash"}
            figure.add_trace(_line(result.t[kept][known], both[known], "truth", style))
    for name, row, symbol in (("start", kept[0], "circle-open"), ("end", kept[-1], "square")):
        marker = {"symbol": symbol, "size": 10, "color": BLUE, "line": {"width": 2, "color": BLUE}}
        figure.add_trace(
            go.Scatter(x=path[[row], 0], y=path[[row], 1], name=name, mode="markers", marker=marker, hoverinfo="name")
        )
    ends = np.stack([centre - reach / 2, centre + reach / 2])
    figure.update_xaxes(title_text=f"{pair[0]} [m]", range=list(ends[:, 0]))
    figure.update_yaxes(title_text=f"{pair[1]} [m]", range=list(ends[:, 1]), scaleanchor="x", scaleratio=1)
    figure.update_layout(hovermode="closest")
    caption = "The path, both axes to the same scale, with 95 % ellipses along it."
    if dropped:
        caption += f" {dropped} of {_ELLIPSES} ellipses are wider than the figure and left out."
    if len(rows) < len(kept):
        caption += f" Thinned from {len(kept):,} rows to {len(rows):,} points, evenly spaced."
    return Section("Trajectory", caption, figure, timed=False)


def _line(t: np.ndarray, path: np.ndarray, name: str, style: dict) -> go.Scatter:
    return go.Scatter(
        x=compact(path[:, 0]),
        y=compact(path[:, 1]),
        customdata=compact(t),
        name=name,
        mode="lines",
        line=style,
        hovertemplate="%{x:.6g}, %{y:.6g}<br>t = %{customdata:.6g} s",
    )


def _ellipses(
    result: Result, pair: tuple[str, str], path: np.ndarray, kept: np.ndarray, widest: float
) -> tuple[go.Scatter, int]:
    """95 % ellipses at equal distances along the path, as one line with gaps, and how many are too wide to draw."""
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[kept], axis=0).T))])
    at = np.searchsorted(travelled, np.linspace(0, travelled[-1], _ELLIPSES))
    rows = kept[np.unique(np.minimum(at, len(kept) - 1))]
    columns = np.array([result.model.space.tangent_names.index(name) for name in pair])
    values, vectors = np.linalg.eigh(result.cov[np.ix_(rows, columns, columns)])
    radius = np.sqrt(scipy.special.chdtri(2, 0.05))
    drawn = radius * np.sqrt(np.maximum(values[:, 1], 0.0)) <= widest
    rows, values, vectors = rows[drawn], values[drawn], vectors[drawn]
    angle = np.append(np.linspace(0, 2 * np.pi, 37), np.nan)
    circle = radius * np.stack([np.cos(angle), np.sin(angle)])
    rings = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :] @ circle + path[rows][:, :, None]
    outline = rings.transpose(0, 2, 1).reshape(-1, 2)
    shape = go.Scatter(
        x=compact(outline[:, 0]),
        y=compact(outline[:, 1]),
        name="95 % ellipses",
        mode="lines",
        line={"color": GREY, "width": 1},
        fill="toself",
        fillcolor=SHADE,
        hoverinfo="skip",
    )
    return shape, int((~drawn).sum())
