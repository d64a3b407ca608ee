"""The terminal summary of a job."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..diagnostics import weighing
from ..errors import Status
from ..jobs import EstimateJob, fault_rows_of, parameter_rows, state_rows

VERDICT_STYLE = {True: "green", False: "yellow", None: "cyan"}


def print_summary(job: EstimateJob, console: Console | None = None) -> None:
    """Print the states, the measurements, the verdict and where the results lie."""
    console = console or Console()
    heads, rows = state_rows(job)
    console.print(table_of(job.title, heads, rows))
    console.print(table_of("measurements", *_measurement_rows(job)))
    parameters = parameter_rows(job.result)
    if parameters[1]:
        console.print(table_of("parameters", *parameters))
    if job.faults is not None:
        console.print(table_of("faults", *fault_rows_of(job.faults)))
        console.print(Text(f"{job.faults.isolability}; alarms above {job.faults.limit}"))
    console.print(Text(str(job.verdict), style=VERDICT_STYLE[job.verdict.consistent]))
    compiling, running = job.timing
    rows_kept = int(job.result.log.kept.sum())
    console.print(f"{rows_kept} rows; compiled in {compiling:.2f} s, ran in {running:.3f} s", highlight=False)
    if job.folder is not None:
        console.print(Text(f"wrote {job.folder / 'report.html'}, estimates.parquet, result.nc"), soft_wrap=True)


def table_of(title: str, heads: list[str], rows: list[list[Any]]) -> Table:
    """A table for the terminal: texts on the left, numbers short."""
    # Names and units are a user's own: shown as they are, whatever brackets they have.
    table = Table(title=Text(title), title_justify="left", title_style="bold", header_style="bold")
    for k, head in enumerate(heads):
        table.add_column(head, justify="left" if k == 0 else "right", no_wrap=k == 0)
    for row in rows:
        table.add_row(*(Text(_cell(head, value)) for head, value in zip(heads, row, strict=True)))
    return table


def _cell(head: str, value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{100 * value:.1f} %" if "%" in head else f"{value:.4g}"
    return str(value)


def _measurement_rows(job: EstimateJob) -> tuple[list[str], list[list[Any]]]:
    """Per signal: how often it was measured, missing and rejected, and where weights are between, how far it counted."""
    result = job.result if job.result.filtered is None else job.result.filtered
    kept = result.log.kept
    failed = result.status >= Status.not_positive
    rows = []
    for j, each in enumerate(weighing(result)):
        seen = result.seen[:, j] & kept
        rejected = seen & (result.weight[:, j] == 0) & ~failed
        sigma = float(np.sqrt(np.mean(result.residual[seen, j] ** 2))) if seen.any() else None
        missing = result.log.missing.get(each.signal, 0)
        rows.append([each.signal, int(seen.sum()), missing, int(rejected.sum()), each.clipped, each.outliers, sigma])
    heads = ["signal", "measured", "missing", "rejected", "not in full, %", "below half, %", "innovation RMS"]
    if not any(row[4] > row[3] / max(row[1], 1) for row in rows):  # nothing but rejections
        heads, rows = heads[:4] + heads[6:], [row[:4] + row[6:] for row in rows]
    return heads, rows
