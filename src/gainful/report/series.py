"""Preparing long, gappy or wrapping series for drawing."""

from __future__ import annotations

import math

import numpy as np

POINTS = 2500
"""Most points drawn per line."""

_GAP = 10.0
"""Spacing, in medians, beyond which a line is interrupted."""


def extremes(lines: list[np.ndarray], limit: int) -> np.ndarray:
    """Rows to draw, about `limit` at most, so that in every stretch each line keeps its least and greatest value.

    Args:
        lines: series of equal length, NaN where unknown.
        limit: most rows, as far as one stretch allows.
    """
    rows = len(lines[0])
    if rows <= limit:
        return np.arange(rows)
    stretches = max(1, (limit - 2) // (2 * len(lines)))
    width = math.ceil(rows / stretches)
    starts = np.arange(0, rows, width)
    chosen = [np.array([0, rows - 1])]
    for line in lines:
        padded = np.full(len(starts) * width, np.nan)
        padded[:rows] = line
        blocks, unknown = padded.reshape(len(starts), width), np.isnan(padded).reshape(len(starts), width)
        chosen.append(starts + np.argmin(np.where(unknown, np.inf, blocks), axis=1))
        chosen.append(starts + np.argmax(np.where(unknown, -np.inf, blocks), axis=1))
    return np.unique(np.concatenate(chosen))


def scattered(values: np.ndarray, limit: int) -> np.ndarray:
    """Positions of points to draw, `limit` at most: half keep the extremes, half are evenly spaced."""
    if len(values) <= limit:
        return np.arange(len(values))
    even = np.linspace(0, len(values) - 1, limit // 2).astype(int)
    return np.union1d(even, extremes([values], limit - len(even)))


def strided(rows: int, limit: int) -> np.ndarray:
    """Evenly spaced rows, `limit` at most, with the first and the last."""
    return np.arange(rows) if rows <= limit else np.unique(np.linspace(0, rows - 1, limit).astype(int))


def drawable(t: np.ndarray, *lines: np.ndarray, limit: int = POINTS) -> tuple[np.ndarray, ...]:
    """Times and lines thinned together where all are known, with a NaN row where the next known one is far off.

    Args:
        t: times [s] (T,).
        lines: series (T,), NaN where unknown.
        limit: most rows.
    """
    known = np.isfinite(np.stack(lines)).all(axis=0)
    t, columns = t[known], [line[known] for line in lines]
    if not len(t):
        return t, *columns
    stretch = _stretches(t)
    # So many gaps that most stretches would thin to a single, invisible point: better one line through all.
    if stretch[-1] > limit / 8:
        stretch = np.zeros_like(stretch)
    rows = extremes(columns, limit)
    cuts = np.flatnonzero(np.diff(stretch[rows])) + 1
    t = np.insert(t[rows], cuts, t[rows][cuts - 1])
    return t, *(np.insert(column[rows].astype(float), cuts, np.nan) for column in columns)


def _stretches(t: np.ndarray) -> np.ndarray:
    """A number per row that grows by one at every long gap."""
    spacing = np.diff(t)
    usual = np.median(spacing[spacing > 0]) if (spacing > 0).any() else np.inf
    return np.concatenate([[0], np.cumsum(spacing > _GAP * usual)])


def aligned(angle: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The same angles [rad], moved by whole turns to lie next to `near`."""
    return angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))


def compact(values: np.ndarray) -> np.ndarray:
    """The values in single precision where the rounding cannot be seen, else as they are."""
    known = values[np.isfinite(values)]
    if not len(known) or np.abs(known).max() > np.finfo(np.float32).max:
        return values
    off = np.abs(known.astype(np.float32).astype(float) - known).max()
    return values.astype(np.float32) if off <= 1e-6 * np.ptp(known) else values


def settled_range(t: np.ndarray, always: list[np.ndarray], settling: list[np.ndarray]) -> tuple[float, float, bool]:
    """Ends of an axis that start-up transients do not flatten.

    Args:
        t: times [s] (T,).
        always: lines that must be inside as a whole (T,).
        settling: lines whose start may be cut off if it would take more than two thirds of the axis (T,).

    Returns:
        Lower end, upper end, and whether something was cut off.
    """
    late = t >= t[0] + 0.03 * (t[-1] - t[0])
    every = _ends(always + settling)
    settled = _ends(always + [line[late] for line in settling])
    cut = bool(every[1] - every[0] > 3 * (settled[1] - settled[0]) > 0)
    low, high = settled if cut else every
    room = 0.06 * (high - low) or 0.5 * abs(high) or 1.0
    return low - room, high + room, cut


def _ends(lines: list[np.ndarray]) -> tuple[float, float]:
    values = np.concatenate(lines)
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
