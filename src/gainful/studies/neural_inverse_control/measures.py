"""The numbers by which a flight is judged."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ...control.euler321 import quaternion_to_euler321
from ...running.loop import Simulated
from ..experiment import Quantity
from .scenarios import AXES, HOLD_END, PERIOD, STEP

MILLI = 1e-3
LOST = 100.0
"""Error of an angle from which a flight is called lost [mrad]."""
LONGEST_SHOWN = 2000
"""Rows of a flight beyond which not all are drawn."""


class Flown(eqx.Module):
    """A flight against what was asked for.

    Attributes:
        t: times [s] (T,).
        angles: 3-2-1 [rad] (T, 3).
        wanted: the same as asked for [rad] (T, 3).
        rates: of the body [rad/s] (T, 3).
        wanted_rates: the same as asked for [rad/s] (T, 3).
        deflections: of the modes [m] (T, 3).
        torques: applied over the interval that ends at each row (T, 3) [N m].
        max_torque: largest of them [N m].
        trace: of the weights' covariance, NaN for controllers without (T,).
        fallen_back: whether the controller has given up its model for a plain law (T,).
    """

    t: Float[Array, " T"]
    angles: Float[Array, "T 3"]
    wanted: Float[Array, "T 3"]
    rates: Float[Array, "T 3"]
    wanted_rates: Float[Array, "T 3"]
    deflections: Float[Array, "T 3"]
    torques: Float[Array, "T 3"]
    max_torque: Float[Array, "3"]
    trace: Float[Array, " T"]
    fallen_back: Bool[Array, " T"]

    @property
    def error(self) -> Float[Array, "T 3"]:
        """Of the angles [mrad]."""
        return (self.angles - self.wanted) / MILLI

    @property
    def rate_error(self) -> Float[Array, "T 3"]:
        """Of the rates [mrad/s]."""
        return (self.rates - self.wanted_rates) / MILLI


def root_mean_square(values: Float[Array, "T n"], chosen: Bool[Array, " T"] | None = None) -> Float[Array, " n"]:
    """By column, over some of the rows; infinite where a flight has left all numbers."""
    rows = jnp.ones(len(values), bool) if chosen is None else chosen
    mean = jnp.sum(jnp.where(rows[:, None], values**2, 0.0), axis=0) / jnp.sum(rows)
    return _finite(jnp.sqrt(mean))


def panel_residual(deflection: Float[Array, " T"]) -> Float[Array, ""]:
    """Root mean square, over the holds, of the standard deviation of a deflection in the last seconds of each.

    Args:
        deflection: sample by sample [m].
    """
    rows, last = round(PERIOD / STEP), round(HOLD_END / STEP)
    holds = (len(deflection) - 1) // rows
    ends = deflection[1 : 1 + holds * rows].reshape(holds, rows)[:, -last:]
    return _finite(jnp.sqrt(jnp.mean(jnp.var(ends, axis=1))))


class Measure(eqx.Module):
    """From a flight to the quantities.

    Attributes:
        late: begin and end of a window of its own (2,) [s].
    """

    late: Float[Array, "2"]

    def __call__(self, record: Any, flown: Flown) -> dict[str, Array]:
        error, steps = flown.error, jnp.diff(flown.torques[1:], axis=0)
        rms, rates = root_mean_square(error), root_mean_square(flown.rate_error)
        chosen = (flown.t >= self.late[0]) & (flown.t <= self.late[1])
        peak = _finite(jnp.max(jnp.abs(error), axis=0))
        at_limit = jnp.abs(flown.torques[1:]) >= (1.0 - 1e-9) * flown.max_torque
        return {
            **{f"rms_{axis}": rms[k] for k, axis in enumerate(AXES)},
            **{f"peak_{axis}": peak[k] for k, axis in enumerate(AXES)},
            **{f"rate_{axis}": rates[k] for k, axis in enumerate(AXES)},
            "step": _over_axes(root_mean_square(steps)),
            "step_roll": root_mean_square(steps)[0],
            "late": _over_axes(root_mean_square(error, chosen)),
            "late_step": _over_axes(root_mean_square(steps, chosen[2:])),
            "panel": panel_residual(flown.deflections[:, 0]),
            "saturated": jnp.mean(at_limit.astype(float)),
            "lost": ~(jnp.max(peak) <= LOST),
            "trace": flown.trace[-1],
            "fallen_back": jnp.any(flown.fallen_back),
        }


class Traces(eqx.Module):
    """From a flight to its series."""

    def __call__(self, record: Any, flown: Flown) -> dict[str, Array]:
        every = -(-len(flown.t) // LONGEST_SHOWN)
        series = {
            "t": flown.t,
            "angles": flown.angles / MILLI,
            "wanted_angles": flown.wanted / MILLI,
            "rates": flown.rates / MILLI,
            "wanted_rates": flown.wanted_rates / MILLI,
            "error": flown.error,
            "rate_error": flown.rate_error,
            "torques": flown.torques,
            "trace": flown.trace,
        }
        return {
            "windows": windows(flown.error),
            "rate_windows": windows(flown.rate_error),
        } | {name: values[::every] for name, values in series.items()}


def windows(error: Float[Array, "T 3"]) -> Float[Array, "n 3"]:
    """Mean absolute errors of the windows one after the other."""
    rows = round(PERIOD / STEP)
    count = (len(error) - 1) // rows
    return jnp.mean(jnp.abs(error[1 : 1 + count * rows]).reshape(count, rows, 3), axis=1)


def quantities(late: tuple[float, float], statistic: Any = "mean") -> tuple[Quantity, ...]:
    """The quantities of `Measure`.

    Args:
        late: the window [s].
        statistic: of errors and torques, where some flights are lost: "median".
    """

    def number(name: str, title: str, unit: str) -> Quantity:
        return Quantity(name, title, unit, statistic)

    over = f"{late[0]:g} to {late[1]:g} s"
    return (
        *(number(f"rms_{axis}", f"RMS {axis}", "mrad") for axis in AXES),
        *(number(f"peak_{axis}", f"peak {axis}", "mrad") for axis in AXES),
        *(number(f"rate_{axis}", f"RMS {axis} rate", "mrad/s") for axis in AXES),
        number("step", "torque step", "N m"),
        number("step_roll", "torque step, roll", "N m"),
        number("late", f"RMS of all axes, {over}", "mrad"),
        number("late_step", f"torque step, {over}", "N m"),
        number("panel", "panel residual", "m"),
        number("saturated", "share at the torque limit", "1"),
        Quantity("lost", "lost", statistic="share"),
        number("trace", "trace of the weights' covariance", "1"),
        Quantity("fallen_back", "fallen back", statistic="share"),
    )


def _over_axes(found: Float[Array, "3"]) -> Float[Array, ""]:
    return jnp.sqrt(jnp.mean(found**2))


def _finite(values: Array) -> Array:
    """What is no number is worse than any."""
    return jnp.where(jnp.isfinite(values), values, jnp.inf)


def angles_of(flown: Simulated) -> Float[Array, "T 3"]:
    """The 3-2-1 angles of a flight [rad]."""
    return jax.vmap(quaternion_to_euler321)(flown.truth[:, :4])
