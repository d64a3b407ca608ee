"""The terminal summary of a study, and the list of studies."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..jobs import StudyJob
from ..jobs.study import FILES
from ..report import Table as ReportTable
from ..report.study import LOOKS
from ..studies import Entry, Measured, Outcome
from ..studies import Table as StudyTable
from ..studies.claims import Verdict

_STYLE: dict[Verdict, str] = {"reproduced": "green", "partly": "yellow", "not reproduced": "red", "undecided": "cyan"}


def print_studies(studies: Mapping[str, Entry], console: Console | None = None) -> None:
    """Print the studies there are, and how to run one."""
    console = console or Console()
    if not studies:
        console.print("no studies yet")
        return
    table = Table(title="studies", title_justify="left", title_style="bold", header_style="bold")
    table.add_column("name", no_wrap=True)
    table.add_column("what it repeats")
    for name, entry in studies.items():
        table.add_row(Text(name), Text(entry.summary))
    console.print(table)
    console.print(Text("run them all:  gainful study all"), soft_wrap=True)
    console.print(Text(f"run one:  gainful study {next(iter(studies))}"), soft_wrap=True)


def print_findings(job: StudyJob, console: Console | None = None) -> None:
    """Print the tables, the claims with their verdicts, what to know of the numbers, and where the results lie."""
    console = console or Console()
    outcome = job.outcome
    console.print(Text(outcome.study.title, style="bold"))
    console.print(Text(str(outcome.study.citations[0])))
    for table in job.tables:
        console.print(numbers_table(table))
    console.print(_claims(outcome))
    for warning in outcome.warnings:
        console.print(Text(f"warning: {warning}", style="yellow"))
    total, counts = len(outcome.findings), ", ".join(f"{count} {word}" for word, count in outcome.counts.items())
    made = f"{outcome.runs} {'run' if outcome.runs == 1 else 'runs'}, seed {outcome.seed}, {job.seconds:.1f} s"
    console.print(f"{total} {'claim' if total == 1 else 'claims'}: {counts}; {made}", highlight=False)
    if job.folder is not None:
        console.print(Text(f"wrote {job.folder / FILES[0]}, {', '.join(FILES[1:])}"), soft_wrap=True)


def verdict_text(verdict: Verdict) -> Text:
    """A verdict with its mark, in its colour."""
    return Text(f"{LOOKS[verdict].mark} {verdict}", style=_STYLE[verdict])


def _claims(outcome: Outcome) -> Table:
    """One line per claim; all checks are in the report."""
    table = Table(title="claims", title_justify="left", title_style="bold", header_style="bold")
    table.add_column("verdict", no_wrap=True, min_width=max(len(word) for word in _STYLE) + 2)  # with its mark
    table.add_column("claim", no_wrap=True, overflow="ellipsis", ratio=2)
    table.add_column("checks", no_wrap=True, justify="right", min_width=8)
    table.add_column("what decides", no_wrap=True, overflow="ellipsis", ratio=5)
    for finding in outcome.findings:
        told = f"{finding.telling.what}: {finding.telling.found}"
        table.add_row(
            verdict_text(finding.verdict),
            Text(finding.claim.name),
            Text(f"{finding.passed} of {len(finding.checks)}"),
            Text(told),
        )
    return table


def numbers_table(given: StudyTable | ReportTable) -> Table:
    """A table of a study or a report for the terminal."""
    table = Table(title=Text(given.title), title_justify="left", title_style="bold", header_style="bold")
    for k, head in enumerate(given.columns):
        table.add_column(Text(head), justify="right" if k else "left", overflow="fold")
    for row in given.rows:
        table.add_row(*(Text(_cell(value, head)) for value, head in zip(row, given.columns, strict=True)))
    return table


def _cell(value: object, head: str) -> str:
    if value is None or value != value:
        return "-"
    if isinstance(value, Measured):
        return value.number
    if isinstance(value, float):
        return f"{100 * value:.1f} %" if head.endswith("%") else f"{value:.4g}"
    return str(value)
