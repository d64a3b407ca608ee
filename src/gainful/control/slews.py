"""Turning from rest to rest."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError
from ..spaces import quaternion_conjugate, quaternion_log, quaternion_multiply, rotate
from .base import AbstractAttitudeReference
from .euler321 import euler321_rates_inverse, euler321_to_quaternion

NEAR = np.radians(85.0)
"""Pitch beyond which the angles of a way point are too near their singularity."""

_SAMPLES = 200
"""Times per slew at which torques are looked at; their peaks are flat."""


def _numbers(value: Any) -> Array:
    return jnp.asarray(value, float)


class QuinticSlews(AbstractAttitudeReference):
    """Slews from one attitude to the next and a hold after each, round and round, each angle along a quintic.

    With `tau` the share of the slew's time and `s = 10 tau^3 - 15 tau^4 + 6 tau^5`, the 3-2-1 angles are
    `start + s (end - start)`: rates and accelerations are zero at both ends. The first slew begins at time 0.

    Attitudes to be compared with it are quaternions (4,) or 3-2-1 angles (3,).

    Attributes:
        way_points: roll, pitch and yaw [rad] one after the other (k, 3); the last leads back to the first.
        duration: of a slew [s].
        hold: between slews [s].

    Raises:
        ShapeError: way points that are not rows of three angles, or fewer than two.
        ConfigError: a way point whose pitch is within 5 degrees of 90, a duration that is not above 0, or a negative hold.

    Example:
        >>> slews = QuinticSlews([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], duration=30.0, hold=15.0)
        >>> slews.angles(30.0).tolist(), round(float(slews.angle_rates(15.0)[0]), 6)  # 15/8 of the mean rate
        ([0.3, 0.0, 0.0], 0.01875)
    """

    way_points: Array = eqx.field(converter=_numbers)
    duration: float = eqx.field(default=30.0)  # s
    hold: float = eqx.field(default=15.0)  # s

    def __check_init__(self) -> None:
        if self.way_points.ndim != 2 or self.way_points.shape[1] != 3 or len(self.way_points) < 2:
            raise ShapeError(
                f"way_points: expected at least two rows of three angles, got shape {self.way_points.shape}"
            )
        if isinstance(self.duration, float | int) and not self.duration > 0:
            raise ConfigError(f"duration: expected a time above 0 s, got {self.duration!r} s")
        if isinstance(self.hold, float | int) and not self.hold >= 0:
            raise ConfigError(f"hold: expected a time of at least 0 s, got {self.hold!r} s")
        if not isinstance(self.way_points, Tracer):
            pitch = np.abs(np.asarray(self.way_points)[:, 1])
            if pitch.max() > NEAR:
                raise ConfigError(
                    f"way_points: expected a pitch within 85 degrees of zero, got {np.degrees(pitch.max()):.4g} degrees; "
                    "3-2-1 angles are singular at 90, so turn the axes they are counted from"
                )

    def angles(self, t: Any) -> Float[Array, "3"]:
        """Roll, pitch and yaw [rad]."""
        start, change, tau = self._segment(t)
        return start + change * (10.0 * tau**3 - 15.0 * tau**4 + 6.0 * tau**5)

    def angle_rates(self, t: Any) -> Float[Array, "3"]:
        """Their rates [rad/s]."""
        _, change, tau = self._segment(t)
        return change * 30.0 * (tau * (1.0 - tau)) ** 2 / self.duration

    def angle_accelerations(self, t: Any) -> Float[Array, "3"]:
        """Their accelerations [rad/s^2]."""
        _, change, tau = self._segment(t)
        return change * 60.0 * tau * (1.0 - tau) * (1.0 - 2.0 * tau) / self.duration**2

    def attitude(self, t: Any) -> Float[Array, "4"]:
        """Quaternion from the target's axes to those the angles are counted from."""
        return euler321_to_quaternion(self.angles(t))

    def target_rate(self, t: Any) -> Float[Array, "3"]:
        return euler321_rates_inverse(self.angles(t)) @ self.angle_rates(t)

    def target_acceleration(self, t: Any) -> Float[Array, "3"]:
        angles, rates = self.angles(t), self.angle_rates(t)
        matrix, change = jax.jvp(euler321_rates_inverse, (angles,), (rates,))
        return matrix @ self.angle_accelerations(t) + change @ rates

    def tracking_error(
        self, attitude: Float[Array, " size"], t: Float[Array, ""]
    ) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        q = euler321_to_quaternion(attitude) if attitude.shape == (3,) else attitude
        relative = quaternion_multiply(quaternion_conjugate(self.attitude(t)), q)
        to_body = jax.vmap(lambda axis: rotate(quaternion_conjugate(relative), axis), out_axes=1)(jnp.eye(3))
        return quaternion_log(relative), to_body

    def _segment(self, t: Any) -> tuple[Array, Array, Array]:
        t, cycle, count = jnp.asarray(t, float), self.duration + self.hold, len(self.way_points)
        k = jnp.floor(t / cycle)
        start, end = (self.way_points[((k + more) % count).astype(int)] for more in (0, 1))
        return start, end - start, jnp.clip((t - k * cycle) / self.duration, 0.0, 1.0)


