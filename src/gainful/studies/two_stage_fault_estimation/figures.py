"""The paper's three figures, and what they hide."""

from __future__ import annotations

from ..figures import Band, Chart, Figure, Line, Panel, Table
from ..outcome import Outcome
from .claims import missed, time_to_follow
from .contenders import GATED, GATED_BIAS, LITERAL, PAPER, PUBLISHED
from .scenarios import DEGREE, SCENARIOS, Scenario

SHOWN = 5
"""One row in so many is drawn: 4 Hz is finer than any screen."""


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """Per fault the paper's four panels with the residual beside them, then the errors compared."""
    out: list[Figure | Chart] = []
    for scenario in SCENARIOS:
        out += [_published(outcome, scenario), _residual(outcome, scenario)]
    for scenario in SCENARIOS:
        experiment = outcome.results[scenario.name].experiment
        out.append(
            Chart(
                f"Errors compared: {scenario.title.lower()}",
                "Root mean square error of the faulty component from the onset to the end, with 95 % intervals.",
                "RMSE",
                {name: outcome.mean(scenario.name, name, "rmse") for name in experiment.contenders},
                scenario.unit,
                log=True,
                telling=scenario is SCENARIOS[0],
            )
        )
    return out


def _published(outcome: Outcome, scenario: Scenario) -> Figure:
    truth = outcome.record(scenario.name).truth
    t, states = truth["t"][::SHOWN], truth["states"][::SHOWN] / DEGREE
    names = (PUBLISHED, PAPER)

    def lines(what: str) -> tuple[Line, ...]:
        return tuple(Line(name, t, outcome.trace(scenario.name, name, what).first[::SHOWN]) for name in names)

    true = {"rate": states[:, 0], "angle": states[:, 3], "fault": truth["fault"][::SHOWN]}
    reference = {what: Line("truth", t, values, reference=True) for what, values in true.items()}
    number = SCENARIOS.index(scenario) + 1
    factor = Line(PAPER, t, outcome.trace(scenario.name, PAPER, "factor").first[::SHOWN])
    return Figure(
        f"{scenario.title}: figure {number} of the paper",
        "One flight. The adaptive filter as it must have been set for the published figures: faults only, no gate, R four "
        "times too large.",
        (
            Panel("x rate", (reference["rate"], *lines("rate")), "deg/s"),
            Panel("x angle", (reference["angle"], *lines("angle")), "deg"),
            Panel("factor on Qb, log10", (factor,)),
            Panel("fault", (reference["fault"], *lines("fault")), scenario.unit),
        ),
    )


def _residual(outcome: Outcome, scenario: Scenario) -> Figure:
    truth = outcome.record(scenario.name).truth
    t, fault = truth["t"][::SHOWN], truth["fault"][::SHOWN]
    panels = []
    for name in (PUBLISHED, LITERAL, GATED):
        trace, sigma = (outcome.trace(scenario.name, name, what).first[::SHOWN] for what in ("fault", "sigma"))
        band = Band(name, t, -1.96 * sigma, 1.96 * sigma, "95 % as the filter has it")
        panels.append(Panel(name, (band, Line(name, t, trace - fault)), scenario.unit))
    return Figure(
        f"{scenario.title}: errors of the estimate",
        "Estimate less truth in the same flight, with the band that the filter claims.",
        tuple(panels),
    )


def tables(outcome: Outcome) -> list[Table]:
    """The main table per fault, and the factor as a detector."""
    out = []
    for scenario in SCENARIOS:
        experiment = outcome.results[scenario.name].experiment
        rows = tuple(
            (
                name,
                outcome.mean(scenario.name, name, "rmse"),
                outcome.mean(scenario.name, name, "steady"),
                time_to_follow(outcome, scenario, name),
                outcome.mean(scenario.name, name, "nis"),
            )
            for name in experiment.contenders
        )
        unit = "" if scenario.unit == "1" else f" [{scenario.unit}]"
        heads = ("filter", f"RMSE, 50 to 200 s{unit}", f"steady RMSE{unit}", "time to 90 % [s]", "NIS before (6)")
        out.append(Table(scenario.title, heads, rows))
    adaptive = (LITERAL, GATED, GATED_BIAS, PAPER)
    out.append(
        Table(
            "The factor as a detector",
            (
                "fault",
                "filter",
                "first factor [s]",
                "fault-free steps above 1",
                "missed by the factor",
                "missed by NIS",
            ),
            tuple(
                (
                    scenario.title,
                    name,
                    outcome.median(scenario.name, name, "first"),
                    outcome.mean(scenario.name, name, "restless"),
                    missed(outcome, scenario, name, "factor"),
                    missed(outcome, scenario, name, "window"),
                )
                for scenario in SCENARIOS
                for name in adaptive
            ),
        )
    )
    return out
