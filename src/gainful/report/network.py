"""The report of a network that predicts a signal: models side by side, residuals, and what was kept back."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..identification import Assessment, NetworkIdentification
from .html import Judgement, Table
from .identification import WORDS, assessment_figures
from .page import page_text, write_page
from .study_figures import study_sections

_ASSUMPTIONS = ("what the network is told is free of noise", "inputs stay where they were in training")


def write_network_report(
    found: NetworkIdentification,
    path: str | os.PathLike[str],
    *,
    title: str,
    facts: Sequence[tuple[str, str]],
    verdict: str,
    judgement: Judgement,
    cautions: Sequence[str],
    tables: Sequence[Table],
    check: Assessment,
) -> Path:
    """Write the report of a network in one HTML file that works offline.

    Args:
        found: the network.
        path: of the file; an older one is replaced once the new one is complete.
        title: of the page.
        facts: what was run on what, as pairs of name and value.
        verdict: in one sentence.
        judgement: what it comes to.
        cautions: what a reader should know.
        tables: of models side by side.
        check: the network held against what was kept back.

    Returns:
        The path written.

    Raises:
        OSError: the file could not be written; an older one is left as it was.
    """
    mark, word = WORDS[judgement]
    lags = found.model.lags
    base = f"lag({lags.of}) + " if found.model.form == "increment" else ""
    text = page_text(
        "identification",
        study_sections(assessment_figures(found.assessment, check, lags.of)),
        title=title,
        facts=facts,
        verdict=verdict[:1].upper() + verdict[1:] + ".",
        judgement=judgement,
        mark=mark,
        word=word,
        warnings=cautions,
        tables=tables,
        equation=f"{lags.of} = {base}{found.recipe.kind}({', '.join(lags.names)})",
        assumptions=_ASSUMPTIONS,
    )
    path = Path(path)
    write_page(path, text)
    return path
