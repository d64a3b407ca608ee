"""A motion that stops for a while: what is left of an estimate that forgets, with and without a gate."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...filters import Info
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, above, below
from ..experiment import Experiment, Quantity, Record
from ..figures import Figure, Panel, Table
from ..outcome import Outcome
from .contenders import RLS_F, RTLS_F, least_squares, stacked, total_least_squares
from .figures import first, medians
from .measures import Traces, relative_errors
from .records import STEP, YAW, NoisyRows, motion

SAMPLES = 4000
STOP, START = 2000, 3000
"""Samples between which nothing moves."""
AROUND = slice(STOP - 100, START + 200)
FORGETTING = 0.99
STDS = {"outage-0.1": 0.1, "outage-0.316": 0.316}
"""Standard deviation of the noise by experiment."""
OPEN, GATED, PLAIN = f"{RTLS_F}, no gate", f"{RTLS_F}, gated", f"{RLS_F}, forgetting {FORGETTING:g}"
MOST = 50
ROWS = np.arange(9, SAMPLES, 10)

QUANTITIES = (
    Quantity("before", "relative error before"),
    Quantity("worst", "largest relative error around the outage", statistic="median"),
    Quantity("after", "relative error 200 samples after"),
)


class Measure(eqx.Module):
    """From a record and the reports along it to the quantities."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        error = relative_errors(record, info)
        return {"before": error[STOP - 1], "worst": jnp.max(error[AROUND]), "after": error[START + 199]}


def records(std: float) -> NoisyRows:
    """Records of yaw that stop between two samples, while the sensors go on being noisy."""
    moving = (jnp.arange(SAMPLES) < STOP) | (jnp.arange(SAMPLES) >= START)
    theta = jnp.tile(jnp.asarray(YAW.theta), (SAMPLES, 1))
    return NoisyRows(motion(SAMPLES) * moving[:, None], theta, jnp.full(2, std))


def experiment(name: str) -> Experiment:
    """Three recursions that forget."""
    contenders = {
        OPEN: stacked(total_least_squares(forgetting=FORGETTING)),
        GATED: stacked(total_least_squares(forgetting=FORGETTING, gate=True)),
        PLAIN: stacked(least_squares(FORGETTING)),
    }
    return Experiment(
        name,
        f"Outage, noise {STDS[name]:g}",
        records(STDS[name]),
        contenders,
        Measure(),
        QUANTITIES,
        Traces(jnp.asarray(ROWS)),
        most_runs=MOST,
        kept=("error",),
    )


def tables(outcome: Outcome) -> list[Table]:
    """Errors before, around and after."""
    return [
        outcome.table(name, title=f"Motion that stops for 50 s, noise {std:g}, forgetting {FORGETTING:g}")
        for name, std in STDS.items()
    ]


def figures(outcome: Outcome) -> list[Figure]:
    """Errors over time."""
    name = "outage-0.1"
    t = STEP * (ROWS + 1.0)
    names = (OPEN, GATED, PLAIN)
    one = tuple(first(each, t, outcome.every(name, each, "error")) for each in names)
    return [
        Figure(
            "Loss of excitation",
            f"Yaw, noise of standard deviation {STDS[name]:g}, forgetting {FORGETTING:g}; motion stops from {STEP * STOP:g} "
            f"to {STEP * START:g} s. Without a gate total least squares fits the noise; least squares goes to zero. The gate "
            "holds the last estimate that stood out of the noise.",
            (
                Panel("relative error, the first run", one, log=True),
                Panel(
                    "relative error, median of the runs",
                    medians(outcome, name, "error", names, t, banded=(OPEN, GATED)),
                    log=True,
                ),
            ),
        )
    ]


def _median(name: str, contender: str, quantity: str, expected: Tolerance) -> Check:
    return Check(
        f"median over runs of the largest relative error around the outage, {contender}, {name}",
        lambda outcome: outcome.median(name, contender, quantity),
        expected,
    )


CLAIMS = (
    Claim(
        "loss of excitation",
        "An estimate that forgets survives a loss of excitation.",
        "not in the paper, which forgets nothing",
        tuple(_median(name, OPEN, "worst", below(0.5)) for name in STDS),
        {"not reproduced": "What is left of the record is noise, and total least squares fits that."},
    ),
    Claim(
        "gate on the gap",
        "It does with a gate that holds it while the gap of eigenvalues is one that noise alone would show.",
        "not in the paper",
        (
            *(_median(name, GATED, "worst", below(0.5)) for name in STDS),
            *(_median(name, OPEN, "worst", above(5.0)) for name in STDS),
        ),
    ),
)


def chapter() -> Chapter:
    """Two experiments, not in the paper."""
    return Chapter(tuple(map(experiment, STDS)), CLAIMS, tables, figures)
