"""The commands."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from ..errors import ConfigError
from ..jobs import EstimateJob, StudyJob, estimate, run_all_studies, run_study, write_starter
from ..studies import STUDIES, Study
from ..version import __version__
from .findings import print_findings, print_studies
from .gallery import print_gallery
from .identification import identify_command
from .messages import error_console as _error
from .messages import messages as _messages
from .summary import print_summary
from .train_aiding import train_aiding_command
from .tune import tune_command

PROGRESS_ROWS = 50_000
"""Records longer than this get a progress bar."""

ALL = "all"
"""The name that stands for every study."""

app = typer.Typer(
    name="gainful",
    help="States, parameters and faults from logs, with honest uncertainty.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(show: bool) -> None:
    if show:
        typer.echo(f"gainful {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """States, parameters and faults from logs, with honest uncertainty."""


@app.command("estimate")
def estimate_command(
    config: Annotated[Path, typer.Argument(help="Configuration file (TOML); `gainful init` writes one.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for estimates.parquet, result.nc and report.html.")
    ] = None,
) -> None:
    """Run a filter along a log: estimates with uncertainty, a verdict on them, and a report."""
    with _messages():
        job = _with_progress(config, out or Path("out") / config.stem)
    print_summary(job)


def _with_progress(config: Path, out: Path) -> EstimateJob:
    columns = (TextColumn("filtering"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_error, transient=True, disable=not _error.is_terminal) as bar:
        task = bar.add_task("filtering", visible=False, total=None)

        def started(log: object) -> None:
            rows = len(log)  # type: ignore[arg-type]  # a Log
            bar.update(task, total=rows, visible=rows > PROGRESS_ROWS)

        return estimate(config, out, started=started, progress=lambda done: bar.update(task, completed=done))


app.command("tune")(tune_command)
app.command("train-aiding")(train_aiding_command)
app.command("identify")(identify_command)


@app.command("study")
def study_command(
    name: Annotated[
        str | None, typer.Argument(help="Of the study, or all; without one, the studies are listed.")
    ] = None,
    runs: Annotated[int | None, typer.Option(help="Monte Carlo runs; by default the study's own.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of the random numbers; by default the study's own.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for report.html and the numbers, by default out/NAME.")
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="List the studies and leave.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="With all: keep the studies that were finished with the same settings.")
    ] = False,
) -> None:
    """Repeat a published experiment: its figures and tables, and a verdict on each of its claims."""
    if listed or name is None:
        print_studies(STUDIES)
        return
    out = out or Path("out") / name
    with _messages(), _study_progress() as told:
        if name != ALL:
            if resume:
                raise ConfigError(f"--resume: expected with {ALL!r} only, got it with {name!r}")
            job = run_study(name, out, runs=runs, seed=seed, **told)
        else:
            job = run_all_studies(out, runs=runs, seed=seed, resume=resume, **told)
    if isinstance(job, StudyJob):
        print_findings(job)
        return
    print_gallery(job)
    if job.missing:
        raise typer.Exit(1)


@contextlib.contextmanager
def _study_progress() -> Iterator[dict[str, Any]]:
    """What a job of studies calls, for a bar on a terminal: `started` and `progress`."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=_error, transient=True, disable=not _error.is_terminal) as bar:
        task = bar.add_task("compiling", total=None)

        def started(study: Study) -> None:
            bar.update(task, description="compiling", completed=0, total=None)
            _error.print(study.title, highlight=False, markup=False)

        def progress(done: int, total: int) -> None:
            bar.update(task, description="runs", completed=done, total=total)

        yield {"started": started if _error.is_terminal else None, "progress": progress}


@app.command()
def init(folder: Annotated[Path, typer.Argument(help="Folder to write into.")] = Path(".")) -> None:
    """Write a commented starter: configuration, model and a small record that run as they are."""
    with _messages():
        files = write_starter(folder)
    for path in files:
        typer.echo(f"wrote {path}")
    typer.echo(f"run it:  gainful estimate {shlex.quote(str(files[0]))}")
