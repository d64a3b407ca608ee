"""The terminal summary of an identification."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from ..jobs import IdentifyJob
from ..jobs.identify import FILES, method_table, parameter_table
from .findings import numbers_table

_STYLE = {"good": "green", "bad": "red", "unknown": "yellow"}


def print_identification(job: IdentifyJob, console: Console | None = None) -> None:
    """Print the parameters, the methods side by side, the verdict, what to know of it, and where the results lie."""
    console = console or Console()
    console.print(Text(job.title, style="bold"))
    for table in (parameter_table(job), method_table(job, narrow=True)):
        console.print(numbers_table(table))
    console.print(Text(job.verdict, style=_STYLE[job.judgement]))
    for caution in job.cautions:
        console.print(Text(f"caution: {caution}", style="yellow"))
    console.print(Text(f"taken for granted: {'; '.join(job.found.assumptions)}"))
    if job.folder is not None:
        console.print(Text(f"wrote {job.folder / FILES[0]}, {', '.join(FILES[1:])}"), soft_wrap=True)
