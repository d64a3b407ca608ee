"""A vehicle in six degrees of freedom: all its parameters from noisy velocities, and what one degree of freedom at a time makes
of coupled motion."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...plants import bluerov2
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, above, below, near
from ..experiment import Experiment, Quantity
from ..figures import Chart, Figure, Line, Panel, Table, heading
from ..outcome import Outcome
from .vehicle_contenders import (
    ISOTROPIC,
    PLAIN,
    SINGLE,
    WEAK,
    WEAK_CROSS,
    WEAK_CROSS_WIDE,
    WEAK_WIDE,
    contenders,
    coupled_fit,
    single_fit,
)
from .vehicle_records import GROUPS, SAMPLES, CleanRecord, diving, motion, own_columns, undisturbed

LEVELS = {"vehicle, 0.02": (0.02, 0.005), "vehicle, 0.05": (0.05, 0.01)}
"""Standard deviations of velocities [m/s, rad/s] and of roll and pitch [rad], by experiment."""
QUIET, LOUD = LEVELS
CLEAN = "vehicle without noise"
MOST = 20
COUPLED = "all six together"
INERTIA_AND_DRAG = ("m", "d", "d2")
SINGLES = {"surge": (0, ("kg", "N s/m", "N s^2/m^2")), "yaw": (5, ("kg m^2", "N m s", "N m s^2"))}
"""Degrees of freedom of which the fit by themselves is told, with units of inertia, linear and quadratic drag."""


class Measure(eqx.Module):
    """From a record and parameters to the error of each group: the root mean square of its relative errors, in per cent."""

    def __call__(self, record: Any, theta: Array) -> dict[str, Array]:
        off = 100.0 * (theta / record.truth["theta"] - 1.0)
        return {name: jnp.sqrt(jnp.mean(off[where] ** 2)) for name, (_, where) in GROUPS.items()}


class CleanMeasure(eqx.Module):
    """Errors of the groups, the parameters of single degrees of freedom, and how much of their wrench these explain."""

    def __call__(self, record: CleanRecord, found: tuple[Array, Array]) -> dict[str, Array]:
        theta, left = found
        numbers = Measure()(record, theta)
        for name, (dof, _) in SINGLES.items():
            numbers |= {f"{name}_{what}": theta[k] for what, k in zip(INERTIA_AND_DRAG, own_columns(dof), strict=True)}
            numbers[f"{name}_told"] = 1.0 - jnp.sum(left[:, dof] ** 2) / jnp.sum(
                (record.rows[:, dof, -1] - jnp.mean(record.rows[:, dof, -1])) ** 2
            )
        return numbers


QUANTITIES = tuple(Quantity(name, words, "%") for name, (words, _) in GROUPS.items())
CLEAN_QUANTITIES = (
    *QUANTITIES,
    *(
        Quantity(f"{name}_{what}", f"{name}, {what}", unit)
        for name, (_, units) in SINGLES.items()
        for what, unit in zip(INERTIA_AND_DRAG, units, strict=True)
    ),
    *(Quantity(f"{name}_told", f"{name}, share of the wrench explained") for name in SINGLES),
)


def tables(outcome: Outcome) -> list[Table]:
    """Errors by group, and what single degrees of freedom come to without noise."""
    titles = {
        name: f"Six degrees of freedom, velocities with noise of {nu:g} m/s and rad/s: relative errors by group, mean over runs"
        for name, (nu, _) in LEVELS.items()
    }
    chosen = [quantity for quantity in CLEAN_QUANTITIES if quantity not in QUANTITIES]
    clean = Table(
        "One degree of freedom at a time on coupled motion, exact accelerations and no noise",
        ("Contender", *(heading(quantity.title, quantity.unit) for quantity in chosen)),
        tuple(
            (name, *(outcome.summary(CLEAN, name, quantity.name) for quantity in chosen)) for name in (COUPLED, SINGLE)
        ),
    )
    return [*(outcome.table(name, title=words) for name, words in titles.items()), clean]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """The motion, and the errors of masses and linear drag."""
    moved = motion(SAMPLES)
    t, nu, angles = (np.asarray(each) for each in (moved.t, moved.nu, moved.attitude))
    panels = (
        Panel("velocity", tuple(Line(name, t, nu[:, k]) for k, name in enumerate(("surge", "sway", "heave"))), "m/s"),
        Panel(
            "turn rate", tuple(Line(name, t, nu[:, k]) for k, name in enumerate(("roll", "pitch", "yaw"), 3)), "rad/s"
        ),
        Panel(
            "attitude",
            tuple(Line(name, t, np.degrees(angles[:, k])) for k, name in enumerate(("roll", "pitch"))),
            "deg",
        ),
    )
    charts = [
        Chart(
            f"Six degrees of freedom: {GROUPS[group][0]}",
            f"Velocities with noise of {nu_std:g} m/s and rad/s: root mean square over the group, mean over runs, with 95 % "
            "intervals.",
            "relative error",
            {each: outcome.mean(name, each, group) for each in contenders()},
            "%",
            log=True,
        )
        for group in ("mass", "linear")
        for name, (nu_std, _) in LEVELS.items()
    ]
    return [
        Figure(
            "Motion of the vehicle in six degrees of freedom", "What all contenders are given, without noise.", panels
        ),
        *charts,
    ]


def _ratio(experiment: str, group: str, contender: str, over: str, expected: Tolerance) -> Check:
    return Check(
        f"error of {GROUPS[group][0]}, {contender} over {over}, {experiment}",
        lambda outcome: outcome.ratio(experiment, group, contender, over=over),
        expected,
    )


def _clean(what: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    return Check(what, lambda outcome: outcome.mean(CLEAN, contender, quantity), expected)


CLAIMS = (
    Claim(
        "one degree of freedom at a time",
        "Inertia and drag of a vehicle are found one degree of freedom at a time.",
        "the paper's experiments are of one degree of freedom",
        tuple(
            _clean(f"{what} of {name}, no noise", SINGLE, f"{name}_{what}", near(true, relative=0.1))
            for name, (dof, _) in SINGLES.items()
            for what, true in zip(INERTIA_AND_DRAG, np.asarray(bluerov2().parameters)[own_columns(dof)], strict=True)
        ),
        {
            "not reproduced": "Where the motion is coupled, what the other degrees of freedom do is put down to this one's "
            "inertia and drag, with no noise at all; drag may even come out negative. It is for manoeuvres in one degree of "
            "freedom."
        },
    ),
    Claim(
        "coupled regression",
        "All parameters of the coupled vehicle are found from such a motion.",
        "not in the paper",
        tuple(_clean(f"error of {GROUPS[group][0]}, no noise", COUPLED, group, below(1e-6)) for group in GROUPS),
    ),
    Claim(
        "total least squares of a vehicle",
        "Isotropic total least squares is better than least squares also for the coupled vehicle.",
        "not in the paper",
        tuple(
            _ratio(name, group, ISOTROPIC, PLAIN, below(1.0))
            for name in LEVELS
            for group in ("mass", "linear", "quadratic")
        ),
        {"not reproduced": "As for one degree of freedom: its columns are unequally noisy, and drag pays for it."},
    ),
    Claim(
        "no derivatives",
        "In weak form least squares finds the parameters that it misses with differentiated velocities.",
        "not in the paper",
        tuple(_ratio(name, group, WEAK, PLAIN, below(0.5)) for name in LEVELS for group in GROUPS),
    ),
    Claim(
        "instruments across sensors",
        "With the sensors as instruments of each other the masses are more accurate still.",
        "not in the paper",
        tuple(_ratio(name, "mass", WEAK_CROSS, WEAK, below(0.9)) for name in LEVELS),
    ),
    Claim(
        "a wider window",
        "A window twice as wide more than halves the error of weak least squares in loud noise, short of what instruments do.",
        "not in the paper",
        (_ratio(LOUD, "mass", WEAK_WIDE, WEAK, below(0.5)), _ratio(LOUD, "mass", WEAK_WIDE, WEAK_CROSS, above(1.0))),
    ),
    Claim(
        "linear drag stays uncertain",
        "Even the best leave linear drag to more than a few per cent.",
        "not in the paper",
        tuple(
            Check(
                f"error of linear drag, {contender}, {name}",
                lambda outcome, name=name, contender=contender: outcome.mean(name, contender, "linear"),
                above(5.0),
            )
            for name in LEVELS
            for contender in (WEAK_WIDE, WEAK_CROSS_WIDE)
        ),
        {
            "reproduced": "It hides in the quadratic one, above all in roll, pitch and yaw, where it is a few hundredths of it "
            "at 1 rad/s."
        },
    ),
)


NOTES = (
    "Six degrees of freedom: the estimators of single sensors are given the mean of two. Each equation of least squares and of "
    "instruments is weighed by the inverse mean square of what it leaves, three times anew. Isotropic total least squares is "
    "not: it shifts the residual from one equation to the next, and weights so found run away. Its error depends on units as "
    "ever; differences of three samples are kinder to it, and to least squares, than those of five.",
)


def chapter() -> Chapter:
    """Two levels of noise, and none."""
    noisy = tuple(
        Experiment(
            name,
            f"Six degrees of freedom, velocities with noise of {nu_std:g}",
            diving(SAMPLES, nu_std, attitude_std),
            contenders(),
            Measure(),
            QUANTITIES,
            baseline=WEAK,
            most_runs=MOST,
        )
        for name, (nu_std, attitude_std) in LEVELS.items()
    )
    clean = Experiment(
        CLEAN,
        "Six degrees of freedom, no noise",
        undisturbed(),
        {COUPLED: coupled_fit, SINGLE: single_fit},
        CleanMeasure(),
        CLEAN_QUANTITIES,
        random=False,
    )
    return Chapter((*noisy, clean), CLAIMS, tables, figures, NOTES)
