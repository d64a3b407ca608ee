"""Checks that the chapters' claims are made of, and tables that several of them show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..claims import Check, Tolerance
from ..contender_table import cell
from ..figures import Table
from ..outcome import Outcome

Published = Mapping[str, tuple[float | None, float | None]]
"""Numbers of displacement and speed by contender, None where none was told."""


def ratio(quantity: str, experiment: str, contender: str, over: str, expected: Tolerance) -> Check:
    """The mean square error of one contender over that of another, on the same runs."""
    return Check(
        f"MSE of {quantity}, {contender} over {over}, {experiment}",
        lambda outcome: outcome.ratio(experiment, quantity, contender, over=over),
        expected,
    )


def ratios(
    quantity: str, experiment: str, contenders: Sequence[str], over: str, expected: Tolerance
) -> tuple[Check, ...]:
    """The same for several contenders over one."""
    return tuple(ratio(quantity, experiment, name, over, expected) for name in contenders)


def mean(what: str, experiment: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    """The mean of a quantity."""
    return Check(what, lambda outcome: outcome.mean(experiment, contender, quantity), expected)


def errors_beside(
    outcome: Outcome,
    title: str,
    experiment: str,
    names: Sequence[str],
    told: Published,
    *,
    paper: Published | None = None,
) -> Table:
    """Mean square errors, beside those of an independent program and of the paper.

    Args:
        outcome: of the study.
        title: what it shows.
        experiment: by name.
        names: of the contenders.
        told: by an independent program.
        paper: in print.
    """
    heads: list[str] = ["filter"]
    for state, unit in (("displacement", "m^2"), ("speed", "m^2/s^2")):
        heads += [f"{state}, MSE [{unit}]", "independent program", *(["paper"] if paper else [])]
    rows = []
    for name in names:
        row: list[object] = [name]
        for k, state in enumerate(("displacement", "speed")):
            row += [cell(outcome, experiment, name, state), told.get(name, (None, None))[k]]
            row += [paper.get(name, (None, None))[k]] if paper else []
        rows.append(tuple(row))
    return Table(title, tuple(heads), tuple(rows))
