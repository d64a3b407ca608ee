"""A hydraulic servo axis in three states without dimension: what a filter at 1 ms believes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, did_you_mean
from ..models import Model, discrete_model, runge_kutta_4, sensor
from .hydraulic_servo_parameters import STEP, HydraulicServoParameters, servo_numbers

SENSORS = ("position", "velocity", "load_pressure")
"""Sensors by name, in the order of the states they read."""
MEASUREMENT_SIGMAS = (0.01, 0.02, 0.05)  # of the states' scales: 0.1 mm, 4 mm/s, 0.05 MPa
PROCESS_SIGMAS = (5e-4, 5e-3, 2e-2)  # of the states' scales, per step of 1 ms


class ReducedHydraulicServo(eqx.Module):
    """Position, velocity and load pressure in multiples of their scales, at mid stroke.

    ```
    x1' = a12 x2
    x2' = -a21 x1 - p1 a22 x2 + a23 x3 - a_C tanh(v_n x2 / v_0)
    x3' = p2 (-a32 x2 - a33 x3 + b3 g(u) u)
    ```

    With the load pressure `p_L = p_A - r p_B` the force of the oil is exactly `A_A p_L`; the rest is the full axis, linear
    about the centre but for Coulomb friction, where one flow gain stands for the valve and `a33` for leakage and for the
    flow a valve loses under load.

    Attributes:
        parameters: numbers of the axis.
        asymmetric: whether the valve's flow differs between the directions, `g = extending_gain` or `retracting_gain`, as
            it does on a differential cylinder; `g = 1` if not.

    Source: Merritt (1967), Hydraulic Control Systems, chapter 6, for the load pressure.
    """

    parameters: HydraulicServoParameters = eqx.field(default_factory=HydraulicServoParameters)
    asymmetric: bool = eqx.field(static=True, default=False)

    @property
    def coefficients(self) -> dict[str, Float[Array, ""]]:
        """`a12`, `a21`, `a22`, `a23`, `a_C`, `a32`, `a33` [1/s] and `b3` [1/(s V)]."""
        own = self.parameters
        y, v, p = own.scales
        stiffness, leak = own.stiffness(own.centre), own.leak_stiffness(own.centre)
        return {
            "a12": v / y,
            "a21": own.spring * y / (own.mass * v),
            "a22": own.viscous_friction / own.mass,
            "a23": own.area_a * p / (own.mass * v),
            "a_C": own.coulomb_friction / (own.mass * v),
            "a32": own.bulk_modulus * own.area_a * v * stiffness / p,
            "a33": own.bulk_modulus * own.flow_pressure * leak,
            "b3": own.bulk_modulus * own.flow_gain * stiffness / p,
        }

    def rate(
        self, state: Float[Array, "3"], voltage: Float[Array, ""], p1: Float[Array, ""], p2: Float[Array, ""]
    ) -> Float[Array, "3"]:
        """Rate of change of the state [1/s] under a voltage of the valve [V]."""
        a, own = self.coefficients, self.parameters
        x1, x2, x3 = state
        dry = a["a_C"] * jnp.tanh(own.scales[1] * x2 / own.friction_velocity)
        gain = jnp.where(voltage > 0, own.extending_gain, own.retracting_gain) if self.asymmetric else 1.0
        return jnp.stack(
            [
                a["a12"] * x2,
                -a["a21"] * x1 - p1 * a["a22"] * x2 + a["a23"] * x3 - dry,
                p2 * (-a["a32"] * x2 - a["a33"] * x3 + a["b3"] * gain * voltage),
            ]
        )

    def step(
        self,
        state: Float[Array, "3"],
        voltage: Float[Array, ""],
        p1: Float[Array, ""],
        p2: Float[Array, ""],
        dt: float | Float[Array, ""] = STEP,
    ) -> Float[Array, "3"]:
        """The state an interval later, by one Runge-Kutta step with the voltage held."""
        return runge_kutta_4(lambda x, _: self.rate(x, voltage, p1, p2), state, jnp.zeros(()), jnp.asarray(dt))


class _Motion(eqx.Module):
    servo: ReducedHydraulicServo

    def __call__(self, x: Array, u: Array, t: Array, dt: Array, p: dict[str, Array]) -> Array:
        return self.servo.step(x, u[0], p["p1"], p["p2"], dt)


class _StepNoise(eqx.Module):
    """White noise given by what a step of 1 ms adds."""

    variances: Array

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        return jnp.diag(self.variances * (dt / STEP))


class _Reading(eqx.Module):
    row: int = eqx.field(static=True)

    def __call__(self, x: Array) -> Array:
        return x[self.row : self.row + 1]


class _Told(eqx.Module):
    """The variance that an input tells."""

    row: int = eqx.field(static=True)

    def __call__(self, x: Array, u: Array) -> Array:
        return u[self.row][None, None]


def hydraulic_servo_reduced(
    numbers: HydraulicServoParameters | Mapping[str, float] | None = None,
    *,
    sensors: Sequence[str] = SENSORS,
    asymmetric: bool = False,
    process_sigmas: Sequence[float] = PROCESS_SIGMAS,
    measurement_sigmas: Sequence[float] = MEASUREMENT_SIGMAS,
    told_variances: bool = False,
) -> Model:
    """The model of the reduced axis: three states without dimension, moved by one Runge-Kutta step per interval.

    `augment(model, parameters={"p1": walk, "p2": walk})` estimates viscous friction and bulk modulus in multiples of their
    nominal values; a walk of `q` per step of 1 ms is `q / sqrt(1e-3)` there. Give `max_step` to `make_log` for
    intervals above 4 ms: the oil column swings at 45 Hz.

    Args:
        numbers: of the axis, or those that differ from the default, by name.
        sensors: any of "position", "velocity" and "load_pressure".
        asymmetric: whether the valve's flow differs between the directions.
        process_sigmas: standard deviation of the noise a step of 1 ms adds to each state.
        measurement_sigmas: standard deviation of each of the three readings.
        told_variances: whether further inputs `variance_<sensor>` tell the variance of every single reading, for a filter
            that knows where the outliers are.

    Raises:
        ModelError: an unknown sensor or number, or not three sigmas.

    Source: Merritt (1967), Hydraulic Control Systems, chapter 6, for the load pressure.

    Example:
        >>> hydraulic_servo_reduced(sensors=("position",)).output.names
        ('measured_position',)
    """
    servo = ReducedHydraulicServo(servo_numbers(numbers), asymmetric)
    rows = sensor_rows(sensors)
    for name, given in (("process_sigmas", process_sigmas), ("measurement_sigmas", measurement_sigmas)):
        if np.shape(given) != (len(SENSORS),):
            raise ModelError(f"{name}: expected {len(SENSORS)} numbers, one per state, got shape {np.shape(given)}")
    inputs = {"voltage": "V"} | ({f"variance_{name}": "1" for name in sensors} if told_variances else {})
    variances = jnp.asarray(measurement_sigmas, float) ** 2
    return discrete_model(
        _Motion(servo),
        states=dict.fromkeys(SENSORS, "1"),
        inputs=inputs,
        Q=_StepNoise(jnp.asarray(process_sigmas, float) ** 2),
        sensors=[
            sensor(
                name,
                _Reading(row),
                outputs={f"measured_{name}": "1"},
                R=_Told(1 + place) if told_variances else variances[row],
            )
            for place, (name, row) in enumerate(zip(sensors, rows, strict=True))
        ],
        parameters={"p1": 1.0, "p2": 1.0},
    )


def sensor_rows(sensors: Sequence[str]) -> tuple[int, ...]:
    """Which states the sensors read."""
    for name in sensors:
        if name not in SENSORS:
            raise ModelError(f"sensors: {name!r} is not one of the axis; {did_you_mean(str(name), SENSORS)}")
    return tuple(SENSORS.index(name) for name in sensors)
