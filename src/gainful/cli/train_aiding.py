"""`gainful train-aiding`: its options and its summary."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from ..jobs import TrainAidingJob, aiding_rows, map_rows, train
from .messages import error_console, messages
from .summary import table_of


def train_aiding_command(
    config: Annotated[Path, typer.Argument(help="Configuration file (TOML) of `gainful estimate` with [training].")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", help="Folder for aided.toml, the trained parts and training.json, by default out/NAME."
        ),
    ] = None,
) -> None:
    """Train networks for a filter: errors of sensors, corrections of estimates; what they are worth, and how to use them."""
    with messages(), error_console.status("training") as status:
        job = train(config, out or Path("out") / config.stem, progress=status.update)
    print_training(job)


def print_training(job: TrainAidingJob, console: Console | None = None) -> None:
    """Print what was learned, what it is worth on the pieces held out, and where the trained parts lie."""
    console = console or Console()
    if job.maps:
        console.print(table_of(f"{job.title}: sensors, on the pieces held out", *map_rows(job)))
    report = job.aiding
    if report is not None:
        console.print(table_of(f"{job.title}: estimates, on the pieces held out", *aiding_rows(job)))
        if report.components:
            told = f"corrects {', '.join(report.components)}; let through in {100 * report.passed:.1f} % of the rows"
        else:
            told = "the network lessens no error beyond chance: it is not used"
        console.print(Text(told, style="green" if report.components else "yellow"))
    every = [*(text for each in job.maps.values() for text in each.warnings), *(report.warnings if report else ())]
    for warning in dict.fromkeys(every):
        console.print(Text(f"warning: {warning}", style="yellow"))
    if job.folder is not None:
        console.print(Text(f"wrote {job.folder / job.files[0]}, {', '.join(job.files[1:])}"), soft_wrap=True)
        console.print(Text(f"run it:  gainful estimate {shlex.quote(str(job.folder / job.files[0]))}"), soft_wrap=True)
