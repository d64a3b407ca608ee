"""The nominal spacecraft follows its slews: the publication's figures 2 and 3."""

from __future__ import annotations

from ..chapter import Chapter
from ..claims import Claim, above, below
from ..figures import Figure, Panel, Table
from ..outcome import Outcome
from .contenders import Flight, Inverse, rate_command, settings
from .flights import all_axes_over, first, flown, lost, mean, wanted
from .ladder import AFFINE_RATES, LADDER, PRINTED, RATE_MODE
from .scenarios import plant

TRACKING = "tracking"
CLEAN, NOISY, JOINT = "rate mode, no noise", "rate mode", "rate mode, Gauss-Newton"
SLEW_ROLL = 349.066  # mrad
PEAK_ROLL_RATE = 21.817  # mrad/s
SCALE_OF_PLOTS = 0.01
"""A curve within this share of its range cannot be told from another."""


def tables(outcome: Outcome) -> list[Table]:
    """Errors of the angles and of the rates."""
    chosen = ("rms_roll", "rms_pitch", "rms_yaw", "peak_roll", "rate_roll", "rate_pitch", "step", "panel", "lost")
    return [outcome.table(TRACKING, chosen, title="Nominal spacecraft, 90 s")]


def figures(outcome: Outcome) -> list[Figure]:
    """Figures 2 and 3: roll and roll rate, and their errors."""
    out = []
    for number, trace, error, unit, what in (
        (2, "angles", "error", "mrad", "roll"),
        (3, "rates", "rate_error", "mrad/s", "roll rate"),
    ):
        asked = wanted(outcome, TRACKING, NOISY, f"wanted_{trace}", 0, "desired")
        errors = tuple(first(outcome, TRACKING, name, error, 0) for name in (NOISY, CLEAN))
        out.append(
            Figure(
                f"{what.capitalize()}, desired and actual: figure {number} of the paper",
                f"The {what} of the first run, and below it its error, with the noise of the sensors and without.",
                (
                    Panel(what, (first(outcome, TRACKING, NOISY, trace, 0), asked), unit),
                    Panel(f"error of the {what}", errors, unit),
                ),
            )
        )
    return out


CLAIMS = (
    Claim(
        "tracking (C1)",
        "Actual angles and rates follow the desired ones.",
        "figures 2 and 3, no numbers",
        (
            mean(TRACKING, "peak_roll", NOISY, below(SCALE_OF_PLOTS * SLEW_ROLL), what="peak error of roll [mrad]"),
            mean(
                TRACKING,
                "rate_roll",
                NOISY,
                below(SCALE_OF_PLOTS * PEAK_ROLL_RATE),
                what="RMS of the roll rate [mrad/s]",
            ),
            lost(TRACKING, NOISY, below(0.2)),
            lost(LADDER, PRINTED, below(0.2)),
        ),
        {
            "partly": "Scaled inputs, increments as outputs and a command that only the rates are asked to follow do it, to a "
            "few parts in 100,000 of the slew. With inputs in SI units, states as outputs and equal weights, as "
            "printed, the spacecraft tumbles."
        },
    ),
    Claim(
        "simple (C5)",
        "The algorithm is simple, with a single layer of weights: nothing simpler does it.",
        "in words",
        (
            mean(TRACKING, "peak_roll", CLEAN, below(SCALE_OF_PLOTS * SLEW_ROLL), what="peak error of roll [mrad]"),
            all_axes_over(LADDER, AFFINE_RATES, RATE_MODE, above(1.5)),
        ),
        {
            "partly": "One layer does it, and is cheap enough; but so does an affine law, with 16 weights per output in place "
            "of 200."
        },
    ),
)


def chapter() -> Chapter:
    """The slews on the spacecraft that the network was trained on."""
    quiet, noisy = Flight(plant(noise=0.0)), Flight(plant())
    experiment = flown(
        TRACKING,
        "Nominal spacecraft",
        {
            CLEAN: Inverse(quiet, settings(rate_command())),
            NOISY: Inverse(noisy, settings(rate_command())),
            JOINT: Inverse(noisy, settings(rate_command(), method="gauss-newton")),
        },
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
