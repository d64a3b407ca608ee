"""Figures of how far single measurements counted with a filter that weighs them."""

from __future__ import annotations

import numpy as np

from ..diagnostics.rows import LEAST_WEIGHT
from .innovations import Innovations
from .panels import BLACK, GREY, ORANGE, SKY, Section, add_line, add_points, grouped, label, panels, set_range
from .series import drawable, scattered

_USED = {"size": 3.5, "color": SKY, "opacity": 0.55}
_DOUBTED = {"symbol": "diamond-open", "size": 6, "color": ORANGE, "line": {"width": 1.2, "color": ORANGE}}


def weight_sections(found: Innovations, limit: int) -> list[Section]:
    """Weights of every signal over time with their running mean; nothing where all count in full or not at all."""
    if not found.doubted.any():
        return []
    weighed = [j for j in range(len(found.names)) if found.measured[:, j].any()]
    top = 1.06 * max(1.0, float(found.weight[:, weighed][found.measured[:, weighed]].max()))
    sections = []
    for group in grouped(len(weighed)):
        columns, windows = [weighed[k] for k in group], set()
        figure = panels([_label(found, j) for j in columns], (found.t[0], found.t[-1]))
        for panel, j in enumerate(columns, start=1):
            rows = found.measured[:, j]
            t, weight = found.t[rows], found.weight[rows, j]
            for name, which, marker in (
                ("weight", weight >= LEAST_WEIGHT, _USED),
                ("less than half", weight < LEAST_WEIGHT, _DOUBTED),
            ):
                chosen = np.flatnonzero(which)
                chosen = chosen[scattered(weight[chosen], limit)]
                if len(chosen):
                    add_points(figure, panel, t[chosen], weight[chosen], name, marker)
            window = int(np.clip(len(t) // 20, 5, 200))
            windows.add(window)
            times, mean = drawable(t, _running(weight, window), limit=limit)
            add_line(figure, panel, times, mean, "running mean", color=BLACK, width=1.8, marked=False)
            ends = np.array([found.t[0], found.t[-1]])
            half = np.full(2, LEAST_WEIGHT)
            add_line(figure, panel, ends, half, "half", color=GREY, width=1, dash="dash", marked=False)
            set_range(figure, panel, 0.0, top)
        wide = " to ".join(str(each) for each in sorted({min(windows), max(windows)}))
        caption = (
            "How far each measurement counted: 1 in full, 0 not at all. Outliers are single; a mean "
            f"(of {wide} measurements) that stays below half says that the filter no longer follows the signal."
        )
        sections.append(Section("Weights", caption, figure))
    return sections


def _label(found: Innovations, j: int) -> str:
    share = np.mean(found.weight[found.measured[:, j], j] < LEAST_WEIGHT)
    return label(found.names[j], "1", f"{100 * share:.1f} % below half")


def _running(values: np.ndarray, window: int) -> np.ndarray:
    """Mean over a centred window, cut off at the ends."""
    rows = np.arange(len(values))
    first, last = np.maximum(rows - window // 2, 0), np.minimum(rows + (window + 1) // 2, len(values))
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return (sums[last] - sums[first]) / (last - first)
