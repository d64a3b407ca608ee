"""What a job says of the networks and maps of sensors that it used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..diagnostics import aiding_gain

if TYPE_CHECKING:
    from .estimate import EstimateJob

_WORDS = {True: "helped", False: "harmed", None: "not told"}


def aiding_gain_rows(job: EstimateJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of what aiding changed; no rows where there was none.

    Errors are those against truth; without truth the prediction of the next reading has to do.
    """
    heads = ["aiding", "RMS without", "RMS with", "mean square less by, 95 %", "it"]
    if job.unaided is None:
        return heads, []
    result = job.result if job.result.filtered is None else job.result.filtered
    names = {"error": "error of {}", "prediction": "prediction of {}"}
    rows: list[list[Any]] = []
    for each in aiding_gain(result, job.unaided):
        interval = f"{each.low:.3g} to {each.high:.3g}"
        rows.append([names[each.what].format(each.name), each.before, each.after, interval, _WORDS[each.helped]])
    return heads, rows
