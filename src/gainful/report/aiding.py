"""Figures of what a network beside the filter added to the estimates, and when its gate was open."""

from __future__ import annotations

import numpy as np

from ..diagnostics.learning import parts_of
from ..running import Result
from ..updates import Corrected, Correction
from .panels import BLUE, GREY, Section, add_line, grouped, label, panels
from .series import drawable


def aiding_sections(result: Result, limit: int) -> list[Section]:
    """What was added to each corrected state over time; nothing where no network is in the filter."""
    updates = parts_of(result.estimator, Corrected)
    memories = parts_of(result.memories, Correction)[: len(updates)]
    space, kept = result.model.space, result.log.kept
    sections = []
    for update, memory in zip(updates, memories, strict=True):
        names = update.components or space.tangent_names
        columns = [space.tangent_names.index(name) for name in names]
        passed = np.asarray(memory.passed)[kept] > 0
        share = f"gate open in {100 * passed.mean():.1f} % of rows"
        shift, t = np.asarray(memory.shift)[kept], result.t[kept]
        for group in grouped(len(columns)):
            chosen = [columns[k] for k in group]
            labels = [label(space.tangent_names[j], space.tangent_units[j], share) for j in chosen]
            figure = panels(labels, (t[0], t[-1]))
            for panel, j in enumerate(chosen, start=1):
                added = np.where(passed, shift[:, j], np.nan)
                closed = np.where(passed, np.nan, 0.0)
                for name, values, color in (("added", added, BLUE), ("gate closed", closed, GREY)):
                    if np.isfinite(values).any():
                        times, line = drawable(t, values, limit=limit)
                        add_line(figure, panel, times, line, name, color=color, width=1.4, marked=False)
            caption = (
                "What the network added to each estimate. Where its gate is closed, its corrections have lately not improved "
                "the predictions of the measurements, and nothing is added."
            )
            sections.append(Section("Aiding", caption, figure))
    return sections
