"""What happens to the axis: 1.5 s of a pseudo-random voltage, parameters that change, sensors that err."""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ...faults import Bias, Intermittent, parameter_tracks, ramp, reflected_walk
from ...models import Sample
from ...plants import drive_servo, interval_times, prbs
from ...plants.hydraulic_servo_record import Plant
from ...running import AbstractDisturbance, GaussianMixture, ImpulseBursts, SkewedOutliers, StudentTNoise
from ..experiment import Record

SAMPLES = 1500  # of 1 ms
SETTLED = 200  # samples; the transient of the start is over
ONSETS = (600, 900)  # samples; p1 and p2 jump
WALK = 0.003  # per sample; of parameters that walk at random

GROSS = 10.0
"""Standard deviation of a gross error, in sigmas."""


def mixture(share: float = 0.1) -> GaussianMixture:
    """Gaussian noise of which a share are gross errors; without any it is Gaussian, from the same random numbers."""
    return GaussianMixture(jnp.asarray(share, float), jnp.asarray(GROSS))


NOISES: dict[str, AbstractDisturbance] = {
    "gaussian": mixture(0.0),
    "mixture": mixture(),
    "t3": StudentTNoise(3.0),
    "bursts": ImpulseBursts(0.02, 5, 16.7),
    "skewed": SkewedOutliers(0.1, GROSS),
}
"""Laws of the sensors' noise."""


def _jump(parameter: str, size: float, onset: float) -> Bias:
    return Bias(signal=parameter, size=size, onset=onset)


def _coming_and_going(fault: Bias) -> Intermittent:
    return Intermittent(fault, 0.4)  # type: ignore[call-arg]  # onset and end are the fault's own


@functools.cache
def track(kind: str) -> Float[Array, "T 2"]:
    """The parameters over the record: "constant", or with an "abrupt", "ramp" or "intermittent" fault."""
    jumps = _jump("p1", 1.0, 0.6), _jump("p2", -0.4, 0.9)
    both = jumps[0], _jump("p2", -0.3, 0.6)
    faults = {
        "constant": (),
        "abrupt": jumps,
        "ramp": (*ramp("p1", 1.0, 0.45, 1.05), *ramp("p2", -0.4, 0.45, 1.05)),
        "intermittent": tuple(map(_coming_and_going, both)),
    }[kind]
    return parameter_tracks(interval_times(SAMPLES), {"p1": 1.0, "p2": 1.0}, faults)


TRACKS = ("constant", "abrupt", "ramp", "intermittent")
"""Tracks by name."""


class Drive(eqx.Module):
    """From a random key to a record of the axis; a key draws the same random numbers whatever else is different.

    Attributes:
        noise: law of the sensors' noise.
        process: law of the noise of the states, or of the force on the load of the full plant.
        track: parameters over the record, to which their walk is added (T, 2).
        walk: standard deviation of their walk per sample.
        seen: which sensors there are: position, velocity, load pressure.
        plant: "reduced" or "full".
    """

    noise: AbstractDisturbance
    process: AbstractDisturbance
    track: Float[Array, "T 2"]
    walk: Float[Array, ""]
    seen: Bool[Array, "3"]
    plant: Plant = eqx.field(static=True, default="reduced")

    def __call__(self, key: Array) -> Record:
        walking, driving = jax.random.split(key)
        steps = len(self.track)
        free = [reflected_walk(one, steps, self.walk) for one in jax.random.split(walking)]
        record = drive_servo(
            prbs(steps),
            self.track + jnp.stack(free, axis=1) - 1.0,
            key=driving,
            plant=self.plant,
            measurement_noise=self.noise,
            process_noise=self.process,
        )
        samples = Sample(record.samples.when, record.y, jnp.broadcast_to(self.seen, record.y.shape))
        truth = {
            "t": record.t,
            "states": record.states,
            "parameters": record.parameters,
            "variance": record.variance,
        }
        return Record(samples, truth)


def drive(
    noise: AbstractDisturbance,
    kind: str = "constant",
    *,
    walk: float = 0.0,
    process: float = 0.0,
    sensors: tuple[bool, bool, bool] = (True, True, True),
    plant: Plant = "reduced",
) -> Drive:
    """Records with a law of the sensors' noise.

    Args:
        noise: of the sensors.
        kind: of the track.
        walk: standard deviation of the parameters' walk per sample.
        process: share of gross errors in the noise of the states.
        sensors: which there are: position, velocity, load pressure.
        plant: "reduced" or "full".
    """
    return Drive(noise, mixture(process), track(kind), jnp.asarray(walk, float), jnp.asarray(sensors), plant)
