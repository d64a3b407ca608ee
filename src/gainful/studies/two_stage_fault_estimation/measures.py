"""The numbers by which a flight is judged."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ...faults import fault_scores, windowed_mean
from ...filters import Info
from ...filters.jump_bank import JumpReport
from ...updates.innovation_scaling import Scaling
from ..experiment import Quantity, Record
from .scenarios import DEGREE, END, ONSET, STATES, Scenario, selected

SETTLED = 10.0  # s; the transient of the start is over
SOON = 10.0  # s; an alarm later than that after the onset has missed the fault
WINDOW = 20
FAULTS = 3


def quantities(scenario: Scenario) -> tuple[Quantity, ...]:
    """What is measured in a scenario."""
    unit = scenario.unit
    return (
        Quantity("rmse", "fault RMSE, 50 to 200 s", unit),
        Quantity("steady", "steady fault RMSE, 100 to 150 s", unit),
        Quantity("rate", "x rate RMSE", "deg/s"),
        Quantity("angle", "x angle RMSE", "deg"),
        Quantity("nis", "mean NIS before the fault"),
        Quantity("factor", "largest factor, log10"),
        Quantity("restless", "share of fault-free steps with a factor above 1"),
        Quantity("first", "first factor above 1 after the onset", "s", "median"),
        Quantity("factor_before", "largest factor before the fault, log10"),
        Quantity("factor_after", "largest factor in the 10 s after it, log10"),
        Quantity("window_before", "largest windowed NIS before the fault"),
        Quantity("window_after", "largest windowed NIS in the 10 s after it"),
    )


def factors(info: Info) -> Float[Array, " T"]:
    """The factor on the variance of the faulty component's walk; 1 where the filter has none."""
    memory: Any = info.memory
    if isinstance(memory, tuple) and isinstance(memory[0], Scaling):
        return memory[0].process[:, STATES]
    return jnp.ones(info.nis.shape)


def jump_ratio(info: Info) -> Float[Array, " T"]:
    """The largest likelihood ratio of a jump; 0 where the filter looks for none."""
    memory: Any = info.memory
    if isinstance(memory, JumpReport):
        return jnp.max(memory.statistic, axis=1)
    return jnp.zeros(info.nis.shape)


class Measure(eqx.Module):
    """From a record and a filter's reports to the quantities."""

    scale: float

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        truth, t = record.truth, record.truth["t"]
        mean = info.estimate.mean
        off = mean[:, STATES] / self.scale - truth["fault"]
        states = (mean[:, :STATES] - truth["states"]) / DEGREE
        factor = jnp.log10(factors(info))
        before, after = selected(t, SETTLED, ONSET), selected(t, ONSET, ONSET + SOON)
        window = windowed_mean(info.nis, WINDOW)
        faulty = (t >= ONSET) & (factor > 0)
        judged = t >= SETTLED
        return {
            "rmse": rms(off, t >= ONSET),
            "steady": rms(off, selected(t, 0.5 * (ONSET + END), END)),
            "rate": rms(states[:, 0], judged),
            "angle": rms(states[:, 3], judged),
            "nis": _mean(info.nis, before),
            "factor": _largest(factor, judged),
            "restless": _mean(factor > 0, before),
            "first": jnp.where(jnp.any(faulty), t[jnp.argmax(faulty)] - ONSET, jnp.inf),
            "factor_before": _largest(factor, before),
            "factor_after": _largest(factor, after),
            "window_before": _largest(window, before),
            "window_after": _largest(window, after),
        }


class Traces(eqx.Module):
    """From the same to the series of the figures, and to those that detectors are made of."""

    scale: float

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        mean = info.estimate.mean
        cov = jax.vmap(lambda each: each.cov)(info.estimate)
        sigma = jnp.sqrt(cov[:, STATES, STATES])
        return {
            "fault": mean[:, STATES] / self.scale,
            "sigma": sigma / self.scale,
            "rate": mean[:, 0] / DEGREE,
            "angle": mean[:, 3] / DEGREE,
            "factor": jnp.log10(factors(info)),
            "nis": info.nis,
            "scores": fault_scores(mean, cov, FAULTS),
            "ratio": jump_ratio(info),
        }


def _mean(values: Array, rows: Bool[Array, " T"]) -> Array:
    return jnp.sum(jnp.where(rows, values, 0.0)) / jnp.sum(rows)


def rms(values: Array, rows: Bool[Array, " T"]) -> Array:
    """Root mean square over some rows."""
    return jnp.sqrt(_mean(values**2, rows))


def _largest(values: Array, rows: Bool[Array, " T"]) -> Array:
    return jnp.max(jnp.where(rows, jnp.nan_to_num(values), 0.0))
