"""How well constant faults can be known at best, and what the filters cost as faults grow in number."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...diagnostics import StepCost, step_cost, step_seconds
from ...diagnostics.cost import Problem
from ...faults import (
    Isolability,
    actuator_offset,
    extend_prior,
    isolability,
    loss_of_effectiveness,
    sensor_bias,
    with_faults,
)
from ...filters import (
    KalmanFilter,
    extended_kalman_filter,
    two_stage_extended_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
)
from ...plants import RigidSpacecraft, Wheels, fly, spacecraft_model
from ...plants.rigid_spacecraft import FILTER_STEP as STEP
from ...plants.wheels import REGULAR_PYRAMID, wheel_names
from ...running import Log, make_log, make_prior
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..figures import Chart, Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, exactly
from .scenarios import DEGREE, GYRO, LOSS, OFFSET, OUTPUTS, quiet_craft

LENGTH = 100.0  # s
LATER = 40.0  # s
AFTER = (1.0, 10.0, 100.0)  # s
STAR_BOUND = 1.0 * DEGREE  # rad
BIASES = {
    "offset": (OFFSET.signals, OFFSET.bound, 1.0, "N m"),
    "loss": (LOSS.signals, LOSS.bound, 1.0, "1"),
    "gyro": (GYRO.signals, GYRO.bound * DEGREE, DEGREE, "deg/s"),
    "star tracker": (OUTPUTS[3:], STAR_BOUND, DEGREE, "deg"),
}
"""By kind: signals about x, y and z, largest size, scale and unit."""
ALL = tuple(BIASES)


@functools.cache
def manoeuvre() -> Log:
    """The manoeuvre without noise and faults, from the start to 140 s."""
    craft = quiet_craft()
    flight = jax.jit(lambda key: fly(craft, key=key, duration=LATER + LENGTH))(jax.random.key(0))
    model = spacecraft_model(RigidSpacecraft())
    return make_log(model, np.asarray(flight.t), np.asarray(flight.y), np.asarray(flight.u))


@functools.cache
def achievable(kinds: tuple[str, ...] = ALL, start: float = 0.0) -> Isolability:
    """What 100 s of the manoeuvre can tell of constant faults of some kinds, the others being known to be absent.

    One program serves all, since a fault known to be absent is one without variance.

    Args:
        kinds: of the faults that there may be, each about all three axes.
        start: from when on there may be faults [s]; the state is as good as unknown then.
    """
    craft = RigidSpacecraft()
    faults = [
        make(signal, sigma=bound * (kind in kinds))
        for make, (kind, (signals, bound, _, _)) in zip(
            (actuator_offset, loss_of_effectiveness, sensor_bias, sensor_bias), BIASES.items(), strict=True
        )
        for signal in signals
    ]
    model, log = with_faults(spacecraft_model(craft), faults), manoeuvre()
    first = round(start / STEP)
    rows = slice(first + 1, first + 1 + round(LENGTH / STEP))
    cut = make_log(model, log.t[rows], log.y[rows], log.u[rows], start=float(log.t[first]))
    unknown = [10.0 * DEGREE] * 6  # rad/s and rad; readings tell a thousand times more
    return isolability(model, extend_prior(model, make_prior(model.base, log.y[first], unknown)), cut)


def sigmas(kind: str, together: tuple[str, ...], start: float = 0.0) -> Float[np.ndarray, "T 3"]:
    """Standard deviations of the faults of a kind, in its unit, if there may be faults of several."""
    column = 3 * ALL.index(kind)
    return achievable(together, start).sigma[:, column : column + 3] / BIASES[kind][2]


def at(values: Float[np.ndarray, "T 3"], after: float) -> Float[np.ndarray, "3"]:
    """The row so long after the start."""
    return values[round(after / STEP) - 1]


SETS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("wheel offset", "offset", ("offset",)),
    ("loss of effectiveness", "loss", ("loss",)),
    ("gyro bias", "gyro", ("gyro",)),
    ("star tracker bias", "star tracker", ("star tracker",)),
    ("offset, if there may be a loss as well", "offset", ("offset", "loss")),
    ("loss, if there may be an offset as well", "loss", ("offset", "loss")),
    ("star tracker bias, if there may be any", "star tracker", ALL),
)

FILTERS: dict[str, Callable[[], KalmanFilter]] = {
    "augmented EKF": extended_kalman_filter,
    "TSEKF": two_stage_extended_kalman_filter,
    "augmented UKF": unscented_kalman_filter,
    "TSUKF": two_stage_unscented_kalman_filter,
}
COUNTED = (3, 12, 48)
ROWS = 200
TURNS = 7


@functools.cache
def problem(filter_name: str, biases: int) -> Problem:
    """A filter of a spacecraft with so many wheels, each with an offset, along readings that stand still."""
    angle = 2.0 * math.pi * np.arange(biases) / biases
    c, s = math.cos(REGULAR_PYRAMID), math.sin(REGULAR_PYRAMID)
    craft = RigidSpacecraft(wheels=Wheels(np.stack([c * np.cos(angle), c * np.sin(angle), np.full(biases, s)])))
    walk, sigma = OFFSET.tuned * OFFSET.walk, OFFSET.sigma
    faults = [actuator_offset(f"torque_{n}", walk=walk, sigma=sigma, per_step=True) for n in wheel_names(biases)]
    model = with_faults(spacecraft_model(craft), faults)
    start = craft.truth(craft.init(), jnp.zeros(()))
    deviations = [float(craft.gyro_sigma)] * 3 + [float(craft.star_tracker_sigma)] * 3
    prior = extend_prior(model, make_prior(model.base, start, deviations))
    t = STEP * np.arange(1, ROWS + 1)
    log = make_log(model, t, np.tile(start, (ROWS, 1)), np.zeros((ROWS, len(model.inputs))), start=0.0)
    return FILTERS[filter_name](), model, prior, log


@functools.cache
def costs() -> dict[tuple[str, int], StepCost]:
    """Operations per step, by filter and number of biases."""
    return {(name, p): step_cost(*problem(name, p)) for name in FILTERS for p in COUNTED}


@functools.cache
def times() -> dict[tuple[str, int], float]:
    """Seconds per step on this machine, likewise."""
    found: dict[tuple[str, int], float] = {}
    for p in COUNTED:
        taken = step_seconds({name: problem(name, p) for name in FILTERS}, TURNS)
        found |= {(name, p): seconds for name, seconds in taken.items()}
    return found


def _numbers(values: Array | np.ndarray) -> str:
    return ", ".join(f"{value:.2g}" for value in values)


def tables(outcome: Outcome) -> list[Table]:
    """Achievable accuracy, faults that pass for one another, and costs."""
    rows = tuple(
        (f"{title} [{BIASES[kind][3]}]", *(_numbers(at(sigmas(kind, together), after)) for after in AFTER))
        for title, kind, together in SETS
    )
    reach = Table(
        "Standard deviation with which constant faults can be known at best: x, y, z",
        ("fault", *(f"after {after:g} s" for after in AFTER)),
        rows,
    )
    pairs = achievable(("offset", "loss"), LATER).pairs
    ambiguous = Table(
        f"Offsets and losses from {LATER:g} s on: what passes for what",
        ("faults", "until [s]"),
        tuple((" and ".join(pair.names), pair.until) for pair in pairs) or (("none", None),),
    )
    counted = Table(
        "Operations per step",
        ("filter", *(f"{p} biases" for p in COUNTED)),
        tuple((name, *(costs()[name, p].operations for p in COUNTED)) for name in FILTERS),
    )
    timed = Table(
        f"Time per step on this machine, median of {TURNS} turns [µs]",
        ("filter", *(f"{p} biases" for p in COUNTED)),
        tuple((name, *(f"{1e6 * times()[name, p]:,.0f}" for p in COUNTED)) for name in FILTERS),
    )
    return [reach, ambiguous, counted, timed]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """Achievable accuracy over time, and costs over the number of biases."""
    t = STEP * np.arange(1, round(LENGTH / STEP) + 1)
    panels = []
    for kind, (_, _, _, unit) in BIASES.items():
        alone, together = sigmas(kind, (kind,)), sigmas(kind, ALL)
        lines = [Line(f"{axis}, alone", t, alone[:, k]) for k, axis in enumerate("xyz")]
        lines.append(Line("x, with all other faults", t, together[:, 0]))
        panels.append(Panel(f"{kind}, sigma", tuple(lines), unit, log=True))
    reach = Figure(
        "Achievable accuracy",
        "Standard deviation of a constant fault along the manoeuvre: what no filter can beat. If there may be faults of all "
        "four kinds, it takes until the manoeuvre has told them apart.",
        tuple(panels),
        "time since the start [s]",
        x_log=True,
    )
    p = np.asarray(COUNTED, float)
    operations = tuple(
        Line(name, p, np.array([costs()[name, k].operations for k in COUNTED], float)) for name in FILTERS
    )
    seconds = tuple(Line(name, p, np.array([1e6 * times()[name, k] for k in COUNTED])) for name in FILTERS)
    cost = Figure(
        "Cost over the number of biases",
        "Six states and p offsets of p wheels. Operations are counted, times measured on this machine.",
        (Panel("operations per step", operations, log=True), Panel("time per step", seconds, "µs", log=True)),
        "number of biases p",
        x_log=True,
    )
    return [reach, cost]


def _over(above: str, under: str, p: int) -> Callable[[Outcome], Measured]:
    return lambda outcome: exactly(costs()[above, p].operations / costs()[under, p].operations)


def _worse(kind: str, together: tuple[str, ...], after: float) -> Callable[[Outcome], Measured]:
    """The largest factor over axes by which other possible faults make one less well known."""
    return lambda outcome: exactly(float(np.max(at(sigmas(kind, together), after) / at(sigmas(kind, (kind,)), after))))


def _observed(outcome: Outcome) -> Measured:
    return exactly(achievable().information.rank)


CLAIMS = (
    Claim(
        "cost of augmentation",
        "Two-stage estimation avoids the growing cost of augmenting the state.",
        "introduction, no numbers",
        (
            *(
                Check(f"operations, augmented EKF over TSEKF, p = {p}", _over("augmented EKF", "TSEKF", p), above(1.25))
                for p in COUNTED
            ),
            *(
                Check(f"operations, augmented UKF over TSUKF, p = {p}", _over("augmented UKF", "TSUKF", p), above(1.25))
                for p in COUNTED
            ),
        ),
        {
            "partly": "What is saved are sigma points, 2 n + 1 in place of 2 (n + p) + 1, which any filter that marginalises "
            "the biases has; where derivatives are taken the algebra of the two stages costs as much as that of one."
        },
    ),
    Claim(
        "faults told apart by the manoeuvre",
        "Biases of wheels, gyro and star tracker can all be estimated at once while the spacecraft manoeuvres.",
        "not in the paper, which estimates one kind at a time",
        (
            Check("directions observed of 12", _observed, above(11.5)),
            *(
                Check(f"sigma after 100 s, all together over alone, {kind}", _worse(kind, ALL, 100.0), below(1.1))
                for kind in ALL
            ),
            Check("sigma after 1 s, loss with offset over alone", _worse("loss", ("offset", "loss"), 1.0), above(2.0)),
        ),
    ),
)


def chapter() -> Chapter:
    """What can be known of constant faults at best, and what it costs; there is nothing random in it."""
    return Chapter(
        (),
        CLAIMS,
        tables,
        figures,
        (
            "Achievable accuracy: the covariance of a filter that takes faults for constants, with the bounds of the faults as "
            "sigma before the start (1 deg for the star tracker) and the state as good as unknown.",
            "Operations are counted on the traced program, with the model, its derivatives and all zeros of the matrices in "
            "them; the spacecraft has p wheels with an offset each.",
        ),
    )
