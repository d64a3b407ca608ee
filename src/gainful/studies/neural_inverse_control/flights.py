"""Experiments that consist of flights, and checks of what came of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..claims import Check, Tolerance
from ..experiment import Experiment, Statistic
from ..figures import Line
from ..outcome import Outcome
from ..statistics import Measured, ratio_interval
from .contenders import Networks
from .measures import Measure, Traces, quantities
from .training import KINDS

ALL_NETWORKS = Networks(KINDS)
LATE = (60.0, 90.0)  # s


def flown(
    name: str,
    title: str,
    contenders: Mapping[str, Callable[[Any], Any]],
    *,
    simulate: Callable[[Array], Any] = ALL_NETWORKS,
    late: tuple[float, float] = LATE,
    statistic: Statistic = "mean",
    baseline: str = "",
    most_runs: int | None = None,
) -> Experiment:
    """An experiment of flights: they differ in who flies what, and all are judged alike.

    Args:
        name: by which claims ask for it.
        title: for people.
        contenders: who flies.
        simulate: makes the networks and the noise of a run.
        late: a window in which errors are told besides those of the whole flight [s].
        statistic: of errors, "median" where flights are lost.
        baseline: the rival that was tuned as fairly.
        most_runs: of a costly experiment.
    """
    return Experiment(
        name,
        title,
        simulate,
        contenders,
        Measure(jnp.asarray(late)),
        quantities(late, statistic),
        Traces(),
        baseline=baseline,
        most_runs=most_runs,
    )


def first(outcome: Outcome, experiment: str, contender: str, trace: str, axis: int | None = None) -> Line:
    """A series of the first run, under the contender's name."""
    t = outcome.trace(experiment, contender, "t").first
    values = outcome.trace(experiment, contender, trace).first
    return Line(contender, t, values if axis is None else values[:, axis])


def wanted(outcome: Outcome, experiment: str, contender: str, trace: str, axis: int, name: str) -> Line:
    """What was asked for in the first run."""
    t = outcome.trace(experiment, contender, "t").first
    return Line(name, t, outcome.trace(experiment, contender, trace).first[:, axis], reference=True)


def over(experiment: str, quantity: str, contender: str, other: str, expected: Tolerance, *, what: str) -> Check:
    """The mean of a quantity over that of another contender, on the same networks and noise."""
    return Check(
        f"{what}, {contender} over {other}",
        lambda outcome: outcome.ratio(experiment, quantity, contender, over=other),
        expected,
    )


def lost(experiment: str, contender: str, expected: Tolerance, *, when: str = "") -> Check:
    """The share of flights that are lost."""
    return Check(
        f"share of flights lost, {contender}{when}",
        lambda outcome: outcome.share(experiment, contender, "lost"),
        expected,
    )


def mean(experiment: str, quantity: str, contender: str, expected: Tolerance, *, what: str) -> Check:
    """The mean of a quantity."""
    return Check(f"{what}, {contender}", lambda outcome: outcome.mean(experiment, contender, quantity), expected)


def all_axes(outcome: Outcome, experiment: str, contender: str) -> np.ndarray:
    """Root mean square over the axes of the errors of every run [mrad]."""
    squares = [outcome.values(experiment, contender, f"rms_{axis}") ** 2 for axis in ("roll", "pitch", "yaw")]
    return np.sqrt(np.mean(squares, axis=0))


def all_axes_over(experiment: str, contender: str, other: str, expected: Tolerance) -> Check:
    """The error over all axes over that of another contender."""

    def found(outcome: Outcome) -> Measured:
        return ratio_interval(*(all_axes(outcome, experiment, each) for each in (contender, other)))

    return Check(f"RMS of all axes, {contender} over {other}", found, expected)
