"""Which fault it is, decided at the first alarm and after it."""

from __future__ import annotations

import functools
from collections.abc import Callable

import jax
import numpy as np

from ...faults import Isolability, actuator_offset, explain, extend_prior, isolability, with_faults
from ...faults.explanation import MARGIN
from ...plants import RigidSpacecraft, fly, spacecraft_model
from ...plants.rigid_spacecraft import FILTER_STEP as STEP
from ...plants.wheels import wheel_names
from ...running import make_log, make_prior
from ..chapter import Chapter
from ..claims import Check, Claim, above, below, between
from ..figures import Chart, Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, exactly, median_interval, share_interval
from .scenarios import DEGREE, OFFSET, SCENARIOS, quiet_craft
from .signatures import ALARM, FOUND, PYRAMID, SIGNATURES, WAITS, WINDOW, bench, experiment, word

BRIEFLY = (0.0, 1.0, 2.0)  # s after the first alarm
SHOWN = 40.0
"""Leads beyond are as good as any."""


def pooled(outcome: Outcome, name: str, quantity: str, kind: str = "") -> Measured:
    """The share of flights, over runs and faults of a kind (all of them by default), or the median of a delay."""
    chosen = [fault.name for fault in bench(name).faults if fault.kind == kind or not kind]
    values = np.concatenate([outcome.values(name, each, quantity) for each in chosen])
    return median_interval(values, unit="s") if quantity == "delay" else share_interval(values)


@functools.cache
def wheels_told_apart() -> Isolability:
    """What a flight without a fault could tell of constant offsets of the four wheels."""
    offsets = [actuator_offset(f"torque_{name}", sigma=OFFSET.bound) for name in wheel_names(4)]
    wheels = bench(PYRAMID).craft.wheels
    craft = quiet_craft(wheels=wheels)
    model = with_faults(spacecraft_model(RigidSpacecraft(wheels=wheels)), offsets)
    flight = fly(craft, key=jax.random.key(0), duration=10.0)
    log = make_log(model, np.asarray(flight.t), np.asarray(flight.y), np.asarray(flight.u))
    start = make_prior(model.base, flight.truth[0], [10.0 * DEGREE] * 6)
    return isolability(model, extend_prior(model, start), log)


def said(outcome: Outcome, name: str, fault: str, wait: float) -> str:
    """What is said of a fault in the first run, so long after the first alarm."""
    scores = outcome.trace(name, fault, "scores").first
    first = int(np.argmax(scores.max(axis=1) > ALARM))
    names = [each.name for each in bench(name).faults]
    return explain(names, scores[min(first + round(wait / STEP), len(scores) - 1)]).sentence


def tables(outcome: Outcome) -> list[Table]:
    """How often the axis and the fault are right, what is said, and the same for four wheels."""
    flights = sum(len(outcome.values(SIGNATURES, each.name, "delay")) for each in bench(SIGNATURES).faults)
    what = ("group", "right", "certain", "misled")
    heads = ("right axis", "right fault leads", "right fault named alone", "wrong fault named alone")
    decided = Table(
        f"Nine signatures, {flights} flights: what the bank of jumps decides",
        ("when", *heads),
        tuple((word(wait), *(pooled(outcome, SIGNATURES, f"{each}_{wait:g}") for each in what)) for wait in WAITS),
    )
    kinds = Table(
        "Nine signatures by kind",
        ("kind", "delay of the first alarm [s]", *(f"right, {word(wait)}" for wait in BRIEFLY)),
        tuple(
            (
                scenario.title,
                pooled(outcome, SIGNATURES, "delay", scenario.kind),
                *(pooled(outcome, SIGNATURES, f"right_{wait:g}", scenario.kind) for wait in BRIEFLY),
            )
            for scenario in SCENARIOS
        ),
    )
    words = Table(
        "What is said of the x axis in the first flight",
        ("fault", *map(word, (0.0, 2.0))),
        tuple(
            (name, *(said(outcome, SIGNATURES, name, wait) for wait in (0.0, 2.0)))
            for name in (f"{scenario.kind}_{scenario.signals[0]}" for scenario in SCENARIOS)
        ),
    )
    pyramid = Table(
        "Four wheels in a pyramid",
        (
            "fault",
            "delay of the first alarm [s]",
            "right wheel at once",
            "right fault at once",
            "right fault 2 s later",
        ),
        tuple(
            (
                fault.name,
                *(outcome.summary(PYRAMID, fault.name, each) for each in ("delay", "group_0", "right_0", "right_2")),
            )
            for fault in bench(PYRAMID).faults
        ),
    )
    told = wheels_told_apart().information
    rank = Table(
        "Offsets of four wheels at the same time",
        ("faults", "observed", "not observed"),
        ((len(told.names), told.rank, ", ".join(told.unobserved)),),
    )
    return [decided, kinds, words, pyramid, rank]


