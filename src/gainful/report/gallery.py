"""The gallery of all studies: one table of verdicts, telling figures, and links to the reports, in one HTML file."""

from __future__ import annotations

import dataclasses
import json
import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import plotly.io

from ..studies import Chart, Figure, Outcome
from ..studies.claims import VERDICTS, Verdict
from .page import page_text, write_page
from .panels import Section
from .study import LOOKS
from .study_figures import study_sections


@dataclasses.dataclass(frozen=True)
class Judged:
    """A claim as the gallery tells it.

    Attributes:
        claim: its name.
        statement: what is claimed.
        published: what the publication gives for it.
        verdict: what it comes to.
        telling: the check that decides, in words and numbers.
        reason: why the verdict is what it is, with every check.
    """

    claim: str
    statement: str
    published: str
    verdict: Verdict
    telling: str
    reason: str


@dataclasses.dataclass(frozen=True)
class Card:
    """A finished study as the gallery tells of it: all of it is text, so that it can lie in a file.

    Attributes:
        study: its name.
        title: for people.
        about: what is studied.
        citation: the publication.
        runs: Monte Carlo runs.
        seed: of the random keys.
        seconds: it took.
        version: of gainful.
        claims: with their verdicts.
        figures: the telling ones as (title, caption, plotly's JSON).
    """

    study: str
    title: str
    about: str
    citation: str
    runs: int
    seed: int
    seconds: float
    version: str
    claims: tuple[Judged, ...]
    figures: tuple[tuple[str, str, str], ...]

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many claims came to each verdict, those that occur."""
        return counted([self])

    def text(self) -> str:
        """The card as JSON."""
        return json.dumps(dataclasses.asdict(self), indent=1, ensure_ascii=False) + "\n"

    @classmethod
    def read(cls, text: str) -> Card:
        """The card that a text holds.

        Raises:
            ValueError: the text is no card.
        """
        try:
            given: dict[str, Any] = json.loads(text)
            claims = tuple(Judged(**claim) for claim in given.pop("claims"))
            figures = tuple((title, caption, drawn) for title, caption, drawn in given.pop("figures"))
            return cls(**given, claims=claims, figures=figures)
        except (TypeError, KeyError, AttributeError) as problem:
            raise ValueError(f"no card of a study: {problem}") from problem


@dataclasses.dataclass(frozen=True)
class Missing:
    """A study of which there is nothing to show.

    Attributes:
        study: its name.
        why: "failed", "interrupted" or "not run".
        reason: in one sentence.
        trace: where it happened, for who has to mend it.
    """

    study: str
    why: str
    reason: str = ""
    trace: str = ""


def make_card(outcome: Outcome, figures: Sequence[Figure | Chart], *, seconds: float, version: str) -> Card:
    """The card of a study.

    Args:
        outcome: of the study.
        figures: of the outcome; those that are `telling` are shown, looking as they do in the study's report, or
            the first chart or figure if none is.
        seconds: it took.
        version: of gainful.
    """
    study = outcome.study
    return Card(
        study.name,
        study.title,
        study.about,
        str(study.citations[0]),
        outcome.runs,
        outcome.seed,
        seconds,
        version,
        tuple(
            Judged(
                finding.claim.name,
                finding.claim.statement,
                finding.claim.published,
                finding.verdict,
                f"{finding.telling.what}: {finding.telling.found}, expected {finding.telling.expected}",
                finding.reason,
            )
            for finding in outcome.findings
        ),
        tuple(
            (section.title, section.caption, _json(section))
            for figure in figures_to_show(figures)
            for section in study_sections([figure], among=figures)
        ),
    )


def figures_to_show(figures: Sequence[Figure | Chart]) -> list[Figure | Chart]:
    """The telling figures, or one that may stand for the others: the first chart, else the first figure."""
    telling = [figure for figure in figures if figure.telling]
    charts: list[Figure | Chart] = [figure for figure in figures if isinstance(figure, Chart)]
    return telling or charts[:1] or list(figures[:1])


def counted(cards: Sequence[Card]) -> dict[Verdict, int]:
    """How many claims of all cards came to each verdict, those that occur."""
    found = Counter(claim.verdict for card in cards for claim in card.claims)
    return {verdict: found[verdict] for verdict in VERDICTS if found[verdict]}


def write_gallery(
    entries: Sequence[Card | Missing],
    path: str | os.PathLike[str],
    *,
    facts: Sequence[tuple[str, str]] = (),
) -> Path:
    """Write the gallery in one HTML file that works offline.

    Args:
        entries: a card per finished study, and what is missing, in the order they are shown.
        path: of the file; reports lie beside it in folders called like the studies.
        facts: how it was made, as pairs of name and value.

    Returns:
        The path written.

    Raises:
        OSError: the file could not be written; an older one is left as it was.
    """
    cards = [entry for entry in entries if isinstance(entry, Card)]
    missing = [entry for entry in entries if isinstance(entry, Missing)]
    sections = {card.study: [_section(*given) for given in card.figures] for card in cards}
    text = page_text(
        "gallery",
        (),
        title="Published experiments, repeated",
        entries=entries,
        cards=cards,
        missing=missing,
        shown=sections,
        looks=LOOKS,
        tally=[(LOOKS[verdict], verdict, count) for verdict, count in counted(cards).items()],
        claims=sum(len(card.claims) for card in cards),
        warnings=[f"{each.study}: {each.why}{': ' if each.reason else ''}{each.reason}" for each in missing],
        facts=facts,
        tables=[],
    )
    path = Path(path)
    write_page(path, text)
    return path


def _json(section: Section) -> str:
    text = plotly.io.to_json(section.figure, validate=False)
    assert text is not None
    return text


def _section(title: str, caption: str, drawn: str) -> Section:
    return Section(title, caption, plotly.io.from_json(drawn), timed=False)
