"""The spacecraft loses most of its inertia in flight: who finds out, and who chatters."""

from __future__ import annotations

from ..chapter import Chapter
from ..claims import Claim, below
from ..experiment import Experiment
from ..figures import Chart, Figure, Panel, Table
from ..outcome import Outcome
from .contenders import FROZEN, TRACKING_WALK, Flight, Inverse, compensation, learning, rate_command, settings
from .flights import first, flown, lost, over
from .scenarios import lighter, plant
from .training import AFFINE, BILINEAR
from .tuning import CHOSEN, INDI, LQI, PID, law

GAIN_CHANGE, GAIN_RATIO = "gain-change", "gain-ratio"
ONSET, SHARE = 50.0, 0.35
"""When the inertia drops [s], and to what share of itself."""
RATIO = 2.05
"""Of true to modelled effectiveness, a little beyond what a one-step inverse without compensation stands."""
STILL, PAPER = "network, frozen, compensated", "network, learning, q = 0"
LEARNS, BILINEAR_LEARNS, AFFINE_LEARNS = "network, q = 1e-6", "bilinear law, q = 1e-6", "affine law, q = 1e-6"
CAREFUL = "affine law, q = 1e-6, contraction 0.5"
PID_NAME, LQI_NAME, INDI_NAME = "PID, computed torque", "LQI, hub and panel", "incremental inversion"
NONE, MEAN_ONLY, BOTH, HALF = "no compensation", "mean", "mean and variance", "no compensation, contraction 0.5"


def contenders(flight: Flight) -> dict[str, object]:
    """Inverses that learn or not, and the rivals."""
    command = rate_command()

    def network(learns: object, *, contraction: float = 1.0, **options: object) -> Inverse:
        own = command if contraction == 1 else rate_command(contraction=contraction)
        return Inverse(flight, settings(own, learns=learns, compensated=compensation()), **options)  # type: ignore[arg-type]

    return {
        STILL: network(FROZEN),
        PAPER: network(learning()),
        LEARNS: network(TRACKING_WALK),
        BILINEAR_LEARNS: network(TRACKING_WALK, kind=BILINEAR),
        AFFINE_LEARNS: network(TRACKING_WALK, kind=AFFINE),
        CAREFUL: network(TRACKING_WALK, kind=AFFINE, contraction=0.5),
        PID_NAME: law(PID, CHOSEN[PID], flight),
        LQI_NAME: law(LQI, CHOSEN[LQI], flight),
        INDI_NAME: law(INDI, CHOSEN[INDI], flight),
    }


def chatterers(flight: Flight) -> dict[str, Inverse]:
    """Frozen weights with and without compensation."""

    def frozen(kind: str, *, variance: bool = False, contraction: float = 1.0) -> Inverse:
        command = rate_command(contraction=contraction)
        return Inverse(flight, settings(command, learns=FROZEN, compensated=compensation(kind, variance=variance)))

    return {
        NONE: frozen("none"),
        MEAN_ONLY: frozen("exponential"),
        BOTH: frozen("exponential", variance=True),
        HALF: frozen("none", contraction=0.5),
    }


def tables(outcome: Outcome) -> list[Table]:
    """After the change, and at the edge of stability."""
    return [
        outcome.table(
            GAIN_CHANGE,
            ("late", "late_step", "peak_roll", "saturated", "lost"),
            title=f"Inertia down to {100 * SHARE:g} % at {ONSET:g} s",
        ),
        outcome.table(
            GAIN_RATIO,
            ("step_roll", "step", "rms_roll", "lost"),
            title=f"Frozen weights, torques {RATIO:g} times as effective as the network was told",
        ),
    ]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """Errors and torques about the change."""
    shown = (LQI_NAME, STILL, LEARNS, AFFINE_LEARNS)
    return [
        Figure(
            "The inertia drops to a third",
            "Error and torque about roll, first run. What is tuned for the old inertia chatters between the limits; "
            "what learns is through with it after some seconds, the sooner the less there is to learn.",
            (
                Panel("error of roll", tuple(first(outcome, GAIN_CHANGE, name, "error", 0) for name in shown), "mrad"),
                Panel(
                    "torque about roll", tuple(first(outcome, GAIN_CHANGE, name, "torques", 0) for name in shown), "N m"
                ),
            ),
            telling=True,
        )
    ]


CLAIMS = (
    Claim(
        "learning follows a change",
        "After a loss of two thirds of the inertia an inverse that learns is more accurate and calmer than any law "
        "that does not.",
        "not in the publication",
        (
            *(
                over(GAIN_CHANGE, "late_step", LEARNS, other, below(0.5), what="torque step after the change")
                for other in (PID_NAME, LQI_NAME, INDI_NAME)
            ),
            *(
                over(GAIN_CHANGE, "late", LEARNS, other, below(0.5), what="RMS after the change")
                for other in (PID_NAME, LQI_NAME, INDI_NAME)
            ),
            lost(GAIN_CHANGE, LEARNS, below(0.2)),
        ),
    ),
    Claim(
        "fewer weights learn faster",
        "An affine law is through with the change before a network is.",
        "not in the publication",
        (
            over(GAIN_CHANGE, "late_step", AFFINE_LEARNS, LEARNS, below(0.5), what="torque step after the change"),
            over(GAIN_CHANGE, "late_step", BILINEAR_LEARNS, LEARNS, below(0.5), what="torque step after the change"),
        ),
    ),
    Claim(
        "the published filter follows",
        "The weights' filter as published, without forgetting and walk, follows as well.",
        "equations 7 to 10",
        (over(GAIN_CHANGE, "late_step", PAPER, LEARNS, below(1.2), what="torque step after the change"),),
        {
            "not reproduced": "It has grown sure of what it learned on the ground, and chatters like weights that are frozen."
        },
    ),
    Claim(
        "divergence (C3)",
        "Compensation keeps the inverse from diverging.",
        "in words",
        (
            over(GAIN_RATIO, "step_roll", MEAN_ONLY, NONE, below(0.5), what="torque step of roll"),
            over(GAIN_RATIO, "step_roll", BOTH, NONE, below(0.5), what="torque step of roll"),
        ),
        {
            "not reproduced": "The iteration does not diverge in the first place, for it acts on the model. The loop "
            "does where the model is wrong about the effectiveness by more than its margin, and compensation takes "
            "from that."
        },
    ),
    Claim(
        "contraction",
        "A command that asks for half of the error per sample doubles the margin.",
        "not in the publication",
        (over(GAIN_RATIO, "step_roll", HALF, NONE, below(0.5), what="torque step of roll"),),
    ),
)


def chapter() -> Chapter:
    """A change in flight, and a constant error of the effectiveness."""
    changing = Flight(plant(after=lighter(SHARE), change=ONSET))
    wrong = Flight(plant(lighter(1.0 / RATIO)))
    experiments: tuple[Experiment, ...] = (
        flown(GAIN_CHANGE, "Loss of inertia", contenders(changing), baseline=LQI_NAME),  # type: ignore[arg-type]
        flown(GAIN_RATIO, "Wrong effectiveness", chatterers(wrong)),
    )
    return Chapter(experiments, CLAIMS, tables, figures)
