"""A chapter: experiments of a study that belong together, with what is told of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from .claims import Claim
from .experiment import Experiment
from .figures import Chart, Figure, Table

if TYPE_CHECKING:
    from .outcome import Outcome


@dataclasses.dataclass(frozen=True)
class Chapter:
    """Experiments that belong together, with their claims, tables and figures; `Study.of` binds chapters.

    A chapter may read experiments of others, and may have none of its own.

    Attributes:
        experiments: whose names are unlike those of other chapters.
        claims: what the publication says of them.
        tables: of an outcome; by default one per experiment, contenders by quantities.
        figures: of an outcome, in the order they are read.
        notes: what was chosen where the publication is silent, and what was found wrong in it.
    """

    experiments: tuple[Experiment, ...] = ()
    claims: tuple[Claim, ...] = ()
    tables: Callable[[Outcome], Sequence[Table]] | None = None
    figures: Callable[[Outcome], Sequence[Figure | Chart]] | None = None
    notes: tuple[str, ...] = ()

    def tables_of(self, outcome: Outcome) -> list[Table]:
        """The chapter's tables, or one per experiment."""
        if self.tables is not None:
            return list(self.tables(outcome))
        return [outcome.table(experiment.name) for experiment in self.experiments]

    def figures_of(self, outcome: Outcome) -> list[Figure | Chart]:
        """The chapter's figures, if it has any."""
        return list(self.figures(outcome)) if self.figures is not None else []
