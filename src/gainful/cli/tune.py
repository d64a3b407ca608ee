"""`gainful tune`: its options and its summary."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from ..diagnostics import Verdict
from ..jobs import TuneJob, likelihood_rows, noise_rows, tune
from .messages import error_console, messages
from .summary import VERDICT_STYLE, table_of

_NAME = "such as speed, Q.speed or R.speed; several share a factor as east,north. May be repeated."


def tune_command(
    config: Annotated[Path, typer.Argument(help="Configuration file (TOML) of `gainful estimate`.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for tuned.toml and tune.json, by default out/NAME.")
    ] = None,
    method: Annotated[str, typer.Option(help="ml (likelihood), em (the same by smoothing), moments or truth.")] = "ml",
    only: Annotated[list[str] | None, typer.Option(help=f"Noise to fit, {_NAME}")] = None,
    freeze: Annotated[list[str] | None, typer.Option(help=f"Noise to leave as it is, {_NAME}")] = None,
    held_out: Annotated[float, typer.Option(help="Share of the rows at the end by which the fit is judged.")] = 0.3,
    skip: Annotated[int, typer.Option(help="Measured rows at the start that count for nothing.")] = 0,
    floor: Annotated[float, typer.Option(help="Smallest factor on a standard deviation.")] = 1e-3,
    contamination: Annotated[
        float | None,
        typer.Option(help="Share of readings that may be outliers; by default 0.01 if the filter rejects any."),
    ] = None,
) -> None:
    """Fit Q and R to a log, without truth: sigmas with errors, likelihood before and after, and a tuned configuration."""
    with messages(), error_console.status("fitting"):
        job = tune(
            config,
            out or Path("out") / config.stem,
            method=method,
            only=only or (),
            freeze=freeze or (),
            held_out=held_out,
            skip=skip,
            floor=floor,
            contamination=contamination,
        )
    print_tuning(job)


def print_tuning(job: TuneJob, console: Console | None = None) -> None:
    """Print the noise, what it is worth, the verdicts before and after, and where the tuned configuration lies."""
    console = console or Console()
    console.print(table_of(job.title, *noise_rows(job)))
    if any(each.entry.kind == "process" for each in job.fit.entries):
        console.print(Text(f"sigma of Q is per step of {job.fit.step:.4g} s"))
    console.print(table_of("what it is worth", *likelihood_rows(job)))
    for word, (told, advice) in (("before", job.before), ("after", job.after)):
        console.print(_verdict(word, told))
        for sentence in advice.sentences:
            console.print(Text(f"  {sentence}"))
    for warning in job.fit.warnings:
        console.print(Text(f"warning: {warning}", style="yellow"))
    if job.folder is not None:
        tuned = job.folder / "tuned.toml"
        console.print(
            Text(f"wrote {tuned} (changed: {', '.join(job.changes) or 'nothing'}), tune.json"), soft_wrap=True
        )
        console.print(Text(f"run it:  gainful estimate {shlex.quote(str(tuned))}"), soft_wrap=True)


def _verdict(word: str, told: Verdict) -> Text:
    return Text(f"{word}: {told}", style=VERDICT_STYLE[told.consistent])
