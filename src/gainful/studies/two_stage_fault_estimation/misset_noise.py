"""What becomes of the filters when they are told wrong noise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...filters import AbstractEstimator, two_stage_unscented_kalman_filter
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..figures import Chart, Table, heading
from ..outcome import Outcome
from ..statistics import Measured
from .contenders import GATED, GLR, LITERAL, TUNED, gated, likelihood_ratio, literal, started
from .estimation import experiment
from .scenarios import OFFSET, SCENARIOS, Scenario

RIGHT, OPTIMISTIC, CONSERVATIVE, RESTLESS = "right noise", "R / 4", "R x 4", "tuned Qb x 100"
"""What the filters are told: sigmas of the readings halved or doubled, sigmas of the faults' walks times ten."""

_READINGS = {RIGHT: 1.0, OPTIMISTIC: 0.5, CONSERVATIVE: 2.0}
WINDOWS = (5, 10, 20, 40)
RUNS = 10


def experiment_of(scenario: Scenario) -> str:
    """Name of the experiment in which filters are told wrong noise."""
    return f"misset-{scenario.name}"


def told(filtered: str, noise: str) -> str:
    """Name of a filter told of some noise."""
    return f"{filtered}; {noise}"


def windowed(window: int) -> str:
    """Name of the gated filter with a window of its own."""
    return f"{GATED}, window {window}"


def contenders(scenario: Scenario) -> dict[str, Any]:
    """Four filters by three readings' noises, two by a restless fault, and windows of the gate for the offset."""
    quiet = two_stage_unscented_kalman_filter()
    filters: dict[str, tuple[AbstractEstimator, float]] = {
        TUNED: (quiet, scenario.tuned),
        GATED: (gated(scenario), 1.0),
        LITERAL: (literal(), 1.0),
        GLR: (likelihood_ratio(scenario), 1.0),
    }
    found = {
        told(name, noise): started(each, scenario.model(walk, readings=factor))
        for noise, factor in _READINGS.items()
        for name, (each, walk) in filters.items()
    }
    restless = scenario.model(10.0 * scenario.tuned)
    found |= {told(name, RESTLESS): started(filters[name][0], restless) for name in (TUNED, GATED)}
    if scenario is OFFSET:
        found |= {windowed(each): started(gated(scenario, each), scenario.model()) for each in WINDOWS if each != 10}
    return found


def _worse(scenario: Scenario, name: str, noise: str) -> Callable[[Outcome], Measured]:
    """Error with wrong noise over that with the right one."""
    where, wrong, right = experiment_of(scenario), told(name, noise), told(name, RIGHT)
    return lambda outcome: outcome.ratio(where, "rmse", wrong, over=right)


def _restless(scenario: Scenario) -> Callable[[Outcome], Measured]:
    return lambda outcome: outcome.ratio(
        experiment_of(scenario), "rmse", told(GATED, RESTLESS), over=told(TUNED, RESTLESS)
    )


CLAIMS = (
    Claim(
        "an optimistic R",
        "Adaptive filters and likelihood ratios bear an R that is too small worse than a tuned filter does.",
        "a finding of this study, not of the paper",
        tuple(
            check
            for each in SCENARIOS
            for check in (
                Check(f"RMSE with R / 4 over the right R, tuned, {each.name}", _worse(each, TUNED, OPTIMISTIC), below(1.3)),
                *(
                    Check(
                        f"RMSE with R / 4 over the right R, {name}, {each.name}",
                        _worse(each, name, OPTIMISTIC),
                        above(1.5),
                    )
                    for name in (GATED, GLR)
                ),
            )
        ),
        {"reproduced": "What R does not explain looks like a fault that never ends: estimate R before faults."},
    ),
    Claim(
        "a restless Qb",
        "Adaptation makes up for wrong noise of the faults.",
        "section 3",
        tuple(
            Check(f"RMSE with Qb 100 times too large, gated over not adaptive, {each.name}", _restless(each), below(0.9))
            for each in SCENARIOS
        ),
        {"not reproduced": "Factors are at least 1: the filter can add noise but take none away."},
    ),
)  # fmt: skip


def tables(outcome: Outcome) -> list[Table]:
    """Errors by what the filters were told, how restless the adaptive ones are, and windows of the gate."""
    names = contenders_told()
    heads = ("filter and what it is told", *(heading(each.title, each.unit) for each in SCENARIOS))
    rows = tuple((name, *(outcome.mean(experiment_of(each), name, "rmse") for each in SCENARIOS)) for name in names)
    adaptive = tuple(
        (name, *(outcome.mean(experiment_of(each), name, "restless") for each in SCENARIOS))
        for name in names
        if name.startswith((GATED, LITERAL))
    )
    where = experiment_of(OFFSET)
    windows = tuple(
        (each, *(outcome.mean(where, name, what) for what in ("rmse", "steady", "first")))
        for each in WINDOWS
        for name in [told(GATED, RIGHT) if each == 10 else windowed(each)]
    )
    return [
        Table("Told wrong noise: RMSE of the fault, 50 to 200 s", heads, rows),
        Table(
            "Told wrong noise: share of fault-free steps with a factor above 1",
            heads[:1] + tuple(each.title for each in SCENARIOS),
            adaptive,
        ),
        Table(
            "Window of the gate, wheel torque offset",
            ("innovations", heading("RMSE, 50 to 200 s", "N m"), heading("steady RMSE", "N m"), "first factor [s]"),
            windows,
        ),
    ]


def contenders_told() -> list[str]:
    """Names of filters by what they are told, in the order of the table."""
    pairs = [(name, noise) for noise in _READINGS for name in (TUNED, GATED, LITERAL, GLR)]
    return [told(*pair) for pair in (*pairs, (TUNED, RESTLESS), (GATED, RESTLESS))]


def figures(outcome: Outcome) -> list[Chart]:
    """How much worse each filter is for an R a quarter of the sensors'."""
    return [
        Chart(
            "Told too small an R",
            "RMSE with a quarter of the sensors' R over RMSE with the right one.",
            "ratio of errors",
            {
                f"{name}, {each.name}": _worse(each, name, OPTIMISTIC)(outcome)
                for each in SCENARIOS
                for name in (TUNED, GATED, LITERAL, GLR)
            },
            log=True,
        )
    ]


def chapter() -> Chapter:
    """Sensitivity to wrong Q and R, and to the window of the gate."""
    return Chapter(
        tuple(
            experiment(
                each,
                contenders(each),
                name=experiment_of(each),
                title=f"{each.title}, told wrong noise",
                baseline=told(TUNED, RIGHT),
                most_runs=RUNS,
            )
            for each in SCENARIOS
        ),
        CLAIMS,
        tables,
        figures,
        (
            "Noise told wrong: R a quarter of the sensors' or four times it, and the faults' walks ten times the tuned sigma. "
            "The claim about R is a finding of this study.",
        ),
    )
