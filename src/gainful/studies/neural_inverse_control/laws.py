"""Control laws without a network, designed for the nominal spacecraft."""

from __future__ import annotations

import functools

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...control import (
    IncrementalInversion,
    LinearPlant,
    QuinticSlews,
    SlewStates,
    StateFeedback,
    TrackingController,
    linearised,
    lqi,
    lqr,
)
from ...plants import FlexibleSpacecraft, flexible_spacecraft_model
from ...plants.flexible_spacecraft import MAX_TORQUE
from .contenders import CONTROLLED, PANEL_GAIN, QUASI_STATIC, rate_command
from .scenarios import GENTLE, NOMINAL, STEP

ANGLES, RATES = slice(0, 3), slice(6, 9)
HUB_INERTIA = 3000.0  # kg m^2, which makes an energy of the panel a square of angles and rates


class RateFirst(eqx.Module):
    """The rates of a reading, then its quaternion."""

    def __call__(self, y: Float[Array, "13"]) -> Float[Array, "7"]:
        return jnp.concatenate([y[7:10], y[:4]])


@functools.cache
def linear_plant() -> LinearPlant:
    """The nominal spacecraft about rest, a sample at a time; its states are those of the networks."""
    model = flexible_spacecraft_model(FlexibleSpacecraft(NOMINAL))
    rest = np.zeros(13)
    rest[3] = 1.0
    return linearised(model, rest, np.zeros(3), STEP)


def feedback(
    gain: Float[np.ndarray, "3 12"],
    integral_gain: Float[np.ndarray, "3 3"] | None = None,
    *,
    slews: QuinticSlews = GENTLE,
) -> StateFeedback:
    """Linear feedback of the state, with the torque that the slews ask of a rigid body fed forward."""
    integrated = np.zeros((3, 12))
    integrated[:, ANGLES] = np.eye(3)
    return StateFeedback(
        gain,
        SlewStates(slews, NOMINAL.inertia, QUASI_STATIC, attitude="angles"),
        CONTROLLED,
        limit=jnp.asarray(MAX_TORQUE),
        integral_gain=np.zeros((3, 3)) if integral_gain is None else integral_gain,
        integrated=integrated,
        interval=jnp.asarray(STEP),
    )


def pd(frequency: float, damping: float, *, slews: QuinticSlews = GENTLE) -> StateFeedback:
    """Proportional and differential feedback.

    Args:
        frequency: of a rigid body's loop [rad/s].
        damping: ratio of it.
        slews: asked for.
    """
    inertia, gain = np.asarray(NOMINAL.inertia), np.zeros((3, 12))
    gain[:, ANGLES], gain[:, RATES] = frequency**2 * inertia, 2 * damping * frequency * inertia
    return feedback(gain, slews=slews)


def pid(frequency: float, damping: float, integral: float, *, slews: QuinticSlews = GENTLE) -> TrackingController:
    """Computed torque with an integral that does not wind up.

    Args:
        frequency: of a rigid body's loop [rad/s].
        damping: ratio of it.
        integral: gain of the integral over the frequency's cube.
        slews: asked for.
    """
    numbers = (frequency**2, 2 * damping * frequency)
    return TrackingController(
        NOMINAL.inertia,
        jnp.eye(3),
        jnp.full(3, MAX_TORQUE),
        slews,
        *map(jnp.asarray, numbers),  # type: ignore[arg-type]  # arrays
        k_i=jnp.asarray(integral * frequency**3),
        interval=jnp.asarray(STEP),
        arrange=RateFirst(),
    )


def _state_cost(angle: float, rate: float, panel: float) -> Float[np.ndarray, "12"]:
    energy = panel / HUB_INERTIA
    stiffness, mass = np.asarray(NOMINAL.modal_stiffness), np.asarray(NOMINAL.modal_mass)
    return np.concatenate([[angle] * 3, energy * stiffness, [rate] * 3, energy * mass])


def _torque_cost(effort: float) -> Float[np.ndarray, "3"]:
    return effort / np.diag(np.asarray(NOMINAL.inertia)) ** 2


def regulator(angle: float, rate: float, panel: float, effort: float, *, slews: QuinticSlews = GENTLE) -> StateFeedback:
    """The linear quadratic regulator of hub and panel.

    Args:
        angle: cost of an angle.
        rate: cost of a rate [s^2].
        panel: cost of the panel's energy.
        effort: cost of an acceleration by the torque [s^4].
        slews: asked for.
    """
    return feedback(lqr(linear_plant(), _state_cost(angle, rate, panel), _torque_cost(effort))[0], slews=slews)


def integral_regulator(
    angle: float, rate: float, integral: float, effort: float, panel: float = 0.1, *, slews: QuinticSlews = GENTLE
) -> StateFeedback:
    """The same with integrals of the angles that do not wind up.

    Args:
        angle: cost of an angle.
        rate: cost of a rate [s^2].
        integral: cost of an angle's integral [1/s^2].
        effort: cost of an acceleration by the torque [s^4].
        panel: cost of the panel's energy.
        slews: asked for.
    """
    outputs = np.eye(3, 12)
    cost = _state_cost(angle, rate, panel)
    return feedback(*lqi(linear_plant(), outputs, cost, _torque_cost(effort), [integral] * 3, STEP), slews=slews)


def incremental(
    contraction: float, panel_gain: tuple[float, float, float] = PANEL_GAIN, *, slews: QuinticSlews = GENTLE
) -> IncrementalInversion:
    """Incremental inversion of the rates with the nominal effectiveness of the torques.

    Args:
        contraction: share of a rate's error to be gone after a sample.
        panel_gain: of the modes [1/(m s)].
        slews: asked for.
    """
    command = rate_command(slews=slews, panel_gain=panel_gain, contraction=contraction)
    return IncrementalInversion(linear_plant().B[RATES], command, (6, 7, 8), CONTROLLED, jnp.asarray(MAX_TORQUE))
