"""The numbers by which estimates along a track are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ...filters import Info
from ...updates import Correction
from ..experiment import Experiment, Quantity, Record
from .records import STEADY, Drive

STATES = ("displacement", "speed")
UNITS = {"displacement": "m^2", "speed": "m^2/s^2"}
QUANTITIES = (
    *(Quantity(name, f"{name}, MSE", unit) for name, unit in UNITS.items()),
    Quantity("mean_displacement", "displacement, mean error", "m"),
    Quantity("mean_speed", "speed, mean error", "m/s"),
    Quantity("nees", "NEES over 2"),
    Quantity("nees_corrected", "NEES over 2 where corrected"),
    Quantity("passed", "share of rows corrected"),
    Quantity("unknown", "share of rows unknown to the network"),
    *(Quantity(f"corrects_{name}", f"corrects the {name}", statistic="share") for name in STATES),
)


def errors(record: Record, info: Info) -> Array:
    """True minus estimated displacement and speed, row by row."""
    return record.truth["states"] - info.estimate.mean


class Measure(eqx.Module):
    """From a record and a filter's reports to the quantities, over the second half of the record."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        error = errors(record, info)[STEADY:]
        cov = jax.vmap(lambda each: each.cov)(info.estimate)[STEADY:]
        squares = jnp.mean(error**2, axis=0)
        nees = jnp.einsum("ti,ti->t", error, jnp.linalg.solve(cov, error[..., None])[..., 0]) / len(STATES)
        everywhere, corrected = jnp.mean(nees), jnp.asarray(jnp.nan)
        correction = _correction(info.memory)
        if correction is not None:
            # Where nobody found a covariance of the corrected estimate none is reported.
            known, rows = jnp.any(correction.cov != 0.0), correction.aided[STEADY:] > 0
            everywhere = jnp.where(known, everywhere, jnp.nan)
            corrected = jnp.where(known, jnp.mean(jnp.where(rows, nees, 0.0)) / jnp.mean(rows), jnp.nan)
        return {
            **dict(zip(STATES, squares, strict=True)),
            "mean_displacement": jnp.mean(error[:, 0]),
            "mean_speed": jnp.mean(error[:, 1]),
            "nees": everywhere,
            "nees_corrected": corrected,
            **_corrections(correction),
        }


def _correction(memory: Any) -> Correction | None:
    """What a network beside the filter remembers; None of filters without one."""
    update = memory[0] if isinstance(memory, tuple) else None
    return update if isinstance(update, Correction) else None


def _corrections(correction: Correction | None) -> dict[str, Array]:
    """What a network did; of filters that have one."""
    names = ("passed", "unknown", *(f"corrects_{name}" for name in STATES))
    if correction is None:
        return dict.fromkeys(names, jnp.asarray(jnp.nan))
    moved = jnp.any(correction.shift != 0.0, axis=0)
    shares = (jnp.mean(correction.passed[STEADY:]), jnp.mean(correction.flagged[STEADY:]))
    return dict(zip(names, (*shares, *moved), strict=True))


class Traces(eqx.Module):
    """From the same to the series of the figures."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        return {"error": errors(record, info)}


def judged(
    name: str,
    title: str,
    drive: Drive,
    contenders: Mapping[str, Any],
    *,
    baseline: str = "",
    kept: tuple[str, ...] = (),
    most_runs: int | None = None,
) -> Experiment:
    """An experiment on the track: they differ in records and contenders, and all are judged alike."""
    traces = Traces() if kept else None
    return Experiment(
        name,
        title,
        drive,
        contenders,
        Measure(),
        QUANTITIES,
        traces,
        baseline=baseline,
        kept=kept,
        most_runs=most_runs,
    )
