"""A spacecraft that follows a swinging target, with or without faults."""

from __future__ import annotations

from typing import Any

from jaxtyping import Array

from ..control import AbstractController, TrackingController
from ..running.closed_loop import simulate
from ..running.loop import Fault, Observer, Rates, Simulated, no_fault
from .rigid_spacecraft import RigidSpacecraft


def tracking_controller(craft: RigidSpacecraft, **options: Any) -> TrackingController:
    """The tracking law for a spacecraft: its inertia, wheels and target.

    Args:
        craft: the spacecraft.
        options: `k_p`, `k_d`, `feedback`, `reconfigure` of `TrackingController`.
    """
    wheels = craft.wheels
    return TrackingController(craft.inertia, wheels.axes, wheels.max_torque, craft.form, **options)


def fly(
    craft: RigidSpacecraft | None = None,
    controller: AbstractController | None = None,
    *,
    key: Array,
    duration: float = 200.0,  # s
    rates: Rates | None = None,
    actuator_fault: Fault = no_fault,
    sensor_fault: Fault = no_fault,
    observer: Observer | None = None,
) -> Simulated:
    """The experiment of target tracking: truth, readings and commands at the filter's step.

    A spacecraft of 17, 12 and 10 kg m^2 with three wheels follows angles of up to 45 degrees with a period of 100 s, simulated
    in steps of 0.01 s, commanded every 0.1 s and read every 0.05 s. `state.momentum` is the wheels' momentum at each row.
    Pure: `jax.vmap(lambda key: fly(key=key))(keys)` draws many flights.

    Args:
        craft: the spacecraft.
        controller: its controller; the tracking law on raw readings by default.
        key: random key; the same key draws the same noise whatever the faults.
        duration: of the flight [s].
        rates: of simulation, readings, control and estimator.
        actuator_fault: wheel torques in place of those applied, a function of both them [N m] and the time [s].
        sensor_fault: reading in place of itself, likewise: three rates, then the attitude.
        observer: an estimator in the loop.

    Source: Chen, Sun, Wu and Jiang (2019), Acta Aeronautica et Astronautica Sinica 40(5):322551.

    Example:
        >>> import jax
        >>> flight = fly(key=jax.random.key(0), duration=1.0)
        >>> flight.t.shape, flight.y.shape, flight.u.shape
        ((21,), (21, 6), (21, 6))
    """
    craft = RigidSpacecraft() if craft is None else craft
    return simulate(
        craft,
        tracking_controller(craft) if controller is None else controller,
        key=key,
        duration=duration,
        rates=rates,
        actuator_fault=actuator_fault,
        sensor_fault=sensor_fault,
        observer=observer,
    )
