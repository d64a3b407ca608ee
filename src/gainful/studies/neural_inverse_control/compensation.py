"""What the running mean of the model's error is good for: the publication's figures 4 and 5, with and without learning."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...regression import WeightFilter
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, above, below
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, mean_interval, ratio_interval
from .contenders import FROZEN, TRACKING_WALK, Flight, Inverse, compensation, learning, rate_command, settings
from .flights import first, flown, over
from .scenarios import DISTURBANCE, LONG, OFF_NOMINAL, PERIOD, plant

COMPENSATION, CLEAN = "compensation", "compensation-clean"
NONE, MEAN, EXPONENTIAL, VARIANCE = "none", "plain mean", "exponential mean", "exponential mean and variance"
KINDS = {NONE: "none", MEAN: "mean", EXPONENTIAL: "exponential"}
STILL, PAPER, WALKING = "frozen", "learning, q = 0", "learning, q = 1e-6"
LEARNING: dict[str, WeightFilter] = {STILL: FROZEN, PAPER: learning(), WALKING: TRACKING_WALK}
PITCH = 1


def named(learns: str, kind: str) -> str:
    """A contender's name."""
    return f"{learns}; {kind}"


WITHOUT, WITH = named(STILL, NONE), named(STILL, EXPONENTIAL)


def contenders(flight: Flight) -> dict[str, Inverse]:
    """Three ways to learn by three ways to compensate, and the variance besides."""
    command = rate_command()
    out = {
        named(learns, kind): Inverse(flight, settings(command, learns=each, compensated=compensation(form)))
        for learns, each in LEARNING.items()
        for kind, form in KINDS.items()
    }
    told = compensation(variance=True)
    return out | {named(STILL, VARIANCE): Inverse(flight, settings(command, learns=FROZEN, compensated=told))}


def tables(outcome: Outcome) -> list[Table]:
    """Three by three, and the windows of the figures."""
    grid = [
        Table(
            f"RMS of {axis} over 180 s: off-nominal spacecraft, disturbed [mrad]",
            ("Weights", *KINDS),
            tuple(
                (learns, *(outcome.mean(COMPENSATION, named(learns, kind), f"rms_{axis}") for kind in KINDS))
                for learns in LEARNING
            ),
        )
        for axis in ("pitch", "roll")
    ]
    names = [f"{PERIOD * k:g} to {PERIOD * (k + 1):g} s" for k in range(4)]
    windowed = [
        Table(
            f"Mean absolute error of {what} by window, frozen weights, no noise [{unit}]",
            ("Compensation", *names),
            tuple(
                (kind, *(windows(outcome, CLEAN, named(STILL, kind), trace, k) for k in range(4)))
                for kind in (NONE, EXPONENTIAL)
            ),
        )
        for what, trace, unit in (("pitch", "windows", "mrad"), ("the pitch rate", "rate_windows", "mrad/s"))
    ]
    return [*grid, *windowed]


def windows(outcome: Outcome, experiment: str, contender: str, trace: str, k: int) -> Measured:
    """Mean absolute error of pitch in a window."""
    return mean_interval(outcome.every(experiment, contender, trace)[:, k, PITCH])


def figures(outcome: Outcome) -> list[Figure]:
    """Figures 4 and 5: errors of pitch and of its rate, with and without compensation."""
    out = []
    for number, trace, unit, what in ((4, "error", "mrad", "pitch"), (5, "rate_error", "mrad/s", "pitch rate")):
        panels = []
        for experiment, noise in ((CLEAN, "no noise"), (COMPENSATION, "with the sensors' noise")):
            lines = [first(outcome, experiment, name, trace, PITCH) for name in (WITHOUT, WITH)]
            named_so = ("without compensation", "with compensation")
            panels.append(
                Panel(
                    f"error of the {what}, {noise}",
                    tuple(Line(name, each.x, each.y) for name, each in zip(named_so, lines, strict=True)),
                    unit,
                )
            )
        out.append(
            Figure(
                f"Error of the {what} without and with compensation: figure {number} of the paper",
                "The first run, weights as they were trained on the nominal spacecraft; the one that is flown is "
                "heavier, and the disturbance grows.",
                tuple(panels),
            )
        )
    return out


def _grows(trace: str, contender: str, what: str, expected: Tolerance) -> Check:
    def found(outcome: Outcome) -> Measured:
        values = outcome.every(CLEAN, contender, trace)[..., PITCH]
        return ratio_interval(values[:, 3], values[:, 0])

    return Check(f"{what} in the last window over the first, no noise, {contender}", found, expected)


