"""Slews that need nearly all the torque there is: braking in time, and integrals that do not wind up."""

from __future__ import annotations

import dataclasses

from ...control import Guardrails, StateFeedback
from ..chapter import Chapter
from ..claims import Claim, above, below
from ..figures import Figure, Panel, Table
from ..outcome import Outcome
from .contenders import (
    BRAKING_SHARE,
    FROZEN,
    Flight,
    Inverse,
    Networks,
    Rival,
    compensation,
    learning,
    rate_command,
    settings,
)
from .flights import first, flown, lost, over
from .laws import integral_regulator, pd, pid
from .scenarios import AGGRESSIVE, AXES, CALM, OFF_NOMINAL, WIDE, plant
from .training import AFFINE, BILINEAR, KINDS, RBF
from .tuning import CHOSEN, LQI, PD, PID

SATURATION, FAST = "saturation", "fast-slews"
NO_BRAKING, LATE_BRAKING, BRAKING = "network, no braking", "network, braking 0.4", "network, braking 0.2"
BILINEAR_BRAKING, AFFINE_BRAKING = "bilinear law, braking 0.2", "affine law, braking 0.2"
GUARDED = "network, no braking, all guards"
PD_NAME, PID_NAME, LQI_NAME = "PD", "PID", "LQI"
LQI_WOUND = "LQI, integral winds up"
FALL_BACK = 0.05  # rad
FROZEN_NAMES = {RBF: "network, frozen", BILINEAR: "bilinear law, frozen", AFFINE: "affine law, frozen"}


def contenders(flight: Flight) -> dict[str, Inverse | Rival]:
    """Inverses with and without braking, and rivals with and without anti-windup."""
    slews = AGGRESSIVE

    def network(braking: float | None, **options: object) -> Inverse:
        kind = options.pop("kind", RBF)
        command = rate_command(slews=slews, braking=braking)
        chosen = settings(command, learns=learning(1e-6), compensated=compensation(), **options)  # type: ignore[arg-type]
        return Inverse(flight, chosen, kind)  # type: ignore[arg-type]

    integral = integral_regulator(*CHOSEN[LQI], slews=slews)
    computed = pid(*CHOSEN[PID], slews=slews)
    return {
        NO_BRAKING: network(None),
        LATE_BRAKING: network(2 * BRAKING_SHARE),
        BRAKING: network(BRAKING_SHARE),
        BILINEAR_BRAKING: network(BRAKING_SHARE, kind=BILINEAR),
        AFFINE_BRAKING: network(BRAKING_SHARE, kind=AFFINE),
        GUARDED: network(None, guardrails=Guardrails(largest_error=FALL_BACK), fallback=computed),
        PD_NAME: Rival(flight, pd(*CHOSEN[PD], slews=slews)),
        PID_NAME: Rival(flight, computed),
        LQI_NAME: Rival(flight, integral),
        LQI_WOUND: Rival(flight, _winding(integral)),
    }


def _winding(controller: StateFeedback) -> StateFeedback:
    return dataclasses.replace(controller, anti_windup=False)


def fast(flight: Flight) -> dict[str, Inverse]:
    """Frozen laws on the nominal spacecraft: what the gyroscopic torques of fast slews ask of a model."""
    chosen = settings(rate_command(slews=AGGRESSIVE), learns=FROZEN)
    return {FROZEN_NAMES[kind]: Inverse(flight, chosen, kind) for kind in KINDS}


def tables(outcome: Outcome) -> list[Table]:
    """Errors and losses."""
    chosen = (*(f"rms_{axis}" for axis in AXES), "peak_pitch", "saturated", "lost", "fallen_back")
    return [
        outcome.table(SATURATION, chosen, title="Fast slews of the off-nominal spacecraft: 29 of 30 N m needed, 90 s"),
        outcome.table(
            FAST,
            ("rms_roll", "rms_pitch", "rms_yaw", "step"),
            title="Fast slews of the nominal spacecraft, frozen laws",
        ),
    ]


def figures(outcome: Outcome) -> list[Figure]:
    """Errors and torques about roll."""
    shown = (NO_BRAKING, BRAKING, GUARDED, PID_NAME)
    return [
        Figure(
            "At the limit of the torque",
            "Error and torque about roll, first run. A command that asks for a rate in proportion to the error asks "
            "for more deceleration than there is; one along a braking curve does not.",
            (
                Panel("error of roll", tuple(first(outcome, SATURATION, name, "error", 0) for name in shown), "mrad"),
                Panel(
                    "torque about roll", tuple(first(outcome, SATURATION, name, "torques", 0) for name in shown), "N m"
                ),
            ),
        )
    ]


CLAIMS = (
    Claim(
        "saturated torques",
        "The inverse flies slews that need nearly all of the torque.",
        "not in the publication, which bounds no torque",
        (lost(SATURATION, NO_BRAKING, below(0.2)), lost(SATURATION, BRAKING, below(0.2))),
        {"partly": "With a braking curve in its command, and not without."},
    ),
    Claim(
        "braking",
        "A braking curve is what saves it, whatever the model.",
        "not in the publication",
        (
            lost(SATURATION, NO_BRAKING, above(0.8)),
            *(lost(SATURATION, name, below(0.2)) for name in (LATE_BRAKING, BRAKING, BILINEAR_BRAKING, AFFINE_BRAKING)),
        ),
    ),
    Claim(
        "windup",
        "Integral laws need their integral held at the limit.",
        "not in the publication",
        (lost(SATURATION, LQI_WOUND, above(0.8)), lost(SATURATION, LQI_NAME, below(0.2))),
        {
            "partly": "Let go, it tumbles. Held, it comes back from where the torque has left it behind, but that is "
            "more than the 100 mrad that count as lost: a law that slows down in time does not get there."
        },
    ),
    Claim(
        "products of inputs",
        "On fast slews products of the inputs make the model better than an affine one; kernels add nothing.",
        "in words: nonlinear systems",
        (
            over(FAST, "rms_pitch", FROZEN_NAMES[RBF], FROZEN_NAMES[AFFINE], below(0.7), what="RMS of pitch"),
            over(FAST, "rms_pitch", FROZEN_NAMES[BILINEAR], FROZEN_NAMES[AFFINE], below(0.7), what="RMS of pitch"),
            over(FAST, "rms_pitch", FROZEN_NAMES[BILINEAR], FROZEN_NAMES[RBF], below(1.1), what="RMS of pitch"),
        ),
    ),
)


def chapter() -> Chapter:
    """Fast slews."""
    off = Flight(plant(OFF_NOMINAL, CALM), AGGRESSIVE)
    nominal = Flight(plant(), AGGRESSIVE)
    networks = Networks(KINDS, WIDE)
    experiments = (
        flown(
            SATURATION,
            "Fast slews, off-nominal",
            contenders(off),
            simulate=networks,
            statistic="median",
            baseline=LQI_NAME,
        ),
        flown(FAST, "Fast slews, nominal", fast(nominal), simulate=networks),
    )
    return Chapter(experiments, CLAIMS, tables, figures)
