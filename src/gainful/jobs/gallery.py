"""All studies, one after the other, and the gallery that shows what they came to."""

from __future__ import annotations

import dataclasses
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import GainfulError
from ..io import check_folder, whole_folder
from ..report import Card, Missing, write_gallery
from ..report.gallery import counted
from ..running.compiled import forget_programs
from ..studies import STUDIES, Study, find_study
from ..studies.base import check_whole
from ..studies.registry import check_study
from ..version import __version__
from .json_text import json_text
from .provenance import made_with
from .study import run_study

GALLERY_FILES = ("index.html", "verdicts.json")
"""What is left beside the folders of the studies."""


@dataclasses.dataclass(frozen=True)
class GalleryJob:
    """What all studies came to, and where it lies.

    Attributes:
        entries: a card per finished study, and what is missing, in the order of the studies.
        seconds: it took.
        folder: with the gallery, and a folder per study.
    """

    entries: tuple[Card | Missing, ...]
    seconds: float
    folder: Path

    @property
    def cards(self) -> tuple[Card, ...]:
        """Of the studies that were finished."""
        return tuple(entry for entry in self.entries if isinstance(entry, Card))

    @property
    def missing(self) -> tuple[Missing, ...]:
        """The studies that were not."""
        return tuple(entry for entry in self.entries if isinstance(entry, Missing))


def run_all_studies(
    folder: Path | str,
    *,
    runs: int | None = None,
    seed: int | None = None,
    resume: bool = False,
    names: Sequence[str] | None = None,
    started: Callable[[Study], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> GalleryJob:
    """Run studies one after the other and show what they came to in one page.

    The gallery is written anew after each study, so that what is finished stays. A study that fails is told there with
    its reason, and the others are run; an interrupt ends the one that runs and leaves the rest.

    Args:
        folder: for `index.html` (the gallery), `verdicts.json` (the same as data), and the files of each study in a
            folder of its name.
        runs: Monte Carlo runs; by default each study's own.
        seed: of the random keys; by default each study's own.
        resume: take what lies in the folder already for the same runs and seed, made by the same version.
        names: of the studies; by default all there are.
        started: called with each study before it runs.
        progress: called with the runs done and the runs there are, of the study that runs.

    Raises:
        ConfigError: there is no such study, or runs and seed are no such numbers.
        DataError: the folder cannot be written.
    """
    folder = Path(folder)
    check_whole("runs", 1 if runs is None else runs, 1)
    check_whole("seed", 0 if seed is None else seed, 0)
    names = list(STUDIES) if names is None else list(names)
    for name in names:
        check_study(name)
    entries: dict[str, Card | Missing] = {name: Missing(name, "not run") for name in names}
    check_folder(folder)
    begin = time.perf_counter()
    for name in names:
        try:
            entries[name] = (resume and _finished(folder / name, name, runs, seed)) or _run(
                folder / name, name, runs, seed, started, progress
            )
        except KeyboardInterrupt:
            entries[name] = Missing(name, "interrupted")
            break
        except Exception as problem:  # whatever a study fails of, the others are run
            known = isinstance(problem, GainfulError)
            reason = str(problem) if known else f"{type(problem).__name__}: {problem}"
            entries[name] = Missing(name, "failed", reason, "" if known else traceback.format_exc())
        finally:
            _show(entries.values(), folder, time.perf_counter() - begin)
            forget_programs()
    return GalleryJob(tuple(entries.values()), time.perf_counter() - begin, folder)


def _run(folder: Path, name: str, runs: int | None, seed: int | None, started: Any, progress: Any) -> Card:
    run_study(name, folder, runs=runs, seed=seed, started=started, progress=progress)
    return Card.read((folder / "card.json").read_text(encoding="utf-8"))


def _finished(folder: Path, name: str, runs: int | None, seed: int | None) -> Card | None:
    """The card of an earlier call, if it was the same one."""
    try:
        card = Card.read((folder / "card.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    same = (card.runs, card.seed, card.version) == (*find_study(name).settings(runs, seed), __version__)
    return card if same else None


def _show(entries: Any, folder: Path, seconds: float) -> None:
    entries = list(entries)
    cards = [entry for entry in entries if isinstance(entry, Card)]
    facts = [
        ("Studies", f"{len(cards)} of {len(entries)} finished"),
        ("Time", f"{seconds:.0f} s"),
        made_with(),
    ]
    with whole_folder(folder) as scratch:
        (scratch / GALLERY_FILES[1]).write_text(json_text(_verdicts(entries, cards)), encoding="utf-8")
        write_gallery(entries, scratch / GALLERY_FILES[0], facts=facts)


def _verdicts(entries: list[Card | Missing], cards: list[Card]) -> dict[str, Any]:
    """All claims with their verdicts, and what was run."""
    return {
        "gainful_version": __version__,
        "verdicts": counted(cards),
        "studies": [_about(entry) for entry in entries],
        "claims": [
            {"study": card.study}
            | {field: getattr(claim, field) for field in ("claim", "statement", "published", "verdict", "reason")}
            | {"report": f"{card.study}/report.html#claim-{number}"}
            for card in cards
            for number, claim in enumerate(card.claims, start=1)
        ],
    }


def _about(entry: Card | Missing) -> dict[str, Any]:
    if isinstance(entry, Missing):
        return {"study": entry.study, "state": entry.why, "reason": entry.reason}
    told = {"runs": entry.runs, "seed": entry.seed, "seconds": entry.seconds, "verdicts": entry.counts}
    return {"study": entry.study, "state": "finished", "title": entry.title, **told}
