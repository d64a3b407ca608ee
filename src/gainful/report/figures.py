"""All figures of a result, in the order they are read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ..running import Result
from .aiding import aiding_sections
from .innovations import innovation_sections, innovations_of, nis_sections, whiteness_sections
from .marks import marks_of
from .panels import Section
from .series import POINTS
from .states import error_sections, state_sections
from .trajectory import trajectory_sections
from .weights import weight_sections

_VALUES = 650_000
"""Numbers in all figures together that keep the file small."""


_THINNED = {
    "States": "keeping the extremes",
    "Errors": "keeping the extremes",
    "Innovations": "half of them evenly spaced, half keeping the extremes",
    "Weights": "half of them evenly spaced, half keeping the extremes",
    "Consistency": "keeping the extremes",
}


def figures_of(result: Result, alarms: Mapping[str, Sequence[float]] | None = None) -> list[Section]:
    """The figures that show and judge a result: states, path, aiding, errors, innovations, weights, consistency, whiteness.

    Args:
        result: of a filter or a smoother.
        alarms: times at which they were raised [s], by the name of the state they concern.
    """
    marks = marks_of(result, alarms)
    result, zero = _from_zero(result)
    marks = {name: [t - zero for t in times] for name, times in marks.items()}
    limit = _limit(result)
    found = innovations_of(result)
    sections = [
        *state_sections(result, limit, marks),
        *trajectory_sections(result, limit),
        *aiding_sections(result, limit),
        *error_sections(result, limit),
        *innovation_sections(found, limit),
        *weight_sections(found, limit),
        *nis_sections(result, found, limit),
        *whiteness_sections(found),
    ]
    rows, before = int(result.log.kept.sum()), None
    out = []
    for section in sections:
        caption = section.caption
        if rows > limit and section.title in _THINNED:
            caption += f" Thinned from {rows:,} rows to about {limit:,} points a line, {_THINNED[section.title]}."
        if zero and section.timed:
            name = f"time after {zero:,.0f} s [s]"
            section.figure.for_each_xaxis(lambda axis, name=name: axis.title.text and axis.update(title_text=name))
        # Neighbours that say the same say it once.
        same = (section.title, caption) == before
        before = (section.title, caption)
        out.append(dataclasses.replace(section, caption="Continued." if same else caption))
    return out


def _limit(result: Result) -> int:
    """Points per line: fewer where there are many panels."""
    per_point = 21 * result.model.space.size + 14 * result.model.output.dof
    return max(300, min(POINTS, _VALUES // per_point))


def _from_zero(result: Result) -> tuple[Result, float]:
    """The result with times counted from near its start, if they are too long to read otherwise, and that start [s]."""
    t = result.t
    zero = float(np.floor(t[0]))
    if abs(zero) < 1e7 or abs(zero) < 100 * (t[-1] - t[0]):
        return result, 0.0
    filtered = None if result.filtered is None else _from_zero(result.filtered)[0]
    return dataclasses.replace(result, log=dataclasses.replace(result.log, t=t - zero), filtered=filtered), zero
