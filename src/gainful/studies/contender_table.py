"""Tables of contenders that the chapters of several studies show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .figures import Table
from .outcome import Outcome
from .statistics import Measured


def compared(
    outcome: Outcome, title: str, names: Sequence[str], columns: Sequence[tuple[str, str, str]], *, of: str = "filter"
) -> Table:
    """A table of contenders.

    Args:
        outcome: of the study.
        title: what it shows.
        names: of the contenders.
        columns: heading, experiment and quantity of each.
        of: what the rows are.
    """
    rows = tuple((name, *(cell(outcome, where, name, what) for _, where, what in columns)) for name in names)
    return Table(title, (of, *(head for head, _, _ in columns)), rows)


def cell(outcome: Outcome, experiment: str, contender: str, quantity: str) -> Measured | None:
    """A number, or nothing where it has no meaning for the contender or the experiment has no such contender."""
    known = outcome.results[experiment].values.get(contender)
    if known is None or np.isnan(known[quantity]).all():
        return None
    return outcome.summary(experiment, contender, quantity)
