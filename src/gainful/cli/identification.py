"""`gainful identify`: its options and its summary."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from ..jobs import IdentifyJob, NetworkJob, identify_log
from ..jobs.identify import method_table, parameter_table
from ..jobs.identify_network import model_table
from ..jobs.tellings import FILES
from .findings import numbers_table
from .messages import messages

_STYLE = {"good": "green", "bad": "red", "unknown": "yellow"}


def identify_command(
    config: Annotated[
        Path, typer.Argument(help="Configuration file (TOML): signals, an equation or a network, a log.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for report.html, identification.json and rows.parquet.")
    ] = None,
) -> None:
    """Find the parameters of an equation in a log: with intervals, methods side by side, and a check on rows kept back."""
    with messages():
        job = identify_log(config, out or Path("out") / config.stem)
    if isinstance(job, NetworkJob):
        print_network(job)
    else:
        print_identification(job)


def print_identification(job: IdentifyJob, console: Console | None = None) -> None:
    """Print the parameters, the methods side by side, the verdict, what to know of it, and where the results lie."""
    console = console or Console()
    console.print(Text(job.title, style="bold"))
    for table in (parameter_table(job), method_table(job, narrow=True)):
        console.print(numbers_table(table))
    _print_verdict(job, console)
    console.print(Text(f"taken for granted: {'; '.join(job.found.assumptions)}"))
    _print_folder(job, console)


def print_network(job: NetworkJob, console: Console | None = None) -> None:
    """Print the models side by side, the verdict, what to know of it, and where the results lie."""
    console = console or Console()
    console.print(Text(job.title, style="bold"))
    console.print(numbers_table(model_table(job)))
    _print_verdict(job, console)
    _print_folder(job, console)


def _print_verdict(job: IdentifyJob | NetworkJob, console: Console) -> None:
    console.print(Text(job.verdict, style=_STYLE[job.judgement]))
    for caution in job.cautions:
        console.print(Text(f"caution: {caution}", style="yellow"))


def _print_folder(job: IdentifyJob | NetworkJob, console: Console) -> None:
    if job.folder is not None:
        console.print(Text(f"wrote {job.folder / FILES[0]}, {', '.join(FILES[1:])}"), soft_wrap=True)