def lead(outcome: Outcome, fault: str) -> np.ndarray:
    """By how much the right fault leads its strongest rival in the first flight, row by row from the onset on."""
    scores = outcome.trace(SIGNATURES, fault, "scores").first
    right = [each.name for each in bench(SIGNATURES).faults].index(fault)
    return scores[:, right] - np.delete(scores, right, axis=1).max(axis=1)


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """How the right explanation leaves the others behind, and how often it leads."""
    panels = []
    for scenario in SCENARIOS:
        leads = {
            axis: lead(outcome, f"{scenario.kind}_{name}") for axis, name in zip("xyz", scenario.signals, strict=True)
        }
        t = STEP * np.arange(len(leads["x"]))
        lines = [Line(f"about {axis}", t, np.clip(values, -SHOWN, SHOWN)) for axis, values in leads.items()]
        margin = Line("enough to be named alone", t, np.full(len(t), MARGIN), reference=True)
        panels.append(Panel(scenario.title, (*lines, margin)))
    return [
        Figure(
            "How far the right fault leads",
            "Twice the log likelihood ratio of the right fault less that of its strongest rival after the onset at 40 s, in "
            f"one flight per fault, cut at {SHOWN:g}. Offset and loss of a wheel explain the data alike until the command has "
            "changed; a gyro's bias stands out at once.",
            tuple(panels),
            "time since the onset [s]",
        ),
        Chart(
            "The right fault leads",
            "Share of flights over nine faults, with 95 % intervals.",
            "share",
            {word(wait): pooled(outcome, SIGNATURES, f"right_{wait:g}") for wait in WAITS},
        ),
    ]


def _share(name: str, quantity: str, kind: str = "") -> Callable[[Outcome], Measured]:
    return lambda outcome: pooled(outcome, name, quantity, kind)


def _offset_or_loss(quantity: str) -> Callable[[Outcome], Measured]:
    """The share over faults of wheels alone."""

    def found(outcome: Outcome) -> Measured:
        chosen = [fault.name for fault in bench(SIGNATURES).faults if fault.kind != "bias"]
        return share_interval(np.concatenate([outcome.values(SIGNATURES, each, quantity) for each in chosen]))

    return found


def _delay(kind: str, chosen: Callable[[list[float]], float]) -> Callable[[Outcome], Measured]:
    """Of the four wheels' median delays the least or the greatest."""

    def found(outcome: Outcome) -> Measured:
        names = [fault.name for fault in bench(PYRAMID).faults if fault.kind == kind]
        delays = [float(np.median(outcome.values(PYRAMID, name, "delay"))) for name in names]
        return exactly(chosen(delays), "s")

    return found


def _rank(outcome: Outcome) -> Measured:
    return exactly(wheels_told_apart().information.rank)


OURS = "not in the paper"
CLAIMS = (
    Claim(
        "axis at the first alarm",
        "The first alarm of a bank of nine jumps tells the axis of the fault.",
        OURS,
        (Check("right axis at the first alarm", _share(SIGNATURES, "group_0"), above(0.95)),),
    ),
    Claim(
        "offset or loss",
        "Offset and loss of a wheel cannot be told apart until the command has changed; then they can.",
        OURS,
        (
            Check("right fault leads at the first alarm, wheels", _offset_or_loss("right_0"), between(0.3, 0.8)),
            Check("right fault leads 2 s later, wheels", _offset_or_loss("right_2"), above(0.85)),
            Check("right fault leads at the first alarm, gyro", _share(SIGNATURES, "right_0", "bias"), above(0.85)),
            Check("wrong fault named alone at the first alarm", _share(SIGNATURES, "misled_0"), below(0.1)),
        ),
    ),
    Claim(
        "four wheels",
        "Of four wheels in a pyramid the first alarm tells the faulty one, though only three offsets can be told at once; a "
        "loss is found late where the wheel has little to do.",
        OURS,
        (
            Check("right wheel at the first alarm", _share(PYRAMID, "group_0"), above(0.9)),
            Check("median delay of the slowest wheel, offset [s]", _delay("offset", max), below(0.3)),
            Check("median delay of the quickest wheel, loss [s]", _delay("loss", min), below(0.5)),
            Check("median delay of the slowest wheel, loss [s]", _delay("loss", max), above(1.0)),
            Check("offsets observed at the same time", _rank, between(3, 3)),
        ),
    ),
)


def chapter() -> Chapter:
    """Which fault it is, decided at the first alarm and after it."""
    return Chapter(
        (
            experiment(SIGNATURES, "Nine signatures: which fault"),
            experiment(PYRAMID, "Four wheels in a pyramid: which wheel"),
        ),
        CLAIMS,
        tables,
        figures,
        (
            f"Isolation: faults begin at {FOUND:g} s, onsets are looked back on for {WINDOW * STEP:g} s, an alarm is a "
            f"statistic above {ALARM:g}, and a fault is named alone if it leads by {MARGIN:g}; the bank takes no jump into "
            "its estimate, so that hypotheses can be compared after the alarm.",
            "Four wheels: at the onset wheels 1 and 4 are commanded about -0.006 and 0.005 N m, 2 and 3 five times that.",
        ),
    )
