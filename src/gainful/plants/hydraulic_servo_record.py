"""Records of a hydraulic servo axis, with the noise, the faults and the plant of one's choice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError, did_you_mean
from ..models import Instant, Sample, runge_kutta_4
from ..running.disturbances import AbstractDisturbance, Drawn, GaussianNoise
from .hydraulic_servo import SUBSTEPS, HydraulicServo
from .hydraulic_servo_parameters import STEP, HydraulicServoParameters, servo_numbers
from .hydraulic_servo_reduced import (
    MEASUREMENT_SIGMAS,
    PROCESS_SIGMAS,
    SENSORS,
    ReducedHydraulicServo,
    sensor_rows,
)

Plant = Literal["reduced", "full"]
"""What moves: the model the filter has, or both chambers with square-root flow and Stribeck friction."""


class ServoRecord(eqx.Module):
    """What happened to a servo axis, one row per sample of 1 ms.

    Attributes:
        t: times [s]; the start is at 0, one step before the first sample (T,).
        u: voltage of the valve, held over the interval that ends at each row [V] (T, 1).
        y: readings of the sensors in multiples of their scales (T, m).
        states: true position, velocity and load pressure in multiples of their scales (T, 3).
        parameters: true `p1` and `p2` over the interval, as the reduced model should find them (T, 2).
        variance: mean square of the noise in each reading for one who knows which are outliers (T, m).
        plant: the full plant's own states [m, m/s, Pa, Pa] (T, 4); the reduced plant's are `states` (T, 3).
    """

    t: Float[Array, " T"]
    u: Float[Array, "T 1"]
    y: Float[Array, "T m"]
    states: Float[Array, "T 3"]
    parameters: Float[Array, "T 2"]
    variance: Float[Array, "T m"]
    plant: Float[Array, "T n"]

    @property
    def samples(self) -> Sample:
        """Stacked along time, for the reduced model."""
        when = Instant(self.t, jnp.full_like(self.t, STEP), self.u)
        return Sample(when, self.y, jnp.ones(self.y.shape, bool))

    @property
    def told_samples(self) -> Sample:
        """The same with the variance of every reading among the inputs, for a reduced model with `told_variances`."""
        return told_variances(self.samples, self.variance)

    @property
    def truth(self) -> dict[str, Float[Array, " T"]]:
        """True states and parameters by their names in the reduced model."""
        columns = jnp.concatenate([self.states, self.parameters], axis=1).T
        return dict(zip((*SENSORS, "p1", "p2"), columns, strict=True))


def told_variances(samples: Sample, variance: Float[Array, "T m"]) -> Sample:
    """Samples with the variance of every reading among the inputs."""
    u = jnp.concatenate([samples.when.u, variance], axis=1)
    return eqx.tree_at(lambda each: each.when.u, samples, u)


def sample_times(steps: int) -> Float[Array, " steps"]:
    """Times of the samples of a record [s]: 1 ms, 2 ms, ..."""
    return STEP * jnp.arange(1, steps + 1)


def interval_times(steps: int) -> Float[Array, " steps"]:
    """Middles of the intervals that end at the samples [s], where parameters and voltages are looked up.

    A fault from 0.6 s on is then there in the interval from 0.600 s to 0.601 s and in none before, free of rounding.
    """
    return STEP * (jnp.arange(steps) + 0.5)


def drive_servo(
    voltage: Float[Array, " T"],
    parameters: Float[Array, "T 2"] | None = None,
    *,
    key: Array,
    plant: Plant = "reduced",
    measurement_noise: AbstractDisturbance | None = None,
    process_noise: AbstractDisturbance | None = None,
    sensors: Sequence[str] = SENSORS,
    measurement_sigmas: Sequence[float] | Float[Array, "3"] = MEASUREMENT_SIGMAS,
    process_sigmas: Sequence[float] | Float[Array, "3"] = PROCESS_SIGMAS,
    numbers: HydraulicServoParameters | Mapping[str, float] | None = None,
) -> ServoRecord:
    """Drive a servo axis with a voltage and record it: in row i the parameters are set to `parameters[i]`, the plant moves
    for 1 ms under `voltage[i]` and process noise, and the sensors read.

    Pure: `jax.vmap(lambda key: drive_servo(u, key=key))(keys)` draws many records. The same key draws the same noise
    whatever voltage, parameters and sensors are.

    Args:
        voltage: of the valve, one per interval [V]; see `prbs`, `multisine`, `chirp` and `staircase`.
        parameters: `p1` and `p2`, one row per interval; all 1 by default. See `parameter_tracks` and `reflected_walk`.
        key: random key.
        plant: "reduced", the plant that the filter's model describes, or "full".
        measurement_noise: law of the noise in the readings; Gaussian by default.
        process_noise: law of the noise added to the states at every step, or, on the full plant, of the force on the
            load, held for a step; Gaussian by default.
        sensors: any of "position", "velocity" and "load_pressure".
        measurement_sigmas: nominal standard deviation of each of the three readings.
        process_sigmas: nominal standard deviation of the noise added to each state of the reduced plant; the full plant's
            force has its own among `numbers`.
        numbers: of the axis, or those that differ from the default, by name.

    Raises:
        ModelError: an unknown plant, sensor or number.
        ShapeError: a voltage that is no vector, or parameters that do not fit it.

    Source: Jelali and Kroll (2003), Hydraulic Servo-systems, chapter 4, for the plant.

    Example:
        >>> from gainful.plants import prbs
        >>> record = drive_servo(prbs(100), key=jax.random.key(0))
        >>> record.y.shape, record.truth["p2"].shape
        ((100, 3), (100,))
    """
    voltage = jnp.asarray(voltage, float)
    if voltage.ndim != 1 or not voltage.shape[0]:
        raise ShapeError(f"voltage: expected a vector, got shape {voltage.shape}")
    steps = voltage.shape[0]
    parameters = jnp.ones((steps, 2)) if parameters is None else jnp.asarray(parameters, float)
    if parameters.shape != (steps, 2):
        raise ShapeError(f"parameters: expected shape ({steps}, 2), got {parameters.shape}")
    if plant not in get_args(Plant):
        raise ModelError(f"plant: {plant!r} is not one; {did_you_mean(str(plant), get_args(Plant))}")
    own = servo_numbers(numbers)
    measuring, processing = jax.random.split(key)
    noise = _law(measurement_noise).realise(measuring, steps, jnp.asarray(measurement_sigmas, float))
    sigma = jnp.asarray(process_sigmas, float) if plant == "reduced" else own.load_force[None]
    push = _law(process_noise).draw(processing, steps, sigma)
    move = _reduced if plant == "reduced" else _full
    moved, states, found = move(own, voltage, parameters, push)
    columns = jnp.asarray(sensor_rows(sensors))
    kept = Drawn(noise.values[:, columns], noise.variance[:, columns])
    return ServoRecord(
        sample_times(steps), voltage[:, None], states[:, columns] + kept.values, states, found, kept.variance, moved
    )


def _law(given: AbstractDisturbance | None) -> AbstractDisturbance:
    return GaussianNoise() if given is None else given


def _reduced(
    numbers: HydraulicServoParameters, voltage: Array, parameters: Array, push: Array
) -> tuple[Array, Array, Array]:
    """The reduced plant from rest: its own states, those of the reduced model, and its parameters."""
    servo = ReducedHydraulicServo(numbers)

    def step(x: Array, given: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        u, p, w = given
        x = servo.step(x, u, p[0], p[1]) + w
        return x, x

    _, states = jax.lax.scan(step, jnp.zeros(3), (voltage, parameters, push))
    return states, states, parameters


def _full(
    numbers: HydraulicServoParameters, voltage: Array, parameters: Array, push: Array
) -> tuple[Array, Array, Array]:
    """The full plant from rest, likewise; its parameters are those that the reduced model should find."""
    servo = HydraulicServo(numbers)
    h = jnp.asarray(STEP / SUBSTEPS)

    def step(x: Array, given: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        u, p, force = given

        def part(_: int, z: Array) -> Array:
            return runge_kutta_4(lambda own, _: servo.rate(own, u, p[0], p[1], force[0]), z, jnp.zeros(()), h)

        x = jax.lax.fori_loop(0, SUBSTEPS, part, x)
        return x, x

    _, own = jax.lax.scan(step, servo.start, (voltage, parameters, push))
    found = jax.vmap(servo.reference_parameters)(own, parameters[:, 0], parameters[:, 1])
    return own, jax.vmap(servo.scaled)(own), found
