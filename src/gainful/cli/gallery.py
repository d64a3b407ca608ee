"""The terminal summary of all studies."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..jobs import GalleryJob
from ..jobs.gallery import GALLERY_FILES
from ..report import Card
from ..studies.claims import VERDICTS
from .findings import verdict_text


def print_gallery(job: GalleryJob, console: Console | None = None) -> None:
    """Print the verdicts by study, what failed and why, and where the gallery lies."""
    console = console or Console()
    table = Table(title="verdicts", title_justify="left", title_style="bold", header_style="bold")
    table.add_column("study", no_wrap=True)
    table.add_column("claims", justify="right")
    for verdict in VERDICTS:
        table.add_column(verdict_text(verdict), justify="right")
    table.add_column("runs", justify="right")
    table.add_column("time [s]", justify="right")
    for entry in job.entries:
        if isinstance(entry, Card):
            counts = (str(entry.counts.get(verdict, 0)) for verdict in VERDICTS)
            table.add_row(Text(entry.study), str(len(entry.claims)), *counts, str(entry.runs), f"{entry.seconds:.0f}")
        else:
            table.add_row(Text(entry.study, style="red"), Text(entry.why, style="red"))
    console.print(table)
    for entry in job.missing:
        if entry.reason:
            told = Text(f"{entry.study} {entry.why}: {' '.join(entry.reason.split())}", style="red")
            console.print(told, soft_wrap=True)
    console.print(
        f"{len(job.cards)} of {len(job.entries)} studies finished, "
        f"{sum(len(card.claims) for card in job.cards)} claims; {job.seconds:.0f} s",
        highlight=False,
    )
    places = f"{job.folder / GALLERY_FILES[0]}, {GALLERY_FILES[1]}"
    console.print(Text(f"wrote {places}, and a folder per finished study"), soft_wrap=True)
