"""The report of a network that predicts a signal: models side by side, residuals, and what was kept back."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..identification import Assessment, NetworkIdentification
from .html import Judgement, Table
from .identification import assessment_figures, write_judged_page

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
    lags = found.model.lags
    base = f"lag({lags.of}) + " if found.model.form == "increment" else ""
    return write_judged_page(
        assessment_figures(found.assessment, check, lags.of),
        path,
        title=title,
        facts=facts,
        verdict=verdict,
        judgement=judgement,
        cautions=cautions,
        tables=tables,
        equation=f"{lags.of} = {base}{found.recipe.kind}({', '.join(lags.names)})",
        assumptions=_ASSUMPTIONS,
    )
