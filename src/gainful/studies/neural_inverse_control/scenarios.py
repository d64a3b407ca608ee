"""What is flown: spacecraft as the networks were told and otherwise, slews, and what disturbs them."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...control.slews import QuinticSlews
from ...plants import ChangingPlant, DisturbanceTorque, FlexibleSpacecraft, FlexibleStructure
from ...plants.flexible_spacecraft import (
    ATTITUDE_SIGMA,
    DEFLECTION_RATE_SIGMA,
    DEFLECTION_SIGMA,
    MAX_TORQUE,
    RATE_SIGMA,
)
from ...running.loop import Rates

STEP = 0.1  # s
RATES = Rates(step=STEP, measure=1, control=1, estimate=1)
AXES = ("roll", "pitch", "yaw")
SHORT, LONG, LONGEST = 90.0, 180.0, 900.0  # s
HOLD_END = 10.0  # s, of each hold, in which the panel should be still


def slews(target_deg: tuple[float, float, float], duration: float, hold: float) -> QuinticSlews:
    """Alternating slews from rest to rest, along all three 3-2-1 angles at once; all share one compiled program.

    Args:
        target_deg: roll, pitch and yaw at the far end.
        duration: of a slew [s].
        hold: between slews [s].
    """
    ends = jnp.stack([jnp.zeros(3), jnp.radians(jnp.asarray(target_deg))])
    return QuinticSlews(ends, jnp.asarray(duration), jnp.asarray(hold))  # type: ignore[arg-type]  # arrays


GENTLE = slews((20.0, 10.0, -15.0), 30.0, 15.0)
AGGRESSIVE = slews((50.0, 30.0, -40.0), 25.0, 20.0)
PERIOD = 45.0
"""Of a slew and its hold, of both kinds [s]."""
DISTURBANCE = DisturbanceTorque((0.3, -0.2, 0.25), (0.1, 0.1, 0.1), (0.002, -0.004, 0.002), jnp.asarray(60.0))
"""A constant, an orbit's swing made short, and a drift [N m]."""
CONSTANT = DisturbanceTorque((0.3, -0.2, 0.25), period=jnp.asarray(60.0))
CALM = DisturbanceTorque(period=jnp.asarray(60.0))
NOMINAL = FlexibleStructure()
"""The spacecraft that networks are trained on and rivals are designed for."""


def scaled(inertia: float = 1.0, coupling: float = 1.0, stiffness: float = 1.0) -> FlexibleStructure:
    """The nominal structure with some of its numbers multiplied."""
    return FlexibleStructure(
        inertia=inertia * NOMINAL.inertia,
        coupling=coupling * NOMINAL.coupling,
        modal_stiffness=stiffness * NOMINAL.modal_stiffness,
    )


OFF_NOMINAL = scaled(inertia=1.2, coupling=1.1, stiffness=0.9)


def lighter(share: float) -> FlexibleStructure:
    """Less inertia, with as much coupling as keeps the mass matrix positive definite."""
    return scaled(inertia=share, coupling=float(np.sqrt(share)))


def plant(
    structure: FlexibleStructure = NOMINAL,
    disturbance: DisturbanceTorque = CALM,
    *,
    noise: float = 1.0,
    after: FlexibleStructure | None = None,
    change: float = np.inf,
) -> ChangingPlant:
    """The spacecraft flown; all of them share one compiled program.

    Args:
        structure: of it.
        disturbance: what the environment does.
        noise: factor on the sensors' deviations.
        after: the structure from a time on.
        change: that time [s].
    """
    before, later = (_craft(each, disturbance, noise) for each in (structure, structure if after is None else after))
    return ChangingPlant(before, later, jnp.asarray(change))


def _craft(structure: FlexibleStructure, disturbance: DisturbanceTorque, noise: float) -> FlexibleSpacecraft:
    def sized(sigma: float | tuple[float, ...]) -> Array:
        return noise * jnp.asarray(sigma)

    return FlexibleSpacecraft(
        structure,
        disturbance=disturbance,
        max_torque=MAX_TORQUE,
        torque_density=jnp.asarray(0.0),
        attitude_sigma=sized(ATTITUDE_SIGMA),
        deflection_sigma=sized(DEFLECTION_SIGMA),
        rate_sigma=sized(RATE_SIGMA),
        deflection_rate_sigma=sized(DEFLECTION_RATE_SIGMA),
    )


@dataclasses.dataclass(frozen=True)
class Box:
    """The range of states and torques of a training set, which is also what inputs of networks are scaled by.

    Attributes:
        torque: [N m].
        angle: of the 3-2-1 angles [rad].
        deflection: of each mode [m].
        rate: of the body [rad/s].
        deflection_rate: of each mode [m/s].
    """

    torque: float = 20.0
    angle: float = 0.5
    deflection: tuple[float, float, float] = (0.04, 5e-4, 5e-3)
    rate: float = 0.05
    deflection_rate: tuple[float, float, float] = (0.1, 3e-3, 0.03)

    @property
    def scale(self) -> np.ndarray:
        """Torques first, then the state (15,)."""
        angle, rate, torque = ([each] * 3 for each in (self.angle, self.rate, self.torque))
        return np.array([*torque, *angle, *self.deflection, *rate, *self.deflection_rate])


BOX = Box()
WIDE = Box(30.0, 1.1, (0.08, 1e-3, 1e-2), 0.1, (0.2, 6e-3, 0.06))
"""For the aggressive slew."""
