"""Drives of a land vehicle: how it moves, what its sensors read, and outages of the satellites."""

from __future__ import annotations

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError
from ..models import Instant, Sample
from ..spaces import wrap_angle
from .land_vehicle import INTERVAL, START_SIGMAS, to_east_north, to_forward_right
from .land_vehicle_errors import compass_deviation, lateral_speed, odometer_error
from .track_scenarios import correlated

SLOW = 10
"""Rows between two readings of compass and satellites, which come every second."""
GRAVITY = 9.81  # m/s^2
_SPEEDS, _STOPS, _SPEED_HOLD, _SPEED_LAG, _ACCELERATIONS = (4.0, 20.0), 0.12, (6.0, 25.0), 1.5, (-2.5, 1.8)
_TURNS, _TURNING, _TURN_HOLD, _TURN_LAG, _FASTEST_TURN = (0.25, 1.0), 0.45, (3.0, 9.0), 0.6, 0.35
_COMMANDED, _CORNERING = 2.5, 3.0  # m/s^2
"""Lateral accelerations that a turn is commanded with, and that tyres hold."""


class DriveRecord(eqx.Module):
    """What happened on a drive, one row per 0.1 s, the first at time 0.

    Attributes:
        t: times [s] (T,).
        u: measured specific force forward and to the right [m/s^2] and yaw rate [rad/s] over the interval that ends at
            each row (T, 3).
        y: readings for `land_vehicle` (T, 7).
        seen: which there are (T, 7).
        states: true states, the scale of the odometer 0 (T, 9).
        start: where a filter may begin: the first fix, and the first heading with an error (9,).
    """

    t: Float[Array, " T"]
    u: Float[Array, "T 3"]
    y: Float[Array, "T 7"]
    seen: Bool[Array, "T 7"]
    states: Float[Array, "T 9"]
    start: Float[Array, "9"]

    @property
    def samples(self) -> Sample:
        """Stacked along time, for `land_vehicle`."""
        dt = jnp.where(jnp.arange(len(self.t)) > 0, INTERVAL, 0.0)
        return Sample(Instant(self.t, dt, self.u), self.y, self.seen)

    def with_outage(self, begin: float, end: float) -> DriveRecord:
        """The record without satellites after `begin` and up to `end` [s]."""
        out = (self.t > begin) & (self.t <= end)
        return eqx.tree_at(
            lambda each: each.seen, self, self.seen & ~(out[:, None] & jnp.array([False] * 3 + [True] * 4))
        )


