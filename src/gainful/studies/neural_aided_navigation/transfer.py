"""A network trained in one scenario and used in another, with and without the gate that asks the innovations."""

from __future__ import annotations

import functools

from ...plants import TRACK_SCENARIOS
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, below
from ..contender_table import cell
from ..experiment import Experiment
from ..figures import Chart, Table
from ..outcome import Outcome
from ..prepared import Prepared
from ..statistics import Measured, ratio_interval
from .aiding import aided, filtered
from .comparing import mean, ratio
from .contenders import CMAC, DESIGN, ML
from .measures import judged
from .noise import design, fitted
from .records import SCENARIOS, Drive

MOST = 50
MLP = "BP, L-BFGS"
TOLD = {
    "matched": (0.00074, 0.0117, 0.00076, 0.0),
    "calibrated": (0.0321, 0.0155, 0.0154, 0.95),
    "timevarying": (0.0266, 0.0290, 0.0166, 0.61),
    "manoeuvre": (0.470, 0.0250, 0.0250, 1.0),
    "outliers": (0.031, 0.33, 0.042, 0.07),
    "coloured": (0.0304, 0.0191, 0.0189, 0.91),
}
"""Of an independent program: speed, MSE of the filter, with a CMAC from `calibrated`, with its gate, share corrected."""


def from_scenario(scenario: str, *, online: bool = False) -> str:
    """The name of a CMAC trained there."""
    return f"CMAC from {scenario}" + (", gated online" if online else "")


FIXED, GATED, FIXED_MLP = from_scenario("calibrated"), from_scenario("calibrated", online=True), "MLP from calibrated"


def named(scenario: str) -> str:
    """The experiment in which networks from everywhere are used in a scenario."""
    return f"used in {scenario}"


def experiment(scenario: str) -> Experiment:
    """Networks from all scenarios used in one."""
    makers = {DESIGN: lambda: filtered(design()), ML: lambda: filtered(fitted(scenario))}
    for origin in SCENARIOS:
        for online in (False, True):
            makers[from_scenario(origin, online=online)] = functools.partial(aided, CMAC, origin, online=online)
    makers[FIXED_MLP] = lambda: aided(MLP, "calibrated")
    return judged(
        named(scenario),
        f"Networks from elsewhere, used in {scenario}",
        Drive(TRACK_SCENARIOS[scenario]),
        Prepared(makers),
        baseline=ML,
        most_runs=MOST,
    )


def tables(outcome: Outcome) -> list[Table]:
    """The matrix of trained there, used here; and the numbers of an independent program."""
    matrices = [
        Table(
            f"Speed, MSE over that of the design filter: CMAC trained in a row's scenario, used in a column's, {word}",
            ("trained in", *SCENARIOS),
            tuple(
                (
                    origin,
                    *(
                        round(
                            outcome.ratio(named(at), "speed", from_scenario(origin, online=online), over=DESIGN).value,
                            3,
                        )
                        for at in SCENARIOS
                    ),
                )
                for origin in SCENARIOS
            ),
        )
        for online, word in ((False, "without the online gate"), (True, "with the online gate"))
    ]
    rows, shares = [], []
    for scenario in SCENARIOS:
        told = TOLD.get(scenario, (None,) * 4)
        row: list[object] = [scenario]
        for name, number in zip((DESIGN, FIXED, GATED), told, strict=False):
            row += [cell(outcome, named(scenario), name, "speed"), number]
        rows.append(tuple(row))
        shares.append((scenario, cell(outcome, named(scenario), GATED, "passed"), told[3]))
    heads = [head for name in (DESIGN, "with the CMAC", "gated online") for head in (name, "independent program")]
    return [
        Table("Speed, MSE [m^2/s^2], with a CMAC trained in `calibrated`", ("used in", *heads), tuple(rows)),
        Table(
            "Share of rows that the online gate lets it correct",
            ("used in", "share", "independent program"),
            tuple(shares),
        ),
        *matrices,
    ]


def figures(outcome: Outcome) -> list[Chart]:
    """What the online gate saves."""
    return [
        Chart(
            f"A CMAC from calibrated noise, used elsewhere{word}",
            "Speed, mean square error over that of the design filter alone, with 95 % intervals; right of 1 it does harm.",
            f"MSE over that of {DESIGN}",
            {scenario: outcome.ratio(named(scenario), "speed", name, over=DESIGN) for scenario in SCENARIOS},
            log=True,
        )
        for name, word in ((FIXED, ""), (GATED, ", gated online"))
    ]


HARMFUL = ("matched", "outliers")
"""Where the CMAC from `calibrated` does harm beyond doubt, in an independent program too."""


def _harm_left(scenario: str, expected: Tolerance) -> Check:
    """How much of the error that the CMAC adds is left behind the gate."""

    def found(outcome: Outcome) -> Measured:
        alone, fixed, gated = (outcome.values(named(scenario), name, "speed") for name in (DESIGN, FIXED, GATED))
        return ratio_interval(gated - alone, fixed - alone)

    return Check(f"share of the harm to the speed that is left, {named(scenario)}", found, expected)


CLAIMS = (
    Claim(
        "adapts (C6)",
        "The trained CMAC adapts the filter to disturbances it was not trained for.",
        "in words",
        tuple(
            ratio("speed", named(scenario), FIXED, DESIGN, below(1.0))
            for scenario in ("matched", "outliers", "timevarying", "manoeuvre", "coloured")
        ),
        {
            "partly": "It is a fixed function of the innovation: with the noise of the design it makes the squared error "
            "in speed more than ten times as large, with outliers about ten times."
        },
    ),
    Claim(
        "generalises (C4)",
        "The CMAC generalises better than a perceptron.",
        "in words",
        tuple(
            ratio("speed", named(scenario), FIXED, FIXED_MLP, below(1.0))
            for scenario in SCENARIOS
            if scenario != "calibrated"
        ),
        {"partly": "Elsewhere both fail, and neither is always the less bad."},
    ),
    Claim(
        "the online gate",
        "A gate that asks the innovations whether the correction has been of use keeps most of the harm away.",
        "not in the paper",
        (
            *(_harm_left(scenario, below(0.5)) for scenario in HARMFUL),
            *(
                ratio("speed", named(scenario), GATED, DESIGN, below(1.0))
                for scenario in SCENARIOS
                if scenario not in HARMFUL
            ),
            # What would pass by chance where nothing is to be corrected.
            mean("share corrected in matched", named("matched"), GATED, "passed", below(0.05)),
        ),
        {"reproduced": "And the good where there is some. Where outliers come a little of the harm is left."},
    ),
)


def chapter() -> Chapter:
    """Every scenario, with networks from all."""
    return Chapter(tuple(map(experiment, SCENARIOS)), CLAIMS, tables, figures)
