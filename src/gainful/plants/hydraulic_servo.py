"""A hydraulic servo axis with both chambers, a valve's square-root flow and Stribeck friction."""

from __future__ import annotations

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..models import Model, continuous_model, sensor
from .hydraulic_servo_parameters import STEP, HydraulicServoParameters, servo_numbers

SUBSTEPS = 4
"""Runge-Kutta steps per sample of 1 ms; ten move pressures by 3 Pa and the position by 1e-9 m."""
SIGMAS = (1e-4, 4e-3, 0.05e6)  # m, m/s, Pa: of the readings


class HydraulicServo(eqx.Module):
    """The full axis: states are position [m], velocity [m/s] and the pressures of the chambers [Pa].

    ```
    dy/dt  = v
    dv/dt  = (A_A p_A - A_B p_B - F_f(v) - K (y - y_0) - F) / m
    dp_A/dt = p2 b / V_A(y) ( Q_A - A_A v - c (p_A - p_B))
    dp_B/dt = p2 b / V_B(y) (-Q_B + A_B v + c (p_A - p_B))
    F_f = p1 d v + (F_C + (F_S - F_C) exp(-(v / v_s)^2)) tanh(v / v_0)
    ```

    with `Q = K_v u s(drop)` through the edges that the voltage `u` opens, and `s` a square root that is linear near 0.
    The spool follows its voltage at once, and the cylinder has no end stops.

    Attributes:
        parameters: numbers of the axis.

    Source: Jelali and Kroll (2003), Hydraulic Servo-systems, chapter 4; Merritt (1967), Hydraulic Control Systems.
    """

    parameters: HydraulicServoParameters = eqx.field(default_factory=HydraulicServoParameters)

    @property
    def start(self) -> Float[Array, "4"]:
        """At rest at the centre, where the pressures balance each other and no spring pulls.

        The forces are in equilibrium; oil leaks from the chamber with the higher pressure from the first moment on.
        """
        own = self.parameters
        pressure = own.start_pressure
        return jnp.stack([own.centre, jnp.zeros(()), pressure, pressure / own.area_ratio])

    def friction(self, velocity: Float[Array, ""], p1: Float[Array, ""]) -> Float[Array, ""]:
        """Force of friction against the motion [N]."""
        own = self.parameters
        excess = (own.static_friction - own.coulomb_friction) * jnp.exp(-((velocity / own.stribeck_velocity) ** 2))
        dry = (own.coulomb_friction + excess) * jnp.tanh(velocity / own.friction_velocity)
        return p1 * own.viscous_friction * velocity + dry

    def flows(
        self, voltage: Float[Array, ""], pressure_a: Float[Array, ""], pressure_b: Float[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Flow into chamber A and out of chamber B through the valve [m^3/s]."""
        own = self.parameters
        extend, retract = jnp.maximum(voltage, 0.0), jnp.minimum(voltage, 0.0)
        into_a = extend * self._root(own.supply_pressure - pressure_a)
        from_a = retract * self._root(pressure_a - own.tank_pressure)
        from_b = extend * self._root(pressure_b - own.tank_pressure)
        into_b = retract * self._root(own.supply_pressure - pressure_b)
        return own.valve_gain * (into_a + from_a), own.valve_gain * (from_b + into_b)

    def _root(self, drop: Float[Array, ""]) -> Float[Array, ""]:
        """`sqrt(drop)` with its sign, and with a finite slope at 0."""
        return drop / (drop**2 + self.parameters.laminar_pressure**2) ** 0.25

    def rate(
        self,
        state: Float[Array, "4"],
        voltage: Float[Array, ""],
        p1: Float[Array, ""],
        p2: Float[Array, ""],
        force: float | Float[Array, ""] = 0.0,
    ) -> Float[Array, "4"]:
        """Rate of change of the state under a voltage of the valve [V] and a force against the load [N].

        Args:
            state: position, velocity, pressures of chambers A and B.
            voltage: of the valve [V].
            p1: viscous friction in multiples of its nominal value.
            p2: bulk modulus likewise.
            force: against the load [N].
        """
        own = self.parameters
        position, velocity, pressure_a, pressure_b = state
        flow_a, flow_b = self.flows(voltage, pressure_a, pressure_b)
        leak = own.leakage * (pressure_a - pressure_b)
        oil = own.area_a * pressure_a - own.area_b * pressure_b
        pull = self.friction(velocity, p1) + own.spring * (position - own.centre) + force
        modulus = p2 * own.bulk_modulus
        rise_a = modulus / own.volume_a(position) * (flow_a - own.area_a * velocity - leak)
        rise_b = modulus / own.volume_b(position) * (own.area_b * velocity + leak - flow_b)
        return jnp.stack([velocity, (oil - pull) / own.mass, rise_a, rise_b])

    def scaled(self, state: Float[Array, "4"]) -> Float[Array, "3"]:
        """Position, velocity and load pressure as the reduced model has them."""
        own = self.parameters
        position, velocity, pressure_a, pressure_b = state
        reduced = jnp.stack([position - own.centre, velocity, own.load_pressure(pressure_a, pressure_b)])
        return reduced / own.scales

    def reference_parameters(
        self, state: Float[Array, "4"], p1: Float[Array, ""], p2: Float[Array, ""]
    ) -> Float[Array, "2"]:
        """The `p1` and `p2` that the reduced model should find: oil stiffness moves with the piston, which it does not know."""
        own = self.parameters
        return jnp.stack([p1, p2 * own.stiffness(state[0]) / own.stiffness(own.centre)])


class _Rate(eqx.Module):
    servo: HydraulicServo

    def __call__(self, x: Array, u: Array, t: Array, p: dict[str, Array]) -> Array:
        return self.servo.rate(x, u[0], p["p1"], p["p2"])


class _LoadReading(eqx.Module):
    servo: HydraulicServo

    def __call__(self, x: Array) -> Array:
        return self.servo.parameters.load_pressure(x[2], x[3])[None]


def _position(x: Array) -> Array:
    return x[:1]


def _velocity(x: Array) -> Array:
    return x[1:2]


def hydraulic_servo(numbers: HydraulicServoParameters | Mapping[str, float] | None = None) -> Model:
    """The model of the full axis in SI units: a voltage moves a mass; position, velocity and load pressure are read.

    The force on the load is white noise here. `augment(model, parameters={"p1": walk, "p2": walk})` estimates viscous
    friction and bulk modulus in multiples of their nominal values. For intervals much longer than 1 ms give `max_step` to
    `make_log`: the oil column swings at 45 Hz.

    Args:
        numbers: of the axis, or those that differ from the default, by name.

    Raises:
        ModelError: a number that the axis has not.

    Source: Jelali and Kroll (2003), Hydraulic Servo-systems, chapter 4.

    Example:
        >>> hydraulic_servo().space.names
        ('position', 'velocity', 'pressure_a', 'pressure_b')
    """
    servo = HydraulicServo(servo_numbers(numbers))
    own = servo.parameters
    readings = {
        "position": (_position, "m"),
        "velocity": (_velocity, "m/s"),
        "load_pressure": (_LoadReading(servo), "Pa"),
    }
    return continuous_model(
        _Rate(servo),
        states={"position": "m", "velocity": "m/s", "pressure_a": "Pa", "pressure_b": "Pa"},
        inputs={"voltage": "V"},
        Q=own.load_force**2 * STEP,
        G=jnp.zeros((4, 1)).at[1, 0].set(1.0 / own.mass),
        sensors=[
            sensor(name, h, outputs={f"measured_{name}": unit}, R=sigma**2)
            for (name, (h, unit)), sigma in zip(readings.items(), SIGMAS, strict=True)
        ],
        parameters={"p1": 1.0, "p2": 1.0},
        substeps=SUBSTEPS,
    )