def drive_vehicle(*, key: Array, duration: float = 600.0) -> DriveRecord:
    """A drive through streets, with sensors that err as sensors do.

    Speeds of 4 to 20 m/s with stops, turns with up to 0.3 g, grades. Errors that repeat are those of `odometer_error`,
    `lateral_speed` and `compass_deviation`; besides, scale errors of gyro (2 %) and lateral accelerometer (8 %), biases that
    walk, and satellite positions whose error is correlated over 100 s. Nothing of that is known to `land_vehicle`.

    Pure: `jax.vmap(lambda key: drive_vehicle(key=key))(keys)` draws many drives.

    Args:
        key: random key.
        duration: of the drive [s].

    Raises:
        ConfigError: a duration below one second.

    Example:
        >>> drive_vehicle(key=jax.random.key(0), duration=30.0).y.shape
        (301, 7)
    """
    if not duration >= 1.0:
        raise ConfigError(f"duration: expected at least 1 s, got {duration!r}")
    rows = round(duration / INTERVAL) + 1
    route, noise = jax.random.split(key)
    speed, acceleration, turn, heading = _route(route, rows)
    right = lateral_speed(speed, turn)
    velocity = jax.vmap(to_east_north)(heading, speed, right)
    position = jnp.cumsum(velocity * INTERVAL, axis=0)
    position = position - position[0]
    # What turns the measured force into exactly this motion, with the heading at the interval's start.
    force = jax.vmap(to_forward_right)(heading[:-1], *(jnp.diff(velocity, axis=0) / INTERVAL).T)
    force = jnp.concatenate([jnp.zeros((1, 2)), force])
    keys = jax.random.split(noise, 8)

    def white(k: int, *columns: int) -> Array:
        return jax.random.normal(keys[k], (rows, *columns), float)

    def walk(k: int, start: float, step: float) -> Array:
        first, *moves = jnp.split(white(k, 1)[:, 0], [1])
        return jnp.concatenate([start * first, start * first + step * jnp.cumsum(moves[0])])

    biases = jnp.stack(
        [walk(0, 0.08, 2e-4), walk(1, 0.08, 2e-4), walk(2, math.radians(0.2), math.radians(0.001))], axis=1
    )
    read, grade = white(3, 5), 0.02 * correlated(white(4), jnp.exp(-INTERVAL / 15.0))
    u = jnp.stack(
        [force[:, 0] + GRAVITY * grade, 1.08 * force[:, 1], 1.02 * jnp.concatenate([jnp.zeros(1), turn[1:]])], axis=1
    )
    u = u + biases + read[:, :3] * jnp.array([0.03, 0.03, math.radians(0.1)])
    u = u.at[0].set(0.0)  # no interval ends at the first row
    drift = jnp.stack([correlated(each, jnp.exp(-INTERVAL / 100.0)) for each in white(5, 2).T], axis=1)
    satellites = white(6, 4)
    fix = position + 0.8 * drift + satellites[:, :2]
    fix_velocity = velocity + 0.08 * satellites[:, 2:]
    compass = wrap_angle(heading + compass_deviation(heading) + math.radians(1.5) * read[:, 4])
    odometer = speed + odometer_error(speed, acceleration) + 0.05 * read[:, 3]
    y = jnp.stack(
        [odometer, jnp.zeros(rows), compass, fix[:, 0], fix_velocity[:, 0], fix[:, 1], fix_velocity[:, 1]], axis=1
    )
    slow = (np.arange(rows) % SLOW == 0)[:, None] | (np.arange(7) < 2)
    states = jnp.concatenate([position, velocity, wrap_angle(heading)[:, None], biases, jnp.zeros((rows, 1))], axis=1)
    off = START_SIGMAS[4] * jax.random.normal(keys[7], (), float)
    start = jnp.concatenate([fix[0], fix_velocity[0], wrap_angle(heading[:1] + off), jnp.zeros(4)])
    return DriveRecord(INTERVAL * jnp.arange(float(rows)), u, y, jnp.asarray(slow), states, start)


def _route(key: Array, rows: int) -> tuple[Array, Array, Array, Array]:
    """Speed, acceleration, yaw rate and heading, row by row."""
    speeds, stops, turns, rates, sides, first, holds, turn_holds = jax.random.split(key, 8)

    def uniform(own: Array, count: int, low: float, high: float) -> Array:
        return low + (high - low) * jax.random.uniform(own, (count,), float)

    legs, curves = (int(rows * INTERVAL / hold[0]) + 1 for hold in (_SPEED_HOLD, _TURN_HOLD))
    wanted = jnp.where(jax.random.uniform(stops, (legs,)) < _STOPS, 0.0, uniform(speeds, legs, *_SPEEDS))
    side = jax.random.rademacher(sides, (curves,), float) * uniform(rates, curves, *_TURNS)
    side = jnp.where(jax.random.uniform(turns, (curves,)) < _TURNING, side, 0.0)
    t = INTERVAL * jnp.arange(rows)
    leg = jnp.searchsorted(jnp.cumsum(uniform(holds, legs, *_SPEED_HOLD)), t)
    curve = jnp.searchsorted(jnp.cumsum(uniform(turn_holds, curves, *_TURN_HOLD)), t)

    def move(now: tuple[Array, Array], asked: tuple[Array, Array]) -> tuple[tuple[Array, Array], tuple[Array, ...]]:
        (v, r), (target, turn) = now, asked
        a = jnp.clip((target - v) / _SPEED_LAG, *_ACCELERATIONS)
        after = jnp.maximum(v + a * INTERVAL, 0.0)
        rate = turn * jnp.minimum(_FASTEST_TURN, _COMMANDED / jnp.maximum(target, 3.0)) * jnp.minimum(v / 4.0, 1.0)
        r = r + (rate - r) / _TURN_LAG * INTERVAL
        most = _CORNERING / jnp.maximum(after, 3.0)
        r = jnp.clip(r, -most, most)
        return (after, r), (after, a, r)

    start = (jnp.zeros(()), jnp.zeros(()))
    speed, acceleration, turn = jax.lax.scan(move, start, (wanted[leg], side[curve]))[1]
    heading = 2.0 * jnp.pi * jax.random.uniform(first, (), float) + jnp.cumsum(turn * INTERVAL) - turn[0] * INTERVAL
    return speed, acceleration, turn, heading
