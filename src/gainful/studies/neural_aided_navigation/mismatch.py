"""Eight ways in which the truth differs from what the designer assumed: who is best where."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...plants import TRACK_SCENARIOS
from ..chapter import Chapter
from ..claims import Claim, above, below
from ..contender_table import cell, compared
from ..experiment import Experiment
from ..figures import Chart, Table
from ..outcome import Outcome
from ..prepared import Prepared
from ..statistics import difference_interval, mean_interval, ratio_interval
from .comparing import ratio
from .contenders import (
    ADAPTIVE,
    CMAC,
    CMAC_GATED,
    DESIGN,
    HUBER_ML,
    IMM,
    ML,
    ML_CMAC,
    ML_CMAC_GATED,
    ML_CMACS,
    ML_MLP,
    TRUE,
    TRUTH_TUNED,
    VB_R,
    common,
)
from .measures import STATES, UNITS, judged
from .records import SCENARIOS, Drive
from .route_map import MAPPED, mapped

TITLES = {
    "matched": "Noise as the design has it",
    "timevarying": "Noise that changes every 500 s",
    "manoeuvre": "Accelerations",
    "outliers": "Outliers",
    "coloured": "Coloured noise",
    "bias": "A constant bias",
    "map": "An error that repeats along the track",
}
TOLD = {
    "matched": {DESIGN: (0.147, 0.00074), CMAC: (0.150, 0.00077), ML: (0.147, 0.00074), ML_CMAC: (0.153, 0.00076)},
    "timevarying": {
        DESIGN: (1.72, 0.0266),
        CMAC: (1.65, 0.0257),
        ML: (1.14, 0.0059),
        ML_CMAC: (1.12, 0.0057),
        ML_MLP: (0.99, 0.0052),
        IMM: (0.96, 0.0052),
        VB_R: (1.08, 0.0057),
    },
    "manoeuvre": {
        DESIGN: (0.274, 0.470),
        CMAC: (0.0070, 0.0192),
        ML: (0.0616, 0.0133),
        ML_CMAC: (0.0065, 0.0125),
        ML_MLP: (0.0064, 0.0089),
        "strong tracking": (0.0101, 0.0107),
        TRUTH_TUNED: (0.0064, 0.0126),
    },
    "outliers": {
        DESIGN: (18.2, 0.031),
        CMAC: (16.5, 0.197),
        ML: (8.9, 0.0116),
        ML_CMAC: (4.5, 0.0100),
        ML_MLP: (1.6, 0.0086),
        IMM: (1.4, 0.0087),
    },
    "coloured": {
        DESIGN: (3.73, 0.0304),
        CMAC: (4.20, 0.0175),
        ML: (3.75, 0.0083),
        ML_CMAC: (3.84, 0.0085),
        ML_MLP: (4.03, 0.0085),
        VB_R: (3.75, 0.0083),
    },
    "bias": {DESIGN: (0.290, 0.0319), CMAC: (0.0072, 0.0156), ML: (0.256, 0.0076), ML_CMAC: (0.0065, 0.0080)},
    "map": {
        DESIGN: (1.62, 0.0306),
        CMAC: (1.60, 0.0149),
        ML: (1.59, 0.0078),
        ML_CMAC: (1.62, 0.0081),
        MAPPED: (0.0116, 0.0076),
    },
}
"""Mean square errors of an independent program, 100 other runs."""
ROWS = (
    DESIGN,
    CMAC,
    CMAC_GATED,
    ML,
    ML_CMAC,
    ML_CMAC_GATED,
    ML_CMACS,
    ML_MLP,
    *ADAPTIVE,
    HUBER_ML,
    TRUTH_TUNED,
    TRUE,
    MAPPED,
)
UNFAIR = (TRUE, TRUTH_TUNED)
"""They know what nobody knows, or were tuned to it."""
HALVES = (SCENARIOS[:4], SCENARIOS[4:])


def tables(outcome: Outcome) -> list[Table]:
    """Errors by scenario, who is best, what the offline gate decided, and the numbers of an independent program."""
    told = []
    for state in STATES:
        for half in HALVES:
            names = [name for name in ROWS if any(name in outcome.results[each].values for each in half)]
            columns = [(each, each, state) for each in half]
            told.append(compared(outcome, f"{state.capitalize()}, MSE [{UNITS[state]}]", names, columns))
    gates = [decisions(outcome, CMAC, CMAC_GATED, DESIGN), decisions(outcome, ML_CMAC, ML_CMAC_GATED, ML)]
    return [*told, best(outcome), *gates, independent(outcome)]


def best(outcome: Outcome) -> Table:
    """The least error of each scenario, and who cannot be told from it."""
    rows = []
    for scenario in SCENARIOS:
        values = {name: each for name, each in outcome.results[scenario].values.items() if name not in UNFAIR}
        for state, unit in UNITS.items():
            found = {name: each[state] for name, each in values.items() if np.isfinite(each[state]).all()}
            first = min(found, key=lambda name: found[name].mean())
            alike = [
                name
                for name, each in found.items()
                if name != first and not difference_interval(each, found[first]).low > 0
            ]
            rows.append(
                (
                    f"{scenario}, {state}",
                    first,
                    mean_interval(found[first], unit=unit),
                    ratio_interval(found[ML], found[first]),
                    _listed(alike),
                )
            )
    heads = ("scenario", "best", "MSE [m^2, m^2/s^2]", f"{ML}, over it", "not told from it, run by run")
    return Table("The best of each scenario, but for those that know the truth", heads, tuple(rows))


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:4])
    return f"{shown} and {len(names) - 4} more" if len(names) > 4 else shown or "nobody"


def decisions(outcome: Outcome, plain: str, gated: str, alone: str) -> Table:
    """What the offline gate let pass, and what came of the corrections on other records."""
    rows = []
    for scenario in SCENARIOS:
        row: list[object] = [scenario]
        for state in STATES:
            passed = outcome.values(scenario, gated, f"corrects_{state}").any()
            row += ["yes" if passed else "no", outcome.ratio(scenario, state, plain, over=alone)]
        rows.append(tuple(row))
    heads = [head for state in STATES for head in (f"{state}: accepted", f"MSE without the gate over {alone}")]
    return Table(
        f"Offline gate of {plain}, and what the correction does on the test runs", ("scenario", *heads), tuple(rows)
    )


def independent(outcome: Outcome) -> Table:
    """Numbers beside those of an independent program."""
    rows = []
    for scenario, numbers in TOLD.items():
        for name, told in numbers.items():
            row: list[object] = [f"{scenario}: {name}"]
            for state, number in zip(STATES, told, strict=True):
                row += [cell(outcome, scenario, name, state), number]
            rows.append(tuple(row))
    heads = [head for state, unit in UNITS.items() for head in (f"{state}, MSE [{unit}]", "independent program")]
    return Table("Scenarios, beside an independent program", ("filter", *heads), tuple(rows))


def figures(outcome: Outcome) -> list[Chart]:
    """Speed errors relative to the tuned filter, scenario by scenario."""
    names = (DESIGN, CMAC, ML_CMAC, ML_MLP, VB_R, IMM)
    return [
        Chart(
            f"Error in speed: {scenario}",
            "Mean square error over that of the filter whose noise was fitted to records without truth, on the same runs, with "
            "95 % intervals; left of 1 is better.",
            f"MSE over that of {ML}",
            {name: outcome.ratio(scenario, "speed", name, over=ML) for name in names},
            log=True,
            telling=scenario == "manoeuvre",
        )
        for scenario in SCENARIOS
    ]


CLAIMS = (
    Claim(
        "unknown noise (C7)",
        "Where the noise is not known the aided filter is better than the filter.",
        "the paper's conclusion",
        (
            *(
                ratio(state, scenario, CMAC, DESIGN, below(1.0))
                for scenario in SCENARIOS
                if scenario != "matched"
                for state in STATES
            ),
            *(ratio("speed", scenario, CMAC, ML, below(1.0)) for scenario in SCENARIOS if scenario != "matched"),
        ),
        {
            "partly": "Better than the filter as designed in most scenarios. In speed it is never better than the same filter "
            "with noise fitted to records, which asks for no truth."
        },
    ),
    Claim(
        "manoeuvres",
        "Told the history of innovations, a network beside the tuned filter is better than all that adapt where a body "
        "manoeuvres.",
        "not in the paper",
        tuple(
            ratio("speed", "manoeuvre", ML_MLP, each, below(1.0))
            for each in (ML, ML_CMAC, "strong tracking", IMM, VB_R, TRUTH_TUNED)
        ),
    ),
    Claim(
        "changing noise",
        "Told the history of innovations, it is as good as a bank of filters where noise changes, and better "
        "than the tuned filter.",
        "not in the paper",
        (
            ratio("speed", "timevarying", ML_MLP, ML, below(1.0)),
            # As good: within a tenth, to which a hundred runs tell these errors in an independent program.
            *(ratio(state, "timevarying", ML_MLP, IMM, below(1.1)) for state in STATES),
        ),
    ),
    Claim(
        "harmless elsewhere",
        "Where nothing is to be gained a network beside the tuned filter costs little.",
        "not in the paper",
        # An independent program's lost 1 to 2 %, and trainings differ by 2 %.
        tuple(
            ratio(state, scenario, ML_MLP, ML, below(1.05))
            for scenario in ("matched", "calibrated", "coloured", "bias")
            for state in STATES
        ),
    ),
    Claim(
        "the offline gate",
        "What the gate accepts on other records is an improvement, or nothing is corrected.",
        "not in the paper",
        tuple(
            ratio(state, scenario, gated, alone, below(1.0 + 1e-9))  # equal but for rounding where nothing is corrected
            for scenario in SCENARIOS
            for gated, alone in ((CMAC_GATED, DESIGN), (ML_CMAC_GATED, ML))
            for state in STATES
        ),
    ),
    Claim(
        "a map of the fixes",
        "An error that repeats along the track is learned as a map of the fixes and taken off them; a correction of the state "
        "cannot do that.",
        "not in the paper",
        (
            # Twice what an independent program left of it, 0.0116 of 1.59 m^2.
            ratio("displacement", "map", MAPPED, ML, below(0.015)),
            # All but 2 % of the error is the map's (0.030 of 1.62 m^2): who takes off no more has learned nothing of it.
            ratio("displacement", "map", CMAC, DESIGN, above(0.95)),
        ),
        {"reproduced": "The innovations do not show where the body is; the map does."},
    ),
)


def experiment(scenario: str) -> Experiment:
    """A scenario."""
    makers = common(scenario)
    if scenario == "map":
        makers[MAPPED] = mapped
    return judged(scenario, TITLES[scenario], Drive(TRACK_SCENARIOS[scenario]), Prepared(makers), baseline=ML)


def chapter() -> Chapter:
    """All scenarios but the paper's own, which has a chapter of its own."""
    return Chapter(tuple(map(experiment, TITLES)), CLAIMS, tables, figures)
