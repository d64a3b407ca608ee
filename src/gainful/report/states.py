"""Figures of the states and of their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..diagnostics import coverage, rmse
from ..diagnostics.rows import failed_rows
from ..running import Result
from ..spaces import AbstractSpace, Circle
from .panels import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    PALE,
    Section,
    add_band,
    add_line,
    add_marks,
    grouped,
    label,
    panels,
    set_range,
)
from .series import aligned, drawable, settled_range

Z = 1.959964  # two-sided 95 % quantile of the normal distribution
BOUND = "±1.96 σ"  # noqa: RUF001


def state_sections(result: Result, limit: int, alarms: Mapping[str, Sequence[float]] | None = None) -> list[Section]:
    """One panel per state: estimate, 95 % band, truth, alarms, and the filter's own estimate where the result is smoothed."""
    alarms = {} if alarms is None else alarms
    space, kept = result.model.space, result.log.kept
    t, mean, failed = result.t[kept], result.mean[kept], failed_rows(result)[kept]
    lower, upper = (ends[kept] for ends in result.bands())
    filtered = None if result.filtered is None else result.filtered.mean[kept]
    truth = np.full_like(mean, np.nan)
    for i, name in enumerate(space.names):
        if name in result.log.truth:
            truth[:, i] = result.log.truth[name][kept]
    truth = _same_sign(space, truth, mean)
    drawn = mean.copy()
    for i in _circles(space):
        drawn[:, i] = np.unwrap(mean[:, i])
        truth[:, i] = aligned(truth[:, i], drawn[:, i])
        lower[:, i] += drawn[:, i] - mean[:, i]
        upper[:, i] += drawn[:, i] - mean[:, i]
        if filtered is not None:
            filtered = filtered.copy()
            filtered[:, i] = aligned(filtered[:, i], drawn[:, i])
    drawn[failed] = np.nan
    kind = "smoothed estimate" if result.smoothed else "estimate"
    sections = []
    for group in grouped(space.size):
        figure = panels([label(space.names[i], space.units[i]) for i in group], (t[0], t[-1]))
        cut = False
        for panel, i in enumerate(group, start=1):
            between = None
            if np.isfinite(lower[:, i]).any():
                times, middle, low, high = drawable(t, drawn[:, i], lower[:, i], upper[:, i], limit=limit)
                between = (low, high)
                add_band(figure, panel, times, low, high, "95 % band")
            else:
                times, middle = drawable(t, drawn[:, i], limit=limit)
            if filtered is not None:
                own_times, own = drawable(t, filtered[:, i], limit=limit)
                add_line(figure, panel, own_times, own, "filtered", color=ORANGE, width=1, dash="dot")
            add_line(figure, panel, times, middle, kind, color=BLUE, width=1.8, between=between)
            true_times, known = drawable(t, truth[:, i], limit=limit)
            if len(known):
                add_line(figure, panel, true_times, known, "truth", color=BLACK, width=1.3, dash="dash")
            low, high, here = settled_range(t, [drawn[:, i], truth[:, i]], [lower[:, i], upper[:, i]])
            set_range(figure, panel, low, high)
            if len(alarms.get(space.names[i], ())):
                add_marks(figure, panel, np.asarray(alarms[space.names[i]], float), (low, high), "alarm")
            cut |= here
        with_truth = bool(np.isfinite(truth[:, list(group)]).any())
        names = [space.names[i] for i in group]
        caption = _state_caption(result, names, with_truth)
        caption += " Alarms are upright lines." if any(len(alarms.get(name, ())) for name in names) else ""
        sections.append(Section("States", caption + cut_note(cut), figure))
    return sections


def _state_caption(result: Result, names: list[str], with_truth: bool) -> str:
    space = result.model.space
    circles = {space.names[i] for i in _circles(space)} & set(names)
    curved = {name for part in space.parts if part.size != part.dof for name in part.names} & set(names)
    words = "Estimates with their 95 % bands"
    if result.smoothed:
        ahead = "" if result.lag is None else f", which look {result.lag:g} s ahead,"
        words = f"Smoothed estimates{ahead} with their 95 % bands, and the filter's own estimates as thin dots"
    words += "; the truth is dashed." if with_truth else "."
    if np.any(failed_rows(result) & result.log.kept):
        words += " Rows that failed are left out."
    if circles:
        words += " Angles are unwrapped."
    if curved:
        words += " Quaternion components have no band of their own: see the rotation under Errors."
    return words


def error_sections(result: Result, limit: int) -> list[Section]:
    """Truth minus estimate within ±1.96 standard deviations; rotations show their bounds even without truth."""
    space, kept = result.model.space, result.log.kept
    t, error, sigma = result.t[kept], result.error()[kept], result.std[kept]
    sigma[failed_rows(result)[kept]] = np.nan
    error[np.isnan(sigma)] = np.nan
    known, notes = np.asarray(np.isfinite(error).any(axis=0)), _error_notes(result)
    rotations = np.concatenate([np.full(part.dof, part.size != part.dof) for part in space.parts])
    drawn = np.flatnonzero(known | rotations)
    sections = []
    for group in grouped(len(drawn)):
        columns = drawn[list(group)]
        names = [space.tangent_names[j] for j in columns]
        units = [space.tangent_units[j] for j in columns]
        labels = [label(name, unit, *notes.get(name, ())) for name, unit in zip(names, units, strict=True)]
        figure = panels(labels, (t[0], t[-1]))
        cut = False
        for panel, j in enumerate(columns, start=1):
            bound = Z * sigma[:, j]
            times, high = drawable(t, bound, limit=limit)
            add_band(figure, panel, times, -high, high, BOUND, fill=PALE, edge=GREY)
            times, line = drawable(t, error[:, j], limit=limit)
            if len(line):
                add_line(figure, panel, times, line, "truth minus estimate", color=BLUE, width=1.4)
            low, high, here = settled_range(t, [], [error[:, j], bound, -bound])
            set_range(figure, panel, low, high, zero=True)
            cut |= here
        words = "Truth minus estimate, with the bounds that 95 % of the errors should stay within."
        if not known[columns].any():
            words = "Bounds that 95 % of the rotation errors should stay within; there is no truth to compare with."
        sections.append(Section("Errors", words + cut_note(cut), figure))
    return sections


def _error_notes(result: Result) -> dict[str, tuple[str, str]]:
    inside = coverage(result)
    return {name: (f"RMS {size:.3g}", f"{100 * inside[name]:.1f} % inside") for name, size in rmse(result).items()}


def cut_note(cut: bool) -> str:
    """What a caption adds where a start-up transient was left off an axis."""
    return " The transient at the start reaches beyond a panel; “Autoscale” shows it." if cut else ""


def _circles(space: AbstractSpace) -> list[int]:
    kinds = [part for part in space.parts for _ in part.names]
    return [i for i, part in enumerate(kinds) if isinstance(part, Circle)]


def _same_sign(space: AbstractSpace, truth: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """True quaternions with the sign of the estimate: both signs are the same attitude."""
    out, i = truth.copy(), 0
    for part in space.parts:
        if part.size != part.dof:
            block = slice(i, i + part.size)
            opposite = np.sum(truth[:, block] * mean[:, block], axis=1) < 0
            out[opposite, block] *= -1
        i += part.size
    return out
