"""What goes into a closed loop beside plant and controller, and what comes out."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..models import AbstractModel

Fault = Callable[[Array, Array], Array]
"""A pure function of a value and the time [s]: the value as it is instead."""


class Rates(eqx.Module):
    """How often things happen: everything is a whole number of steps of the simulation.

    Attributes:
        step: of the simulation [s].
        measure: steps from one reading of the sensors, and row of the record, to the next.
        control: steps from one command to the next; it is held in between.
        estimate: steps from one step of the estimator to the next.
    """

    step: float = eqx.field(static=True, default=0.01)  # s
    measure: int = eqx.field(static=True, default=5)
    control: int = eqx.field(static=True, default=10)
    estimate: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        if not (self.step > 0 and math.isfinite(self.step)):
            raise ConfigError(f"step: expected a time above 0 s, got {self.step!r}")
        for name in ("measure", "control", "estimate"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < 1:
                raise ConfigError(f"{name}: expected a whole number of steps of at least 1, got {value!r}")


class Observer(eqx.Module):
    """An estimator in the loop, with the model it believes in and where it starts."""

    estimator: AbstractEstimator
    model: AbstractModel
    prior: AbstractEstimate


class Simulated(eqx.Module):
    """What happened in a closed loop, one row per reading.

    Attributes:
        t: times [s] (T,).
        truth: the plant's state in its model's coordinates (T, size).
        y: readings, NaN where a fault took them away (T, output size).
        u: inputs of the model for the interval that ends at each row (T, inputs); make_log takes them as they are.
        command: what the controller asked for, held from each row on (T, actuators).
        applied: what the actuators were set to on average over the interval that ends at each row (T, actuators).
        state: the plant's own state.
        info: the estimator's latest report; None without one.
        report: what the controller tells of itself after it has acted, `AbstractController.report`; None for nothing.
    """

    t: Float[Array, " T"]
    truth: Float[Array, "T size"]
    y: Float[Array, "T output_size"]
    u: Float[Array, "T inputs"]
    command: Float[Array, "T actuators"]
    applied: Float[Array, "T actuators"]
    state: Any
    info: Info | None
    report: Any = None


def no_fault(value: Array, t: Array) -> Array:
    """The value as it is."""
    return value
