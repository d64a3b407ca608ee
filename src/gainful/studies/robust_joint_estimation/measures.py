"""The numbers by which a record is judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...filters import Info
from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS
from ...updates.change_detection import Changes
from ..experiment import Experiment, Quantity, Record
from .records import ONSETS, SETTLED, Drive

NAMES = ("x1", "x2", "x3", "p1", "p2")
WITHIN = (0.3, 0.06)
"""A parameter has settled within 15 % of 2 and 10 % of 0.6."""
WINDOW, HOLD = 300, 20
"""Samples: one that takes longer than the first never settles, and settled is what stays for the second."""
CONVERGED, CLOSE = 500, (0.15, 0.06)
"""Converged is an estimate whose mean absolute error over the last samples is below these, for p1 and p2."""
RECENT, NOTABLE = 100, 0.1
"""An alarm is wrong if the parameter has not changed by so much within so many samples."""

QUANTITIES = (
    Quantity("x", "states, log10 MSE"),
    Quantity("p", "parameters, log10 MSE"),
    Quantity("rmse_p1", "RMSE of p1"),
    Quantity("rmse_p2", "RMSE of p2"),
    *(Quantity(f"bias_{name}", f"bias of {name}" + (" in sigmas" if name[0] == "x" else "")) for name in NAMES),
    *(Quantity(f"nees_{name}", f"NEES of {name}") for name in NAMES),
    Quantity("settling_p1", "p1 settles", "ms", "median"),
    Quantity("settling_p2", "p2 settles", "ms", "median"),
    Quantity("inside", "share of whitened innovations counted in full"),
    Quantity("alarms", "alarms"),
    Quantity("wrong", "alarms of a parameter that did not change"),
    Quantity("delay_p1", "p1 alarm", "ms", "median"),
    Quantity("delay_p2", "p2 alarm", "ms", "median"),
    Quantity("score_mean", "mean of the scores"),
    Quantity("score_variance", "variance of the scores"),
    Quantity("converged", "converged", statistic="share"),
)


class Measure(eqx.Module):
    """From a record and a filter's reports to the quantities."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        truth, variance = true_states(record), jax.vmap(lambda each: jnp.diagonal(each.cov))(info.estimate)
        error = info.estimate.mean - truth
        late, spread = error[SETTLED:], variance[SETTLED:]
        squares = late**2
        known = spread > 0
        nees = jnp.mean(jnp.where(known, squares / jnp.where(known, spread, 1.0), jnp.nan), axis=0)
        bias = jnp.mean(late, axis=0) / jnp.asarray((*MEASUREMENT_SIGMAS, 1.0, 1.0))
        return {
            "x": jnp.log10(jnp.mean(squares[:, :3] / jnp.asarray(MEASUREMENT_SIGMAS) ** 2)),
            "p": jnp.log10(jnp.mean(jnp.sum(squares[:, 3:], axis=1))),
            **{f"rmse_{name}": jnp.sqrt(jnp.mean(squares[:, i])) for i, name in enumerate(NAMES) if i > 2},
            **{f"bias_{name}": bias[i] for i, name in enumerate(NAMES)},
            **{f"nees_{name}": nees[i] for i, name in enumerate(NAMES)},
            "settling_p1": settling(error[:, 3], WITHIN[0], ONSETS[0]),
            "settling_p2": settling(error[:, 4], WITHIN[1], ONSETS[1]),
            "inside": jnp.mean(info.weight[SETTLED:] >= 1.0),
            "converged": jnp.all(jnp.mean(jnp.abs(error[-CONVERGED:, 3:]), axis=0) < jnp.asarray(CLOSE)),
            **detection(truth[:, 3:], info.memory),
        }


def true_states(record: Record) -> Float[Array, "T 5"]:
    """States and parameters as they were."""
    return jnp.concatenate([record.truth["states"], record.truth["parameters"]], axis=1)


def settling(error: Float[Array, " T"], tolerance: float, onset: int) -> Float[Array, ""]:
    """Samples of 1 ms from the onset until an error is within a tolerance for `HOLD` of them; infinity beyond the window."""
    outside = jnp.cumsum(jnp.abs(error[onset : onset + WINDOW + HOLD]) > tolerance)
    before = jnp.concatenate([jnp.zeros(1, outside.dtype), outside[: WINDOW - 1]])
    held = outside[HOLD - 1 : HOLD - 1 + WINDOW] == before
    return jnp.where(jnp.any(held), jnp.argmax(held) + 1.0, jnp.inf)


def detection(parameters: Float[Array, "T 2"], memory: Any) -> dict[str, Array]:
    """What the detector found; of filters that have one."""
    names = ("alarms", "wrong", "delay_p1", "delay_p2", "score_mean", "score_variance")
    changes = memory[0] if isinstance(memory, tuple) else None
    if not isinstance(changes, Changes):
        return dict.fromkeys(names, jnp.asarray(jnp.nan))
    before = jnp.concatenate([jnp.repeat(parameters[:1], RECENT, axis=0), parameters[:-RECENT]])
    changed = jnp.abs(parameters - before) > NOTABLE
    found, score = changes.alarm != 0, changes.score[SETTLED:]
    delays = []
    for j, onset in enumerate(ONSETS):
        later = found[onset:, j]
        delays.append(jnp.where(jnp.any(later), jnp.argmax(later) + 1.0, jnp.inf))
    values = (jnp.sum(found), jnp.sum(found & ~changed), *delays, jnp.mean(score), jnp.var(score))
    return dict(zip(names, values, strict=True))


class Traces(eqx.Module):
    """From the same to the series of the figures."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        truth = true_states(record)
        squares = (info.estimate.mean - truth) ** 2
        spread = jax.vmap(lambda each: jnp.diagonal(each.cov)[3:])(info.estimate)
        return {
            "states": info.estimate.mean[:, :3],
            "parameters": info.estimate.mean[:, 3:],
            "sigma": jnp.sqrt(spread),
            "x": jnp.mean(squares[:, :3] / jnp.asarray(MEASUREMENT_SIGMAS) ** 2, axis=1),
            "p": jnp.sum(squares[:, 3:], axis=1),
        }


def judged(
    name: str, title: str, drive: Drive, contenders: Mapping[str, Callable[[Any], Any]], *, baseline: str = ""
) -> Experiment:
    """An experiment of the study: they differ in records and contenders, and all are judged alike."""
    return Experiment(name, title, drive, contenders, Measure(), QUANTITIES, Traces(), baseline=baseline)
