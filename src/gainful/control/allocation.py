"""From the torque a law asks for to the torque of each wheel."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class Adjustment(eqx.Module):
    """What a controller takes into account of its actuators and sensors at a moment.

    Attributes:
        offset: torque a wheel adds of itself [N m] (w,).
        loss: share of its command that a wheel does not carry out (w,).
        active: 1 for a wheel in use, 0 for one that gets no command (w,).
        gyro_bias: what the gyro reads too much [rad/s] (3,).
    """

    offset: Float[Array, " w"]
    loss: Float[Array, " w"]
    active: Float[Array, " w"]
    gyro_bias: Float[Array, "3"]

    @classmethod
    def none(cls, wheels: int) -> Adjustment:
        """Sound wheels and a sound gyro."""
        zero = jnp.zeros(wheels)
        return cls(zero, zero, jnp.ones(wheels), jnp.zeros(3))


def allocate_torque(
    axes: Float[Array, "3 w"],
    torque: Float[Array, "3"],
    adjustment: Adjustment | None = None,
    *,
    least: float = 0.1,
    most: float = 2.0,
) -> Float[Array, " w"]:
    """Wheel torques that together give a torque on the body, the shortest vector of them where there are several.

    With `W` the axes, the columns of idle wheels zeroed, `u = (W^+ T - offset) / clip(1 - loss, least, most)`.

    Args:
        axes: unit vector of each wheel in body axes (3, w).
        torque: asked for, in body axes [N m].
        adjustment: known faults to make up for; none by default. What an idle wheel adds of itself is carried by the
            others.
        least: smallest share of its command a wheel is taken to carry out, so that no command grows without bound.
        most: largest share.

    Example:
        >>> allocate_torque(jnp.eye(3), jnp.array([0.1, 0.0, -0.2])).tolist()
        [0.1, 0.0, -0.2]
    """
    if adjustment is None:
        return jnp.linalg.pinv(axes) @ torque
    known = adjustment
    idle = axes @ ((1.0 - known.active) * known.offset)
    share = jnp.clip(1.0 - known.loss, least, most)
    return known.active * (jnp.linalg.pinv(axes * known.active) @ (torque - idle) - known.offset) / share
