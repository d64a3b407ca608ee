"""A study run into a folder: report, findings and every number."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from ..io import check_folder, whole_folder
from ..report import make_card, write_study_report
from ..studies import Band, Chart, Figure, Line, Outcome, Study, Table, find_study
from ..version import __version__
from .json_text import json_text
from .provenance import made_with

FILES = ("report.html", "results.json", "results.parquet", "figures.parquet", "card.json")
"""What a study leaves in its folder."""


@dataclasses.dataclass(frozen=True)
class StudyJob:
    """What a study came to, and where it lies.

    Attributes:
        outcome: the numbers and findings.
        tables: of the outcome.
        seconds: it took.
        folder: with the files, or None if nothing was written.
    """

    outcome: Outcome
    tables: tuple[Table, ...]
    seconds: float
    folder: Path | None


def run_study(
    name: str,
    folder: Path | str | None = None,
    *,
    runs: int | None = None,
    seed: int | None = None,
    started: Callable[[Study], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> StudyJob:
    """Run a study by name.

    Args:
        name: as the registry has it.
        folder: where to leave `report.html` (claims, tables, figures), `results.json` (the same as data),
            `results.parquet` (every number of every run), `figures.parquet` (all that is drawn) and `card.json` (what the
            gallery of all studies shows of it), all or none; nothing if None.
        runs: Monte Carlo runs; by default the study's own.
        seed: of the random keys; by default the study's own.
        started: called with the study before it runs.
        progress: called with the runs done and the runs there are.

    Raises:
        ConfigError: there is no such study, or runs and seed are no such numbers.
        DataError: the folder cannot be written.
    """
    study = find_study(name)
    if folder is not None:
        check_folder(Path(folder))
    if started is not None:
        started(study)
    begin = time.perf_counter()
    outcome = study.run(runs, seed, progress=progress)
    job = StudyJob(
        outcome, tuple(study.tables_of(outcome)), time.perf_counter() - begin, None if folder is None else Path(folder)
    )
    if job.folder is not None:
        _write(job, job.folder)
    return job


def _write(job: StudyJob, folder: Path) -> None:
    outcome, study = job.outcome, job.outcome.study
    figures = study.figures_of(outcome)
    facts = [
        ("Monte Carlo", f"{outcome.runs} runs, seed {outcome.seed}"),
        ("Time", f"{job.seconds:.1f} s"),
        made_with(),
    ]
    with whole_folder(folder) as scratch:
        (scratch / "results.json").write_text(json_text(_summary(job)), encoding="utf-8")
        _runs_table(outcome).to_parquet(scratch / "results.parquet")
        _figures_table(figures).to_parquet(scratch / "figures.parquet")
        card = make_card(outcome, figures, seconds=job.seconds, version=__version__)
        (scratch / "card.json").write_text(card.text(), encoding="utf-8")
        write_study_report(outcome, scratch / "report.html", tables=job.tables, figures=figures, facts=facts)


def _summary(job: StudyJob) -> dict[str, Any]:
    """Claims, tables and settings."""
    outcome, study = job.outcome, job.outcome.study
    return {
        "study": study.name,
        "title": study.title,
        "citations": [str(citation) for citation in study.citations],
        "runs": outcome.runs,
        "seed": outcome.seed,
        "gainful_version": __version__,
        "verdicts": outcome.counts,
        "claims": [
            {
                "name": finding.claim.name,
                "statement": finding.claim.statement,
                "published": finding.claim.published,
                "verdict": finding.verdict,
                "reason": finding.reason,
                "checks": [
                    {
                        "what": check.what,
                        "found": check.found,
                        "expected": {"low": check.expected.low, "high": check.expected.high},
                        "passed": check.passed,
                    }
                    for check in finding.checks
                ],
            }
            for finding in outcome.findings
        ],
        "experiments": {
            name: {
                "title": results.experiment.title,
                "runs": results.runs,
                "baseline": results.experiment.baseline or None,
                "contenders": {
                    contender: {quantity: outcome.summary(name, contender, quantity) for quantity in quantities}
                    for contender, quantities in results.values.items()
                },
            }
            for name, results in outcome.results.items()
        },
        "tables": [dataclasses.asdict(table) | {"rows": table.rows} for table in job.tables],
        "warnings": outcome.warnings,
        "notes": study.notes,
    }


def _runs_table(outcome: Outcome) -> pd.DataFrame:
    """One row per number: experiment, contender, quantity, run."""
    pieces = [
        pd.DataFrame(
            {
                "experiment": name,
                "contender": contender,
                "quantity": quantity,
                "unit": outcome.quantity(name, quantity).unit,
                "run": range(len(values)),
                "value": values,
            }
        )
        for name, results in outcome.results.items()
        for contender, quantities in results.values.items()
        for quantity, values in quantities.items()
    ]
    table = pd.concat(pieces, ignore_index=True)
    table.attrs = {"study": outcome.study.name, "seed": outcome.seed, "gainful_version": __version__}
    return table


def _figures_table(figures: list[Figure | Chart]) -> pd.DataFrame:
    """One row per point drawn: a line has `y`, a band `low` and `high`, a bar all three and no `x`."""
    columns = ["figure", "title", "panel", "unit", "kind", "name", "x", "y", "low", "high"]
    pieces = [
        pd.DataFrame(
            {name: pd.Series(dtype=float if name in ["x", "y", "low", "high"] else object) for name in columns}
        )
    ]
    for number, figure in enumerate(figures):
        head: dict[str, Any] = {"figure": number, "title": figure.title}
        if isinstance(figure, Chart):
            about = {**head, "panel": figure.label, "unit": figure.unit, "kind": "bar"}
            rows = [
                {**about, "name": name, "y": bar.value, "low": bar.low, "high": bar.high}
                for name, bar in figure.bars.items()
            ]
            pieces.append(pd.DataFrame(rows, columns=columns))
            continue
        for panel in figure.panels:
            for mark in panel.marks:
                about = {**head, "panel": panel.label, "unit": panel.unit, "kind": _kind(mark), "name": mark.name}
                drawn = {"y": mark.y} if isinstance(mark, Line) else {"low": mark.low, "high": mark.high}
                pieces.append(pd.DataFrame({**about, "x": mark.x, **drawn}, columns=columns))
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def _kind(mark: Line | Band) -> str:
    return "line" if isinstance(mark, Line) else "band"
