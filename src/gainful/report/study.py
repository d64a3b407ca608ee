"""The report of a study: claims with their verdicts, tables and figures, in one HTML file."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

from ..studies import Chart, Figure, Outcome, Table
from ..studies.claims import Verdict
from .page import page_text, write_page
from .study_figures import study_sections


@dataclasses.dataclass(frozen=True)
class Look:
    """How a verdict is shown: never by colour alone.

    Attributes:
        judgement: its class in the style sheet.
        mark: its sign.
    """

    judgement: str
    mark: str


LOOKS: dict[Verdict, Look] = {
    "reproduced": Look("good", "✓"),
    "partly": Look("partly", "◐"),
    "not reproduced": Look("bad", "✕"),
    "undecided": Look("unknown", "?"),
}
ANSWERS = {True: "✓ yes", False: "✕ no", None: "? cannot tell"}
"""Whether a check bears its claim out."""


def write_study_report(
    outcome: Outcome,
    path: str | os.PathLike[str],
    *,
    tables: Sequence[Table],
    figures: Sequence[Figure | Chart],
    facts: Sequence[tuple[str, str]] = (),
) -> Path:
    """Write the report of a study in one HTML file that works offline.

    Args:
        outcome: of the study.
        path: of the file; an older one is replaced once the new one is complete.
        tables: of the outcome.
        figures: of the outcome.
        facts: how it was run, as pairs of name and value.

    Returns:
        The path written.

    Raises:
        OSError: the file could not be written; an older one is left as it was.
    """
    study = outcome.study
    text = page_text(
        "study",
        study_sections(figures),
        title=study.title,
        about=study.about,
        tally=[(LOOKS[verdict], verdict, count) for verdict, count in outcome.counts.items()],
        findings=[(LOOKS[finding.verdict], finding) for finding in outcome.findings],
        answers=ANSWERS,
        warnings=outcome.warnings,
        facts=[("Publication", str(study.citations[0])), *facts],
        tables=tables,
        notes=study.notes,
        citations=study.citations,
    )
    path = Path(path)
    write_page(path, text)
    return path
