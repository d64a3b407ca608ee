"""The inverse of a network beside laws that an engineer would try first, all tuned alike, at equal effort."""

from __future__ import annotations

from ..chapter import Chapter
from ..claims import Claim, above, below
from ..figures import Chart, Figure, Panel, Table
from ..outcome import Outcome
from ..statistics import mean_interval
from .contenders import FROZEN, PANEL_GAIN, Flight, Inverse, Rival, compensation, rate_command, settings
from .flights import all_axes, all_axes_over, first, flown, over
from .laws import incremental
from .scenarios import AXES, DISTURBANCE, OFF_NOMINAL, plant
from .tuning import AFFINE_LAW, BILINEAR_LAW, CHOSEN, INDI, LQI, LQR, NETWORK, PD, PID, law

RIVALS = "rivals"
NAMES = {
    PD: "PD with feed-forward",
    LQR: "LQR, hub and panel",
    PID: "PID, computed torque",
    LQI: "LQI, hub and panel",
    INDI: "incremental inversion",
}
STILL, STILL_COMPENSATED = "network, frozen", "network, frozen, compensated"
LEARNS, BILINEAR_LEARNS, AFFINE_LEARNS = "network, learning", "bilinear law, learning", "affine law, learning"
LEARNS_STIFF, INDI_STIFF = f"{LEARNS}, panel left alone", f"{NAMES[INDI]}, panel left alone"
LEFT_ALONE = (0.0, 0.0, 0.0)


def contenders(flight: Flight) -> dict[str, Inverse | Rival]:
    """All of them, as tuned."""
    command = rate_command(contraction=CHOSEN[NETWORK][1])

    def frozen(mean: str) -> Inverse:
        return Inverse(flight, settings(command, learns=FROZEN, compensated=compensation(mean)))

    laws = {title: law(name, CHOSEN[name], flight) for name, title in NAMES.items()}
    return {
        **laws,
        INDI_STIFF: Rival(flight, incremental(CHOSEN[INDI][0], LEFT_ALONE)),
        STILL: frozen("none"),
        STILL_COMPENSATED: frozen("exponential"),
        LEARNS: law(NETWORK, CHOSEN[NETWORK], flight),
        LEARNS_STIFF: law(NETWORK, CHOSEN[NETWORK], flight, LEFT_ALONE),
        BILINEAR_LEARNS: law(BILINEAR_LAW, CHOSEN[BILINEAR_LAW], flight),
        AFFINE_LEARNS: law(AFFINE_LAW, CHOSEN[AFFINE_LAW], flight),
    }


def tables(outcome: Outcome) -> list[Table]:
    """Errors, effort and panel."""
    chosen = (*(f"rms_{axis}" for axis in AXES), "step", "panel", "lost")
    title = "Off-nominal and disturbed spacecraft, 90 s, all tuned for the least error within a torque step of 1 N m"
    return [outcome.table(RIVALS, chosen, title=title)]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """Errors of all axes, and pitch of one flight."""
    names = outcome.results[RIVALS].experiment.contenders
    shown = (NAMES[PID], NAMES[LQI], STILL_COMPENSATED, LEARNS)
    return [
        Chart(
            "Beside what an engineer would try first",
            "Root mean square error over the three axes at equal effort, the spacecraft heavier by a fifth than any "
            "of them was told.",
            "RMS of all axes",
            {name: mean_interval(all_axes(outcome, RIVALS, name), unit="mrad") for name in names},
            "mrad",
            telling=True,
        ),
        Figure(
            "One of the flights",
            "Errors of roll and pitch of the first run.",
            tuple(
                Panel(f"error of {axis}", tuple(first(outcome, RIVALS, name, "error", k) for name in shown), "mrad")
                for k, axis in enumerate(AXES[:2])
            ),
        ),
    ]


CLAIMS = (
    Claim(
        "better than linear control",
        "The network's inverse is more accurate than tuned linear control at the same effort.",
        "not compared in the publication",
        (
            all_axes_over(RIVALS, LEARNS, NAMES[PD], below(0.8)),
            all_axes_over(RIVALS, LEARNS, NAMES[LQR], below(0.8)),
            all_axes_over(RIVALS, LEARNS, NAMES[PID], below(0.8)),
            all_axes_over(RIVALS, LEARNS, NAMES[LQI], below(0.8)),
            all_axes_over(RIVALS, LEARNS, NAMES[INDI], below(0.8)),
        ),
        {
            "partly": "Better than laws without an integral. An integral, or the increment of the torque, takes care of a "
            "disturbance and of a fifth more inertia as well."
        },
    ),
    Claim(
        "the network needs to learn",
        "Frozen weights with compensation do as well as weights that learn.",
        "not in the publication",
        (all_axes_over(RIVALS, STILL_COMPENSATED, LEARNS, below(1.1)),),
        {"not reproduced": "What the model is wrong about by a factor, no mean of its error makes up for."},
    ),
    Claim(
        "kernels, in flight",
        "Radial basis functions learn what regressions cannot.",
        "in words",
        (
            all_axes_over(RIVALS, LEARNS, BILINEAR_LEARNS, below(0.9)),
            all_axes_over(RIVALS, LEARNS, AFFINE_LEARNS, below(0.9)),
        ),
        {"not reproduced": "An affine law of 16 weights learns the same on these slews."},
    ),
    Claim(
        "panel and hub",
        "Damping the panel costs accuracy of the hub.",
        "not in the publication, which leaves the panel swinging",
        (
            over(RIVALS, "rms_roll", LEARNS, LEARNS_STIFF, above(1.5), what="RMS of roll"),
            over(RIVALS, "panel", LEARNS, LEARNS_STIFF, below(0.5), what="panel residual"),
        ),
        {
            "reproduced": "A hub that gives way to the panel follows its slew less closely; one that does not leaves it "
            "swinging for an hour."
        },
    ),
)


def chapter() -> Chapter:
    """Who flies best at equal effort."""
    flight = Flight(plant(OFF_NOMINAL, DISTURBANCE))
    experiment = flown(RIVALS, "Rivals at equal effort", contenders(flight), baseline=NAMES[LQI])
    return Chapter(
        (experiment,),
        CLAIMS,
        tables,
        figures,
        (
            f"All laws are tuned by grid on networks and noise that the study does not use; the panel's gain of the rate "
            f"command, "
            f"{', '.join(f'{each:g}' for each in PANEL_GAIN)} 1/(m s), and the gain of the scaled inputs were chosen by "
            f"hand on "
            "this spacecraft: take differences below a fifth for ties.",
        ),
    )
