"""What a job says of the parameters that it estimated."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..diagnostics import learned
from ..running import Result

SHOWN = 3
"""Alarms whose times are shown."""


def parameter_rows(result: Result) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of parameters: where they started and ended, how well known, and when they jumped.

    A band holds with 95 % what the record is compatible with; it is the same in the parameter's own unit where bounds bend
    its scale.
    """
    space, found = result.model.space, learned(result)
    lower, upper = result.bands()
    start = np.asarray(result.prior.mean)
    heads = ["parameter", "at the start", "at the end", "95 % band", "sigma left, %"]
    jumps = any(each.changes for each in found)
    rows: list[list[Any]] = []
    for each in found:
        j = space.names.index(each.name)
        band = f"{lower[-1, j]:.4g} to {upper[-1, j]:.4g}"
        row: list[Any] = [each.name, float(start[j]), float(result.mean[-1, j]), band, each.after / each.before]
        if jumps:
            row.append(_times(each.changes))
        rows.append(row)
    return [*heads, "changes found [s]"] if jumps else heads, rows


def _times(changes: Any) -> str | None:
    told = [f"{each.t:.6g} {'up' if each.up else 'down'}" for each in changes[:SHOWN]]
    return ", ".join(told) + (f", and {len(changes) - SHOWN} more" if len(changes) > SHOWN else "") or None
