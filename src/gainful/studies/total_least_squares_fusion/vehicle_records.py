"""A vehicle in six degrees of freedom, moved in all of them, and what two sensors make of it."""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...plants import MarineMotion, bluerov2

STEP = 0.05  # s
SAMPLES, CLEAN_SAMPLES = 3000, 4000
"""Of a record with noise, and of the one without."""
FORCE_STD, MOMENT_STD = 0.5, 0.02  # N, N m
GROUPS = {
    "mass": ("masses and inertias", slice(0, 6)),
    "lever": ("lever of the mass, m z_G", slice(6, 7)),
    "linear": ("linear drag", slice(7, 13)),
    "quadratic": ("quadratic drag", slice(13, 19)),
    "excess": ("excess weight, W - B", slice(19, 20)),
    "righting": ("righting moment, z_G W", slice(20, 21)),
}
"""Groups of parameters that are told together: their names, and where they stand among the parameters."""


def own_columns(dof: int) -> np.ndarray:
    """Where inertia, linear and quadratic drag of a degree of freedom stand among the parameters."""
    return np.array([GROUPS[group][1].start + dof for group in ("mass", "linear", "quadratic")])


class VehicleRecord(eqx.Module):
    """Two sensors of velocity and attitude, and one wrench; the noise of the velocities is known.

    Attributes:
        nu: velocity and turn rate of the two (2, T, 6).
        attitude: roll and pitch of the two (2, T, 2).
        wrench: forces and moments (T, 6).
        std: standard deviation of either's velocities.
        truth: the parameters, which only the judges see.
    """

    nu: Float[Array, "2 T 6"]
    attitude: Float[Array, "2 T 2"]
    wrench: Float[Array, "T 6"]
    std: Float[Array, ""]
    truth: dict[str, Float[Array, "n"]]


def wrench(t: Float[Array, ""]) -> Float[Array, "6"]:
    """What moves the vehicle: five sines in each degree of freedom, none at the frequency of another [N, N m]."""
    i, k = jnp.arange(6)[:, None], jnp.arange(1, 6)
    phase = 2.0 * jnp.pi * ((0.618034 * (k + 5 * i) ** 2) % 1.0)
    amplitude = jnp.array([9.0, 9.0, 5.0, 0.3, 0.3, 0.5])  # N, N m
    frequency = 0.02 + 0.045 * k + 0.007 * i  # Hz
    return 0.5 * amplitude * jnp.sin(2.0 * jnp.pi * frequency * t + phase).sum(axis=1)


@functools.cache
def motion(samples: int) -> MarineMotion:
    """The vehicle from rest."""
    return bluerov2().simulate(STEP * jnp.arange(samples), wrench)


class Diving(eqx.Module):
    """From a random key to a record; a key draws the same random numbers whatever else is different.

    Attributes:
        motion: of the vehicle.
        theta: its parameters (n,).
        nu_std: standard deviation of either sensor's velocities.
        attitude_std: of their roll and pitch.
        wrench_std: of the wrench (6,).
    """

    motion: MarineMotion
    theta: Float[Array, "n"]
    nu_std: Float[Array, ""]
    attitude_std: Float[Array, ""]
    wrench_std: Float[Array, "6"]

    def __call__(self, key: Array) -> VehicleRecord:
        moving, turning, pushing = jax.random.split(key, 3)
        rows = len(self.motion.t)
        return VehicleRecord(
            self.motion.nu + self.nu_std * jax.random.normal(moving, (2, rows, 6)),
            self.motion.attitude[:, :2] + self.attitude_std * jax.random.normal(turning, (2, rows, 2)),
            self.motion.wrench + self.wrench_std * jax.random.normal(pushing, (rows, 6)),
            self.nu_std,
            {"theta": self.theta},
        )


def diving(samples: int, nu_std: float, attitude_std: float) -> Diving:
    """Records of the vehicle.

    Args:
        samples: how many, `STEP` apart.
        nu_std: standard deviation of either sensor's velocities [m/s, rad/s].
        attitude_std: of their roll and pitch [rad].
    """
    wrench_std = jnp.array([FORCE_STD] * 3 + [MOMENT_STD] * 3)
    return Diving(motion(samples), bluerov2().parameters, jnp.asarray(nu_std), jnp.asarray(attitude_std), wrench_std)


class CleanRecord(eqx.Module):
    """Rows with the true accelerations.

    Attributes:
        rows: `[h, tau]` of the six equations (T, 6, p).
        truth: the parameters.
    """

    rows: Float[Array, "T 6 p"]
    truth: dict[str, Float[Array, "n"]]


class Undisturbed(eqx.Module):
    """The same record for any key.

    Attributes:
        record: it.
    """

    record: CleanRecord

    def __call__(self, key: Array) -> CleanRecord:
        return self.record


def undisturbed() -> Undisturbed:
    """The coupled motion without noise."""
    vehicle, moved = bluerov2(), motion(CLEAN_SAMPLES)
    columns = vehicle.regressor(moved.nudot, moved.nu, moved.attitude)
    return Undisturbed(
        CleanRecord(jnp.concatenate([columns, moved.wrench[..., None]], axis=-1), {"theta": vehicle.parameters})
    )
