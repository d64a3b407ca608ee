"""Figures that judge a filter by its innovations: residuals, their squares, their correlation in time."""

from __future__ import annotations

import dataclasses
from typing import Any, cast

import numpy as np
import plotly.graph_objects as go
import scipy.special

from ..diagnostics import ljung_box, nees, nis_test
from ..diagnostics.rows import LEAST_WEIGHT, failed_rows
from ..running import Result
from .panels import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    PALE,
    SKY,
    VERMILLION,
    Section,
    add_band,
    add_line,
    add_points,
    first_of,
    grouped,
    label,
    panels,
    set_range,
)
from .series import compact, drawable, scattered
from .states import Z

LAGS = 20
"""Longest lag of the autocorrelation."""

_REFUSED = 0.01
"""Weight below which a component counts as rejected."""


_MARKERS = {
    "used": {"symbol": "circle", "size": 4, "color": BLUE, "opacity": 0.6},
    "less than half": {"symbol": "diamond-open", "size": 7, "color": ORANGE, "line": {"width": 1.4, "color": ORANGE}},
    "rejected": {"symbol": "x-thin", "size": 7, "color": VERMILLION, "line": {"width": 1.6, "color": VERMILLION}},
}


@dataclasses.dataclass(frozen=True)
class Innovations:
    """A filter's innovations on the rows of its record.

    Attributes:
        t: times [s] (T,).
        residual: measured minus expected (T, m).
        cov: their covariances, unit where unseen (T, m, m).
        measured: which components were, in rows that did not fail (T, m).
        weight: how far each counted (T, m).
        names: of the signals.
        units: of the residuals.
    """

    t: np.ndarray
    residual: np.ndarray
    cov: np.ndarray
    measured: np.ndarray
    weight: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def rejected(self) -> np.ndarray:
        """Measured and left out (T, m)."""
        return self.measured & (self.weight < _REFUSED)

    @property
    def doubted(self) -> np.ndarray:
        """Measured and used, but not in full (T, m)."""
        return self.measured & ~self.rejected & (self.weight < 1 - _REFUSED)

    @property
    def counted(self) -> np.ndarray:
        """Measured and used enough to be judged by (T, m)."""
        return self.measured & (self.weight >= LEAST_WEIGHT)

    @property
    def sigma(self) -> np.ndarray:
        """Expected standard deviations (T, m)."""
        return np.sqrt(np.maximum(np.diagonal(self.cov, axis1=1, axis2=2), 0.0))


def innovations_of(result: Result) -> Innovations:
    """The innovations of a result, of the filter where it is smoothed."""
    source, output = result.filtered or result, result.model.output
    kept = source.log.kept
    residual, cov = source.residual[kept], source.residual_cov[kept]
    sound = ~failed_rows(source)[kept] & np.isfinite(cov).all(axis=(1, 2))
    measured = source.seen[kept] & np.isfinite(residual) & sound[:, None]
    names, units = output.tangent_names, output.tangent_units
    return Innovations(source.t[kept], residual, cov, measured, source.weight[kept], names, units)


def innovation_sections(found: Innovations, limit: int) -> list[Section]:
    """Residuals of every signal within ±1.96 expected standard deviations."""
    measured = [j for j in range(len(found.names)) if found.measured[:, j].any()]
    sections = []
    for group in grouped(len(measured)):
        columns = [measured[k] for k in group]
        figure = panels([_innovation_label(found, j) for j in columns], (found.t[0], found.t[-1]))
        cuts = [_draw_innovations(figure, panel, found, j, limit) for panel, j in enumerate(columns, start=1)]
        caption = "Measured minus expected, with the bounds that 95 % should stay within."
        if found.rejected[:, columns].any():
            caption += " Rejected ones are marked."
        if (found.doubted & ~found.counted)[:, columns].any():
            caption += " Diamonds counted less than half."
        if any(cuts):
            caption += " What lies beyond a panel is marked at its edge; point at it for its value."
        sections.append(Section("Innovations", caption, figure))
    return sections


