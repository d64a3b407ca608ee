"""Numbers of a hydraulic servo axis: cylinder, load, oil and valve, and what follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ModelError, did_you_mean

STEP = 1e-3  # s: of controller, filter and record


def _number(value: float | Array) -> Array:
    return jnp.asarray(value, float)


def _field(value: float) -> Array:
    return eqx.field(converter=_number, default=value)


class HydraulicServoParameters(eqx.Module):
    """A differential cylinder that moves a mass against a spring, fed through a proportional valve.

    Chamber A is on the piston's side, chamber B on the rod's. The last five fields belong to the reduced model: what
    stands for the valve's and the chambers' pressures there, and the scales of its states.

    Attributes:
        bore: diameter of the piston [m].
        rod: diameter of the rod [m].
        stroke: of the piston [m].
        centre: position at which the spring is relaxed and the reduced model holds [m].
        dead_volume: of each chamber with its line at its end of the stroke [m^3].
        mass: of piston, rod and load [kg].
        viscous_friction: nominal [N s/m]; the parameter `p1` multiplies it.
        spring: stiffness of the load [N/m].
        coulomb_friction: at speed [N].
        static_friction: at rest [N].
        stribeck_velocity: over which static friction falls to Coulomb friction [m/s].
        friction_velocity: over which friction changes its sign [m/s].
        bulk_modulus: of the oil, nominal [Pa]; the parameter `p2` multiplies it.
        leakage: from chamber to chamber [m^3/(s Pa)].
        supply_pressure: [Pa].
        tank_pressure: [Pa].
        valve_gain: flow per volt and root of pressure drop [m^3/(s V sqrt(Pa))].
        laminar_pressure: pressure drop below which the flow is no longer turbulent [Pa].
        start_pressure: of chamber A at the start, where chamber B's balances it [Pa].
        load_force: standard deviation of the force on the load, held for a sample each [N].
        flow_gain: mean flow per volt of the reduced model [m^3/(s V)].
        flow_pressure: leakage and the valve's loss of flow under load, together [m^3/(s Pa)].
        extending_gain: of the flow at positive voltage on the full plant in multiples of `flow_gain`.
        retracting_gain: likewise at negative voltage.
        scales: of position [m], velocity [m/s] and load pressure [Pa] in the reduced model.

    Source: Jelali and Kroll (2003), Hydraulic Servo-systems, chapter 4; numbers chosen for a 40/25 mm cylinder.

    Example:
        >>> round(float(HydraulicServoParameters().area_ratio), 6)
        0.609375
    """

    bore: Array = _field(0.040)  # m
    rod: Array = _field(0.025)  # m
    stroke: Array = _field(0.30)  # m
    centre: Array = _field(0.15)  # m
    dead_volume: Array = _field(1e-4)  # m^3
    mass: Array = _field(100.0)  # kg
    viscous_friction: Array = _field(5000.0)  # N s/m
    spring: Array = _field(5e4)  # N/m
    coulomb_friction: Array = _field(60.0)  # N
    static_friction: Array = _field(90.0)  # N
    stribeck_velocity: Array = _field(0.02)  # m/s
    friction_velocity: Array = _field(0.01)  # m/s
    bulk_modulus: Array = _field(1e9)  # Pa
    leakage: Array = _field(1e-12)  # m^3/(s Pa)
    supply_pressure: Array = _field(10e6)  # Pa
    tank_pressure: Array = _field(0.1e6)  # Pa
    valve_gain: Array = _field(20e-3 / 60.0 / (10.0 * math.sqrt(3.5e6)))  # 20 l/min at 10 V and 3.5 MPa an edge
    laminar_pressure: Array = _field(0.1e6)  # Pa
    start_pressure: Array = _field(3.2e6)  # Pa
    load_force: Array = _field(100.0)  # N
    flow_gain: Array = _field(4.5e-5)  # m^3/(s V)
    flow_pressure: Array = _field(5e-12)  # m^3/(s Pa)
    extending_gain: Array = _field(5.05 / 4.5)  # 1
    retracting_gain: Array = _field(4.07 / 4.5)  # 1
    scales: Array = eqx.field(converter=_number, default=(0.01, 0.2, 1e6))  # m, m/s, Pa

    @property
    def area_a(self) -> Float[Array, ""]:
        """Of the piston [m^2]."""
        return 0.25 * math.pi * self.bore**2

    @property
    def area_b(self) -> Float[Array, ""]:
        """Of the ring around the rod [m^2]."""
        return 0.25 * math.pi * (self.bore**2 - self.rod**2)

    @property
    def area_ratio(self) -> Float[Array, ""]:
        """Ring over piston."""
        return self.area_b / self.area_a

    def volume_a(self, position: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """Of chamber A at a position [m^3]."""
        return self.dead_volume + self.area_a * position

    def volume_b(self, position: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """Of chamber B at a position [m^3]."""
        return self.dead_volume + self.area_b * (self.stroke - position)

    def stiffness(self, position: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """`1 / V_A + r^2 / V_B` with the area ratio `r` [1/m^3]: load pressure per oil displaced, over the bulk modulus."""
        return 1.0 / self.volume_a(position) + self.area_ratio**2 / self.volume_b(position)

    def leak_stiffness(self, position: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
        """`1 / V_A + r / V_B` [1/m^3]: load pressure per oil that goes from chamber to chamber, over the bulk modulus."""
        return 1.0 / self.volume_a(position) + self.area_ratio / self.volume_b(position)

    def load_pressure(self, pressure_a: Float[Array, "*shape"], pressure_b: Float[Array, "*shape"]) -> Array:
        """`p_A - r p_B`, by which the piston's area is multiplied to give the force of the oil [Pa]."""
        return pressure_a - self.area_ratio * pressure_b


def servo_numbers(given: HydraulicServoParameters | Mapping[str, float] | None) -> HydraulicServoParameters:
    """The numbers of an axis, or those that differ from the default by name, as a configuration writes them.

    Raises:
        ModelError: a name that is none of them.
    """
    if isinstance(given, HydraulicServoParameters):
        return given
    known = list(HydraulicServoParameters.__dataclass_fields__)
    values: dict[str, Any] = dict(given or {})
    for name in values:
        if name not in known:
            raise ModelError(f"numbers: {name!r} is not one of the axis; {did_you_mean(name, known)}")
    return HydraulicServoParameters(**values)
