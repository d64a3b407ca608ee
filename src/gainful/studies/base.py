"""A study: a paper's experiment, its figures and tables, and what comes of its claims."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Self

from ..errors import ConfigError
from .chapter import Chapter
from .claims import Claim
from .experiment import Experiment
from .figures import Chart, Figure, Table
from .monte_carlo import AT_ONCE, run_experiment
from .outcome import Outcome


@dataclasses.dataclass(frozen=True)
class Citation:
    """A publication.

    Attributes:
        authors: as they sign, in order.
        year: of publication.
        title: of the publication.
        venue: journal or conference, with volume, number and pages.
        note: what a reader should know, such as its language.
        doi: without the address in front.

    Example:
        >>> print(Citation(("B. Friedland",), 1969, "Treatment of bias in recursive filtering", "IEEE TAC 14(4), 359-367"))
        B. Friedland (1969), Treatment of bias in recursive filtering, IEEE TAC 14(4), 359-367
    """

    authors: tuple[str, ...]
    year: int
    title: str
    venue: str
    note: str = ""
    doi: str = ""

    def __str__(self) -> str:
        doi = f", doi:{self.doi}" if self.doi else ""
        note = f" ({self.note})" if self.note else ""
        return f"{', '.join(self.authors)} ({self.year}), {self.title}, {self.venue}{doi}{note}"


@dataclasses.dataclass(frozen=True)
class Study:
    """A paper's experiments repeated, as data and a few functions; it has no filter code of its own.

    Attributes:
        name: on the command line, in lower case with hyphens.
        title: for people.
        about: what is studied, in a few sentences.
        citations: the publication first, then what it rests on.
        experiments: at least one of them with a fairly tuned baseline among the contenders.
        claims: what the publication says.
        figures: of an outcome, in the order they are read.
        tables: of an outcome; by default one per experiment, contenders by quantities.
        notes: what was chosen where the publication is silent, and what was found wrong in it.
        runs: Monte Carlo runs, unless asked for others.
        seed: unless asked for another.
    """

    name: str
    title: str
    about: str
    citations: tuple[Citation, ...]
    experiments: tuple[Experiment, ...]
    claims: tuple[Claim, ...]
    figures: Callable[[Outcome], Sequence[Figure | Chart]] | None = None
    tables: Callable[[Outcome], Sequence[Table]] | None = None
    notes: tuple[str, ...] = ()
    runs: int = 20
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.citations:
            raise ConfigError(f"study {self.name!r}: citations: expected at least one, got none")
        for kind, items in (("experiment", self.experiments), ("claim", self.claims)):
            twice = [name for name, count in Counter(item.name for item in items).items() if count > 1]
            if twice or not items:
                got = f"{twice[0]!r} twice" if twice else "none"
                raise ConfigError(f"study {self.name!r}: {kind}s: expected at least one, each name once, got {got}")
        if not any(experiment.baseline for experiment in self.experiments):
            raise ConfigError(
                f"study {self.name!r}: baseline: expected a fairly tuned one in at least one experiment, got none"
            )

    @classmethod
    def of(
        cls,
        chapters: Sequence[Chapter],
        *,
        name: str,
        title: str,
        about: str,
        citations: tuple[Citation, ...],
        notes: tuple[str, ...] = (),
        runs: int = 20,
        seed: int = 0,
    ) -> Self:
        """A study of several chapters: their experiments, claims, tables and figures, in the order of the chapters.

        Args:
            chapters: in the order they are read.
            name: on the command line, in lower case with hyphens.
            title: for people.
            about: what is studied, in a few sentences.
            citations: the publication first, then what it rests on.
            notes: of the study as a whole; those of the chapters follow.
            runs: Monte Carlo runs, unless asked for others.
            seed: unless asked for another.

        Raises:
            ConfigError: two experiments or two claims have the same name, there are none, or nothing is cited.
        """
        return cls(
            name,
            title,
            about,
            citations,
            tuple(experiment for chapter in chapters for experiment in chapter.experiments),
            tuple(claim for chapter in chapters for claim in chapter.claims),
            lambda outcome: [figure for chapter in chapters for figure in chapter.figures_of(outcome)],
            lambda outcome: [table for chapter in chapters for table in chapter.tables_of(outcome)],
            (*notes, *(note for chapter in chapters for note in chapter.notes)),
            runs,
            seed,
        )

    def run(
        self,
        runs: int | None = None,
        seed: int | None = None,
        *,
        progress: Callable[[int, int], None] | None = None,
        at_once: int = AT_ONCE,
    ) -> Outcome:
        """Run all experiments.

        Args:
            runs: Monte Carlo runs; by default the study's own.
            seed: of the random keys; by default the study's own.
            progress: called with the runs done and the runs there are, over all experiments.
            at_once: runs in flight at the same time; more need more memory and change no number.

        Raises:
            ConfigError: runs or seed are no such numbers.
            ModelError: an experiment does not measure what it promises.
        """
        runs, seed = self.settings(runs, seed)
        check_whole("at_once", at_once, 1)
        total, done = sum(experiment.runs(runs) for experiment in self.experiments), 0

        def one_more() -> None:
            nonlocal done
            done += 1
            if progress is not None:
                progress(done, total)

        results = {
            experiment.name: run_experiment(experiment, runs, seed, progress=one_more, at_once=at_once)
            for experiment in self.experiments
        }
        return Outcome(self, runs, seed, results)

    def settings(self, runs: int | None = None, seed: int | None = None) -> tuple[int, int]:
        """Runs and seed as asked for, or the study's own.

        Raises:
            ConfigError: they are no such numbers.
        """
        runs, seed = self.runs if runs is None else runs, self.seed if seed is None else seed
        check_whole("runs", runs, 1)
        check_whole("seed", seed, 0)
        return runs, seed

    def tables_of(self, outcome: Outcome) -> list[Table]:
        """The study's tables, or one per experiment."""
        return self._whole.tables_of(outcome)

    def figures_of(self, outcome: Outcome) -> list[Figure | Chart]:
        """The study's figures, if it has any."""
        return self._whole.figures_of(outcome)

    @property
    def _whole(self) -> Chapter:
        return Chapter(self.experiments, self.claims, self.tables, self.figures, self.notes)


def check_whole(name: str, value: object, least: int) -> None:
    """Raise a `ConfigError` unless the value is a whole number of at least so much."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigError(f"{name}: expected a whole number of at least {least}, got {value!r}")