def _innovation_label(found: Innovations, j: int) -> str:
    counted, notes = found.counted[:, j], []
    if counted.any():
        outside = np.mean(np.abs(found.residual[counted, j]) > Z * found.sigma[counted, j])
        notes.append(f"{100 * outside:.1f} % outside")
    if found.rejected[:, j].any():
        notes.append(f"{found.rejected[:, j].sum():,} rejected")
    return label(found.names[j], found.units[j], *notes)


def _draw_innovations(figure: go.Figure, panel: int, found: Innovations, j: int, limit: int) -> bool:
    t, residual = found.t, found.residual[:, j]
    measured, rejected = found.measured[:, j], found.rejected[:, j]
    counted, doubted = found.counted[:, j], found.doubted[:, j] & ~found.counted[:, j]
    bound = np.where(measured, Z * found.sigma[:, j], np.nan)
    reach = _reach(np.abs(residual[counted]), bound[measured])
    times, edge = drawable(t, bound, limit=limit)
    add_band(figure, panel, times, -edge, edge, "±1.96 √S", fill=PALE, edge=GREY)
    beyond = measured & (np.abs(residual) > reach)
    for name, which in (
        ("used", counted),
        ("less than half", doubted),
        ("rejected", rejected),
    ):
        marker = _MARKERS[name]
        rows = _chosen(which & ~beyond, residual, limit)
        if len(rows):
            add_points(figure, panel, t[rows], residual[rows], name, marker)
        rows = _chosen(which & beyond, residual, limit)
        if len(rows):
            symbols = np.where(residual[rows] > 0, "triangle-up", "triangle-down").tolist()
            marker = {"symbol": symbols, "size": 8, "color": marker["color"]}
            at_edge = 0.93 * reach * np.sign(residual[rows])
            add_points(figure, panel, t[rows], at_edge, f"{name}, beyond", marker, residual[rows])
    set_range(figure, panel, -reach, reach, zero=True)
    return bool(beyond.any())


def _chosen(which: np.ndarray, values: np.ndarray, limit: int) -> np.ndarray:
    rows = np.flatnonzero(which)
    return rows[scattered(values[rows], limit)]


def _reach(sizes: np.ndarray, bounds: np.ndarray) -> float:
    """Half the height of a panel: all of it, unless a few values would take more than half."""
    parts = [
        (values.max(), np.quantile(values, share)) for values, share in ((sizes, 0.995), (bounds, 0.98)) if len(values)
    ]
    whole, most = (max(ends) for ends in zip(*parts, strict=True))
    return 1.1 * whole if whole <= 2 * most else 1.4 * most or 1.0


