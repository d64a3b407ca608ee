"""The report as one HTML file that needs nothing else."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..errors import ConfigError, Status
from ..running import Result
from .figures import figures_of
from .innovations import innovations_of
from .page import page_text, write_page

Judgement = Literal["good", "bad", "unknown"]
"""What a verdict comes to."""

_WORDS: dict[Judgement, tuple[str, str]] = {
    "good": ("✓", "Consistent"),
    "bad": ("✕", "Not consistent"),
    "unknown": ("?", "Undecided"),
}
_STATUS = {
    Status.ok: "updated",
    Status.missing: "without a measurement",
    Status.rejected: "rejected as a whole",
    Status.insufficient_data: "without enough data for an estimate",
    Status.ill_separated: "held (parameters not told from noise)",
    Status.nongeneric: "held (best fit infinite)",
    Status.not_positive: "failed (innovation covariance not positive definite)",
    Status.nonfinite: "failed (not finite)",
}


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of the report; numbers are set to four digits, NaN and None as a dash.

    Attributes:
        title: what it shows.
        columns: headings.
        rows: cells, text or numbers, the first of each row naming it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


def write_report(
    result: Result,
    path: str | os.PathLike[str],
    *,
    title: str,
    facts: Sequence[tuple[str, str]],
    verdict: str,
    judgement: Judgement | None = None,
    tables: Sequence[Table] = (),
    alarms: Mapping[str, Sequence[float]] | None = None,
) -> Path:
    """Write a report of a result: figures, tables and a verdict, in one HTML file that works offline.

    Args:
        result: of a filter or a smoother.
        path: of the file; an older one is replaced once the new one is complete.
        title: of the page.
        facts: what was run on what, as pairs of name and value.
        verdict: whether the numbers can be trusted, in one sentence.
        judgement: what the verdict comes to: "good", "bad" or "unknown"; by default told from its first words,
            "consistent:", "not consistent:" or anything else.
        tables: further tables, such as RMSE and coverage per state.
        alarms: times at which they were raised [s], by the name of the state they concern.

    Returns:
        The path written.

    Raises:
        ConfigError: a judgement other than the three.
        OSError: the file could not be written; an older one is left as it was.
    """
    if judgement is None:
        judgement = _told_by(verdict)
    if judgement not in _WORDS:
        raise ConfigError(f"judgement: expected one of {', '.join(map(repr, _WORDS))}, got {judgement!r}")
    path = Path(path)
    write_page(path, _page(result, title, facts, verdict, judgement, tables, alarms))
    return path


def _told_by(verdict: str) -> Judgement:
    for kind, (_, word) in _WORDS.items():
        if verdict.lower().startswith(word.lower()):
            return kind
    return "unknown"


def _page(
    result: Result,
    title: str,
    facts: Sequence[tuple[str, str]],
    verdict: str,
    judgement: Judgement,
    tables: Sequence[Table],
    alarms: Mapping[str, Sequence[float]] | None,
) -> str:
    mark, word = _WORDS[judgement]
    # The badge says the verdict's first word already.
    head, _, rest = verdict.partition(": ")
    if rest and head.lower() == word.lower():
        verdict = rest[0].upper() + rest[1:]
    return page_text(
        "estimation",
        figures_of(result, alarms),
        title=title,
        facts=facts,
        verdict=verdict,
        judgement=judgement,
        mark=mark,
        word=word,
        counts=counts_line(result),
        warnings=result.warnings,
        tables=[*tables, measurement_table(result)],
    )


def counts_line(result: Result) -> str:
    """How many rows and values there were, and what became of them."""
    kept = result.log.kept
    rows, t = int(kept.sum()), result.t[kept]
    became = [f"{count:,} {_STATUS[Status[name]]}" for name, count in result.counts().items()]
    seen, found = result.seen[kept], innovations_of(result)
    values = f"{seen.sum():,} values measured, {sum(result.log.missing.values()):,} missing"
    values += f", {found.rejected.sum():,} rejected"
    if found.doubted.any():
        values += f", {found.doubted.sum():,} weighted down"
    words = f"{rows:,} {'row' if rows == 1 else 'rows'} over {t[-1] - t[0]:,.6g} s: {', '.join(became)}. {values}."
    if result.log.counts:
        words += " On reading: " + ", ".join(f"{count:,} {name}" for name, count in result.log.counts.items()) + "."
    return words


def measurement_table(result: Result) -> Table:
    """What became of the measurements of each signal."""
    kept = result.log.kept
    seen, found = result.seen[kept], innovations_of(result)
    rows = []
    for j, (name, unit) in enumerate(zip(found.names, found.units, strict=True)):
        counted = found.counted[:, j] & (found.sigma[:, j] > 0)
        residual, sigma = found.residual[counted, j], found.sigma[counted, j]
        rms, ratio = (
            float(np.sqrt(np.mean(values**2))) if len(values) else math.nan for values in (residual, residual / sigma)
        )
        measured = int(seen[:, j].sum())
        counts = (measured, result.log.missing.get(name, 0), int(found.rejected[:, j].sum()))
        rows.append((name if unit == "1" else f"{name} [{unit}]", *counts, rms, ratio))
    columns = ("Signal", "Measured", "Missing", "Rejected", "RMS", "RMS / σ")  # noqa: RUF001
    return Table("Measurements", columns, tuple(rows))
