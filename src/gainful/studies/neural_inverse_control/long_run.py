"""A quarter of an hour: what forgetting, walking and guards do to weights that learn all the time."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...control import Guardrails
from ...regression import WeightFilter
from ..chapter import Chapter
from ..claims import Check, Claim, below
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, ratio_interval
from .contenders import FROZEN, Flight, Inverse, compensation, learning, rate_command, settings
from .flights import flown, lost, over
from .laws import pid
from .scenarios import CONSTANT, LONGEST, OFF_NOMINAL, plant
from .tuning import CHOSEN, PID

LONG_RUN = "long-run"
RUNS = 6
"""Networks: each flight takes ten times as long as elsewhere."""
LATE = (810.0, 900.0)  # s
STILL, COMPENSATED, PAPER = "frozen", "frozen, compensated", "learning, q = 0"
WALKS = {"q = 1e-6": 1e-6, "q = 1e-4": 1e-4, "q = 1e-2": 1e-2}
SLOW, FAST, CAPPED = "forgetting 0.999", "forgetting 0.99", "forgetting 0.99, trace capped"
GUARDED = "forgetting 0.99, all guards"
CAP = 1e4
"""Trace of the weights' covariance above which nothing is forgotten, where it is capped."""
FALL_BACK = 0.05  # rad
"""Error of an angle from which the fallback acts, where there is one."""


def contenders(flight: Flight) -> dict[str, Inverse]:
    """By what happens to the weights."""
    command = rate_command()

    def network(learns: WeightFilter, mean: str = "exponential", **options: object) -> Inverse:
        return Inverse(flight, settings(command, learns=learns, compensated=compensation(mean), **options))  # type: ignore[arg-type]

    guards = Guardrails(largest_error=FALL_BACK)
    return {
        STILL: network(FROZEN, "none"),
        COMPENSATED: network(FROZEN),
        PAPER: network(learning()),
        **{name: network(learning(walk)) for name, walk in WALKS.items()},
        SLOW: network(learning(forgetting=0.999)),
        FAST: network(learning(forgetting=0.99)),
        CAPPED: network(learning(forgetting=0.99, trace_cap=CAP)),
        GUARDED: network(learning(forgetting=0.99, trace_cap=CAP), guardrails=guards, fallback=pid(*CHOSEN[PID])),
    }


def tables(outcome: Outcome) -> list[Table]:
    """Errors at the end, and what became of the covariance."""
    chosen = ("late", "late_step", "lost", "trace", "fallen_back")
    return [outcome.table(LONG_RUN, chosen, title="Off-nominal spacecraft with a constant disturbance, 900 s")]


def figures(outcome: Outcome) -> list[Figure]:
    """Trace and error over time."""
    names = (PAPER, *WALKS, SLOW, FAST, CAPPED)

    def line(name: str, trace: str) -> Line:
        t, values = (outcome.trace(LONG_RUN, name, each).first for each in ("t", trace))
        size = values if values.ndim == 1 else np.sqrt(np.mean(values**2, axis=1))
        return Line(name, t, np.where(np.isfinite(size), size, np.nan))

    return [
        Figure(
            "A quarter of an hour",
            "First run. Forgetting without excitation lets the covariance grow without bound: sooner or later noise "
            "moves the weights anywhere. A cap on its trace, or a walk in place of forgetting, does not.",
            (
                Panel("trace of the weights' covariance", tuple(line(name, "trace") for name in names), log=True),
                Panel("error over the axes", tuple(line(name, "error") for name in names), "mrad", log=True),
            ),
        )
    ]


def _growth(outcome: Outcome, contender: str) -> Measured:
    trace = outcome.every(LONG_RUN, contender, "trace")
    return ratio_interval(trace[:, -1], trace[:, 1])


CLAIMS = (
    Claim(
        "stable in the long run",
        "Weights that go on learning keep the spacecraft for a quarter of an hour.",
        "not in the publication, whose runs are short",
        tuple(lost(LONG_RUN, name, below(0.5)) for name in (PAPER, *WALKS, CAPPED, GUARDED)),
    ),
    Claim(
        "forgetting alone",
        "Forgetting is a safe way to follow changes.",
        "not in the publication",
        (
            lost(LONG_RUN, FAST, below(0.4)),
            Check(
                f"trace at the end over that at the beginning, {SLOW}",
                lambda outcome: _growth(outcome, SLOW),
                below(10.0),
            ),
        ),
        {
            "not reproduced": "The covariance winds up where the flight does not excite it: fast forgetting loses the "
            "spacecraft, slow forgetting is on its way there.",
            "partly": "The covariance winds up where the flight does not excite it.",
        },
    ),
    Claim(
        "capped forgetting",
        "A cap on the covariance's trace makes forgetting safe.",
        "not in the publication",
        (
            lost(LONG_RUN, CAPPED, below(0.5)),
            over(LONG_RUN, "late", CAPPED, PAPER, below(3.0), what="RMS of the last slews"),
        ),
    ),
    Claim(
        "guards cost nothing",
        "Guards that never act change nothing.",
        "not in the publication",
        (
            Check(
                f"share of flights in which the fallback acts, {GUARDED}",
                lambda outcome: outcome.share(LONG_RUN, GUARDED, "fallen_back"),
                below(0.5),
            ),
            over(LONG_RUN, "late", GUARDED, CAPPED, below(1.2), what="RMS of the last slews"),
        ),
    ),
)


def chapter() -> Chapter:
    """Twenty slews."""
    flight = Flight(plant(OFF_NOMINAL, CONSTANT), duration=LONGEST)
    experiment = flown(LONG_RUN, "A quarter of an hour", contenders(flight), late=LATE, most_runs=RUNS)
    return Chapter((dataclasses.replace(experiment, kept=("trace",)),), CLAIMS, tables, figures)