def nis_sections(result: Result, found: Innovations, limit: int) -> list[Section]:
    """NIS per measured component, its running mean, and the 95 % bounds of that mean."""
    squares = nees(np.where(found.counted, found.residual, np.nan), found.cov)
    rows = np.flatnonzero(np.isfinite(squares) & found.counted.any(axis=1))
    if len(rows) < 2:
        return []
    t, squares, count = found.t[rows], squares[rows], found.counted[rows].sum(axis=1)
    window = int(np.clip(len(rows) // 20, 5, 500))
    mean, degrees = running_mean(squares, count, window)
    low, high = (scipy.special.chdtri(degrees, tail) / degrees for tail in (0.975, 0.025))
    test = nis_test(result)
    notes = (f"mean {test.mean:.3g}", f"95 %: {test.lower:.3g} … {test.upper:.3g}")
    figure = panels([label("NIS", "1", *notes)], (found.t[0], found.t[-1]))
    single = squares / count
    shown = scattered(single, limit)
    marker = {"size": 3.5, "color": SKY, "opacity": 0.55}
    add_points(figure, 1, t[shown], single[shown], "single rows", marker)
    times, lower, upper, middle = drawable(t, low, high, mean, limit=limit)
    add_band(figure, 1, times, lower, upper, "95 % bounds of the mean", fill="rgba(107,114,128,0.22)", edge=GREY)
    add_line(figure, 1, times, middle, f"mean of {window} rows", color=BLACK, width=1.8)
    top = 1.6 * max(np.quantile(single, 0.999), mean.max(), high.max())
    figure.update_yaxes(type="log", range=[-2, np.log10(top)], dtick=1, exponentformat="none", row=1, col=1)
    figure.update_layout(height=cast("Any", figure.layout).height + 40)
    caption = (
        "Normalised innovation squared over the number of measured components: 1 on average if Q and R are right. "
        "A mean above its bounds says the filter is too sure of itself, below them too modest. "
        "Rejected measurements are left out."
    )
    return [Section("Consistency", caption, figure)]


def running_mean(nis: np.ndarray, count: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean NIS per component over a centred window, cut off at the ends, and the components in it."""
    rows = np.arange(len(nis))
    first, last = np.maximum(rows - window // 2, 0), np.minimum(rows + (window + 1) // 2, len(nis))
    sums, degrees = (np.concatenate([[0], np.cumsum(values)]) for values in (nis, count))
    degrees = degrees[last] - degrees[first]
    return (sums[last] - sums[first]) / degrees, degrees


def whiteness_sections(found: Innovations) -> list[Section]:
    """Autocorrelation of the normalised innovations of every signal, with bounds for white noise."""
    rows = {j: found.counted[:, j] & (found.sigma[:, j] > 0) for j in range(len(found.names))}
    enough = [j for j, which in rows.items() if which.sum() > 2]
    sections = []
    for group in grouped(len(enough)):
        columns = [enough[k] for k in group]
        headings, bars = [], []
        for j in columns:
            values = found.residual[rows[j], j] / found.sigma[rows[j], j]
            heights = ljung_box(values, min(LAGS, len(values) - 1))[0]
            bound = Z / np.sqrt(len(values))
            outside = int((np.abs(heights) > bound).sum())
            headings.append(label(found.names[j], "1", f"{outside} of {len(heights)} lags outside"))
            bars.append((heights, bound))
        figure = panels(headings)
        for panel, (heights, bound) in enumerate(bars, start=1):
            _draw_bars(figure, panel, heights, bound)
        figure.update_xaxes(range=[0.3, LAGS + 0.7], title_text=None, dtick=5, tick0=0)
        figure.update_xaxes(title_text="lag [measurements]", row=len(columns), col=1)
        caption = (
            "Autocorrelation of the normalised innovations: white noise stays within the bounds at 95 % of the lags. "
            "A slow decay hints at a wrong model, a bias, or Q being too small."
        )
        sections.append(Section("Whiteness", caption, figure, timed=False))
    return sections


def _draw_bars(figure: go.Figure, panel: int, heights: np.ndarray, bound: float) -> None:
    lags = np.arange(1, len(heights) + 1)
    for name, which, color, pattern in (
        ("within", np.abs(heights) <= bound, BLUE, ""),
        ("outside", np.abs(heights) > bound, VERMILLION, "/"),
    ):
        if not which.any():
            continue
        bar = go.Bar(
            x=lags[which],
            y=compact(heights[which]),
            width=0.62,
            name=name,
            legendgroup=name,
            showlegend=first_of(figure, name),
            marker={
                "color": color,
                "pattern": {"shape": pattern, "size": 5, "fillmode": "overlay", "fgcolor": "white"},
            },
            hovertemplate="lag %{x}: %{y:.3f}<extra></extra>",
        )
        figure.add_trace(bar, row=panel, col=1)
    ends = np.array([0.0, LAGS + 1.0])
    style = {"color": GREY, "width": 1.2, "dash": "dash", "marked": False}
    for sign in (-1.0, 1.0):
        add_line(figure, panel, ends, np.full(2, sign * bound), "±1.96 / √n", **style)
    reach = 1.15 * max(2 * bound, np.abs(heights).max())
    set_range(figure, panel, -reach, reach, zero=True)
    figure.update_layout(barmode="overlay")