def _reduces(learns: str, expected: Tolerance, *, axis: str = "pitch", kind: str = EXPONENTIAL) -> Check:
    return over(
        COMPENSATION,
        f"rms_{axis}",
        named(learns, kind),
        named(learns, NONE),
        expected,
        what=f"RMS of {axis}",
    )


def _rate_reduces(k: int, expected: Tolerance) -> Check:
    def found(outcome: Outcome) -> Measured:
        return ratio_interval(*(outcome.every(CLEAN, name, "rate_windows")[:, k, PITCH] for name in (WITH, WITHOUT)))

    return Check(f"error of the pitch rate in window {k + 1}, no noise, with over without", found, expected)


CLAIMS = (
    Claim(
        "compensation (C2)",
        "Without compensation the error of the angle grows; with it, it stays small.",
        "figure 4, no numbers",
        (
            _grows("windows", WITHOUT, "error of pitch", above(1.5)),
            _grows("windows", WITH, "error of pitch", below(1.2)),
            _reduces(STILL, below(0.4)),
        ),
        {"reproduced": "For weights that stay as they were trained, under a torque that drifts."},
    ),
    Claim(
        "compensation beside learning",
        "The same where the weights go on learning.",
        "the publication learns and compensates together",
        (_reduces(PAPER, below(0.75)), _reduces(WALKING, below(0.9))),
        {
            "partly": "It helps a filter of the weights that has grown sure of itself. Weights that may walk have taken up all "
            "there is: the compensation finds nothing left."
        },
    ),
    Claim(
        "compensation, rate (C2')",
        "The same for the error of the rate.",
        "figure 5, no numbers",
        (
            _grows("rate_windows", WITHOUT, "error of the pitch rate", above(1.5)),
            *(_rate_reduces(k, below(0.9)) for k in range(4)),
            over(COMPENSATION, "rate_pitch", WITH, WITHOUT, below(0.9), what="RMS of the pitch rate with noise"),
        ),
        {
            "partly": "The error of the rate does not grow: a steady torque is held by a steady error of the angle. "
            "Compensation takes a little off, and with the gyro's noise nothing can be seen of it."
        },
    ),
    Claim(
        "the published mean",
        "The plain mean of all errors does as well as one that forgets.",
        "equations 21 to 24",
        tuple(
            over(
                COMPENSATION,
                "rms_pitch",
                named(learns, MEAN),
                named(learns, EXPONENTIAL),
                below(1.2),
                what="RMS of pitch",
            )
            for learns in (STILL, PAPER)
        ),
        {"not reproduced": "A mean over all of the past does not follow what drifts."},
    ),
    Claim(
        "the published variance",
        "The variance of the error in the inversion changes what is reached.",
        "equation 24",
        (
            Check(
                f"RMS of pitch, {named(STILL, VARIANCE)} over {WITH}, less 1, in size",
                lambda outcome: _size(outcome.ratio(COMPENSATION, "rms_pitch", named(STILL, VARIANCE), over=WITH)),
                above(0.02),
            ),
        ),
        {"not reproduced": "It is less than a thousandth of what it is added to."},
    ),
)


def _size(found: Measured) -> Measured:
    off = [found.low - 1.0, found.high - 1.0]
    low = 0.0 if off[0] < 0 < off[1] else float(np.abs(off).min())
    return Measured(abs(found.value - 1.0), low, float(np.abs(off).max()), found.runs)


def chapter() -> Chapter:
    """Off-nominal and disturbed, 180 s."""
    noisy, clean = (Flight(plant(OFF_NOMINAL, DISTURBANCE, noise=noise), duration=LONG) for noise in (1.0, 0.0))
    late = (PERIOD * 3, PERIOD * 4)
    all_of_them = contenders(noisy)
    quiet = {name: each for name, each in contenders(clean).items() if name in (WITHOUT, WITH, named(STILL, MEAN))}
    experiments = (
        flown(COMPENSATION, "Off-nominal and disturbed", all_of_them, late=late),
        flown(CLEAN, "Off-nominal and disturbed, no noise", quiet, late=late),
    )
    kept = tuple(dataclasses.replace(each, kept=("windows", "rate_windows")) for each in experiments)
    return Chapter(kept, CLAIMS, tables, figures)