def slew_torque(
    slews: AbstractAttitudeReference,
    inertia: Float[Array, "3 3"],
    t: Float[Array, ""],
    momentum: Float[Array, "3"] | None = None,
) -> Float[Array, "3"]:
    """What turns a rigid body along a reference, in the target's axes [N m]: `J dw/dt + w x (J w + h)`."""
    rate = slews.target_rate(t)
    stored = jnp.zeros(3) if momentum is None else momentum
    return inertia @ slews.target_acceleration(t) + jnp.cross(rate, inertia @ rate + stored)


class TorqueNeed(eqx.Module):
    """The torque a reference needs, and the torque there is.

    Attributes:
        needed: peak about each axis (3,) [N m].
        available: likewise [N m].
        share: of what is available that may be planned with.
    """

    needed: Float[np.ndarray, "3"]
    available: Float[np.ndarray, "3"]
    share: float

    @property
    def feasible(self) -> bool:
        """Whether each axis has what it needs."""
        return bool((self.needed <= self.share * self.available).all())

    @property
    def longer(self) -> float:
        """How many times as long slews would have to take; torques fall with the square of that."""
        return float(np.sqrt(np.max(self.needed / (self.share * self.available))))

    @property
    def cautions(self) -> tuple[str, ...]:
        """What is asked too much, axis by axis."""
        return tuple(
            f"reference: expected at most {self.share * there:.4g} N m about {axis}, {self.share:g} of {there:.4g} N m "
            f"available, got {asked:.4g}; slews {self.longer:.3g} times as long would do"
            for axis, asked, there in zip("xyz", self.needed, self.available, strict=True)
            if asked > self.share * there
        )


def torque_need(
    slews: QuinticSlews, inertia: Any, max_torque: Any, *, share: float = 0.8, momentum: Any = (0.0, 0.0, 0.0)
) -> TorqueNeed:
    """Whether there is torque enough for all of some slews.

    Args:
        slews: each is looked at once.
        inertia: of the whole (3, 3) [kg m^2].
        max_torque: about each axis (3,), or one number [N m].
        share: what may be planned with; the rest is for disturbances and errors.
        momentum: stored in wheels (3,) [N m s].

    Raises:
        ShapeError: an inertia or limits of another shape.
        ConfigError: a share outside (0, 1], or no torque.
    """
    J, limit = np.asarray(inertia, float), np.asarray(max_torque, float)
    if J.shape != (3, 3):
        raise ShapeError(f"inertia: expected shape (3, 3), got {J.shape}")
    if limit.shape not in ((), (3,)):
        raise ShapeError(f"max_torque: expected one number or 3, got shape {limit.shape}")
    if not (limit > 0).all():
        raise ConfigError(f"max_torque: expected torques above 0, got {limit.tolist()}")
    if not 0 < share <= 1:
        raise ConfigError(f"share: expected a number above 0 and at most 1, got {share!r}")
    within = np.linspace(0.0, float(slews.duration), _SAMPLES + 1)
    cycle = float(slews.duration) + float(slews.hold)
    times = np.concatenate([k * cycle + within for k in range(len(slews.way_points))])
    torque = jax.vmap(lambda t: slew_torque(slews, jnp.asarray(J), t, jnp.asarray(momentum, float)))(jnp.asarray(times))
    return TorqueNeed(np.abs(np.asarray(torque)).max(axis=0), np.broadcast_to(limit, 3), share)
