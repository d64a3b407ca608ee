"""The flexible spacecraft keeps energy and angular momentum as physics does."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.errors import ConfigError, ModelError, ShapeError
from gainful.plants import (
    DisturbanceTorque,
    FlexibleSpacecraft,
    FlexibleState,
    FlexibleStructure,
    RigidSpacecraft,
    SpacecraftState,
    Wheels,
)
from gainful.plants.flexible_spacecraft import state_space
from gainful.spaces import rotate

# A matrix of couplings, so that no axis has a mode of its own, and momentum stored in wheels.
COUPLING = [[145.0, 3.0, -5.0], [4.0, 11.2, 2.0], [-6.0, 1.0, 84.0]]  # kg m
UNDAMPED = FlexibleStructure(modal_damping=[0.0] * 3, coupling=COUPLING, wheel_momentum=[20.0, -15.0, 10.0])
STEP = 0.025  # s, the quarter of a sample
STEPS = 2000  # 50 s


def tumbling(structure: FlexibleStructure, speed: float = 1.0) -> FlexibleSpacecraft:
    """A spacecraft without noise that turns at 0.31 rad/s with bent appendages, one Runge-Kutta step at a time."""
    attitude = jnp.array([0.1, -0.3, 0.2, 0.9])
    start = FlexibleState(
        attitude / jnp.linalg.norm(attitude),
        jnp.array([0.04, -5e-4, 5e-3]),
        speed * jnp.array([0.2, -0.15, 0.18]),
        jnp.array([0.1, 3e-3, -0.03]),
    )
    return FlexibleSpacecraft(structure, start, torque_density=0.0, substeps=1)


@eqx.filter_jit
def drifted(craft: FlexibleSpacecraft, dt: jax.Array) -> FlexibleState:
    """The states of a flight without command, the first included."""

    def step(state: FlexibleState, k: jax.Array) -> tuple[FlexibleState, FlexibleState]:
        after = craft.advance(state, jnp.zeros(3), k * dt, dt, jax.random.key(0))  # type: ignore[arg-type]
        return after, state

    return jax.lax.scan(step, craft.init(), jnp.arange(STEPS + 1))[1]


@eqx.filter_jit
def kept(structure: FlexibleStructure, states: FlexibleState) -> tuple[jax.Array, jax.Array]:
    """Energy [J] and angular momentum [N m s] along a flight."""
    return jax.vmap(structure.energy)(states), jax.vmap(structure.angular_momentum)(states)


@dataclasses.dataclass(frozen=True)
class Flight:
    """What an undamped flight of 50 s without torque keeps, in steps of a quarter and of half a sample."""

    speed: float
    energy: tuple[np.ndarray, np.ndarray]
    momentum: tuple[np.ndarray, np.ndarray]

    @property
    def rate(self) -> float:
        """How fast it turns [rad/s]."""
        return 0.31 * self.speed

    def lost(self) -> tuple[float, ...]:
        """Energy that is gone in the end [J], for each step."""
        return tuple(float(energy[0] - energy[-1]) for energy in self.energy)

    def strayed(self) -> tuple[float, ...]:
        """How far the angular momentum strays, relative to its size, for each step."""
        sizes = (np.linalg.norm(momentum - momentum[0], axis=1).max() for momentum in self.momentum)
        return tuple(float(size / np.linalg.norm(self.momentum[0][0])) for size in sizes)


@pytest.fixture(scope="module", params=[1.0, 0.1], ids=["tumbling", "bending"])
def flight(request: pytest.FixtureRequest) -> Flight:
    craft, found = tumbling(UNDAMPED, request.param), []
    for factor in (1, 2):
        values = kept(UNDAMPED, drifted(craft, jnp.asarray(factor * STEP)))
        found.append([np.asarray(value)[: STEPS // factor + 1] for value in values])
    (fine, fine_momentum), (coarse, coarse_momentum) = found
    return Flight(request.param, (fine, coarse), (fine_momentum, coarse_momentum))


def rates_of_what_is_kept(
    structure: FlexibleStructure, state: FlexibleState, torque: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """How fast energy and angular momentum change at a state, by differentiation along the motion."""
    velocity = state_space(structure.count).velocity(state.coordinates, structure.rates(state, torque))

    def both(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return structure.energy(FlexibleState.of(x)), structure.angular_momentum(FlexibleState.of(x))

    return jax.jvp(both, (state.coordinates,), (velocity,))[1]


def test_torque_and_damping_are_all_that_change_energy_and_momentum(rng: np.random.Generator) -> None:
    structure = FlexibleStructure(modal_damping=[0.5, 0.2, 0.9], coupling=COUPLING, wheel_momentum=[20.0, -15.0, 10.0])
    attitude = rng.normal(size=4)
    numbers = (attitude / np.linalg.norm(attitude), *rng.normal(size=(3, 3)) * np.array([[0.05], [0.3], [0.1]]))
    state, torque = FlexibleState(*map(jnp.asarray, numbers)), jnp.asarray(rng.normal(size=3) * 20.0)
    power, change = rates_of_what_is_kept(structure, state, torque)
    damped = structure.modal_damping @ state.deflection_rate**2
    # Rounding: the terms that cancel are J dw/dt . w and w . (w x H), some 1e3 of each unit, with a hundred operations.
    np.testing.assert_allclose(power, state.rate @ torque - damped, rtol=0, atol=1e-11)
    np.testing.assert_allclose(change, rotate(state.attitude, torque), rtol=0, atol=1e-11)


def test_energy_without_damping_is_lost_to_the_integrator_alone(flight: Flight) -> None:
    # Runge-Kutta takes z^6 / 72 of an oscillation's energy in each step of z = frequency * dt. Of the energy, what a rigid
    # body needs for the momentum does not oscillate. Turning shifts the fastest frequency by the rate at most.
    total = flight.energy[0][0]
    body = np.asarray(UNDAMPED.body_momentum(tumbling(UNDAMPED, flight.speed).init()) - UNDAMPED.wheel_momentum)
    elastic = total - 0.5 * body @ np.linalg.solve(np.asarray(UNDAMPED.inertia), body)
    z = (UNDAMPED.modes().frequencies[-1] + flight.rate) * STEP
    assert 0 < flight.lost()[0] < elastic * STEPS * z**6 / 72.0
    assert flight.lost()[0] < 1e-5 * total


def test_angular_momentum_without_torque_is_kept_in_inertial_axes(flight: Flight) -> None:
    # Of turning, Runge-Kutta leaves (rate * dt)^5 / 120 in each step. The modes swing the hub at 145 kg m * 0.15 m/s over
    # 3000 kg m^2, 0.007 rad/s, to and fro, so that this leaves its angle in a step times z^4 / 120 once.
    turning = STEPS * (flight.rate * STEP) ** 5 / 120.0
    swinging = 0.007 * STEP * (7.3 * STEP) ** 4 / 120.0
    assert flight.strayed()[0] < turning + swinging


def test_half_the_step_keeps_both_better_by_the_integrators_order(flight: Flight) -> None:
    (fine, coarse), (near, far) = flight.lost(), flight.strayed()
    # z^6 in half as many steps of twice the length is 32, less a little of the next order.
    assert coarse / fine == pytest.approx(32.0, rel=0.05)
    # Turning has 2^4 and bending 2^5, each within the next order's share.
    assert 15.0 < far / near < 36.0


def test_damping_takes_energy_and_never_gives_any() -> None:
    structure = FlexibleStructure(modal_damping=[1.0, 1.0, 1.0])
    craft = tumbling(structure)
    states = drifted(craft, jnp.asarray(STEP))
    energy = np.asarray(kept(structure, states)[0])
    assert np.diff(energy).max() < 1e-13 * energy[0]
    taken = np.asarray(states.deflection_rate) ** 2 @ np.asarray(structure.modal_damping)  # W
    lost = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (taken[1:] + taken[:-1]))])
    # The trapezoid sees oscillations of twice 7.3 rad/s: (14.6 * 0.025)^2 / 12 = 1.1 % of what one of them takes; the
    # integrator itself takes at most 1e-3 of the energy of bending, which is what damping takes in the end.
    assert lost[-1] > 0.1  # J
    np.testing.assert_allclose(energy[0] - energy, lost, rtol=0, atol=0.013 * lost[-1])


def test_it_is_the_rigid_body_where_nothing_couples() -> None:
    momentum = jnp.array([1.0, -0.5, 0.8])
    structure = FlexibleStructure(coupling=jnp.zeros(3), wheel_momentum=momentum)
    states = drifted(tumbling(structure), jnp.asarray(STEP))
    rigid = RigidSpacecraft(structure.inertia, Wheels(), torque_density=0.0, disturbance=0.0)
    start = SpacecraftState(states.rate[0], states.attitude[0], momentum)

    @jax.jit
    def turned(start: SpacecraftState) -> SpacecraftState:
        def step(state: SpacecraftState, _: None) -> tuple[SpacecraftState, SpacecraftState]:
            return rigid.advance(state, jnp.zeros(3), jnp.zeros(()), STEP, jax.random.key(0)), state

        return jax.lax.scan(step, start, length=STEPS + 1)[1]

    expected = turned(start)
    # The same integrator: rounding of 2000 steps.
    np.testing.assert_allclose(states.rate, expected.rate, rtol=0, atol=1e-12)
    np.testing.assert_allclose(states.attitude, expected.attitude, rtol=0, atol=1e-12)
    assert np.ptp(np.asarray(states.rate), axis=0).min() > 0.01  # rad/s: it tumbles


def test_the_default_structure_has_the_modes_of_the_literature() -> None:
    structure = FlexibleStructure()
    held, free = structure.modes(held=True), structure.modes()
    # Printed to the last digit.
    np.testing.assert_allclose(held.frequencies, [2.060, 5.914, 5.966], rtol=0, atol=5.1e-4)
    np.testing.assert_allclose(held.damping_ratios, [1.6e-4, 8.6e-5, 4.2e-5], rtol=0, atol=5e-6)
    np.testing.assert_allclose(free.frequencies, [2.783, 5.978, 7.012], rtol=0, atol=5.1e-4)
    assert np.linalg.eigvalsh(np.asarray(structure.mass_matrix))[0] == pytest.approx(6.95, abs=5e-3)
    carried = np.asarray(structure.inertia - structure.hub_inertia)
    assert carried[0, 0] == pytest.approx(1356.0, abs=0.5)


def test_a_command_against_the_disturbance_leaves_it_at_rest(key: jax.Array) -> None:
    disturbance = DisturbanceTorque([0.3, -0.2, 0.25])
    craft = FlexibleSpacecraft(disturbance=disturbance, torque_density=0.0)
    start = craft.init()
    still = craft.advance(start, -disturbance.constant, jnp.asarray(7.0), 0.1, key)
    np.testing.assert_array_equal(still.coordinates, start.coordinates)
    pushed = craft.advance(start, jnp.zeros(3), jnp.asarray(7.0), 0.1, key)
    # The body turns by some 1e-6 rad meanwhile.
    np.testing.assert_allclose(
        craft.structure.angular_momentum(pushed), 0.1 * np.asarray(disturbance.constant), rtol=1e-5, atol=0
    )


def test_a_disturbance_swings_and_drifts() -> None:
    torque = DisturbanceTorque([0.3, -0.2, 0.25], [0.1, 0.1, 0.1], [0.002, -0.004, 0.002])
    # A quarter of the period of 60 s.
    np.testing.assert_allclose(torque(jnp.asarray(15.0)), [0.43, -0.16, 0.38], rtol=1e-14)


def structure(**numbers: Any) -> FlexibleStructure:
    return FlexibleStructure(**numbers)


REFUSED = [
    (lambda: structure(inertia=[1.0]), ShapeError, "inertia: expected shape (3,) or (3, 3), got (1,)"),
    (lambda: structure(modal_mass=2.0), ShapeError, "modal_mass: expected one number per mode, got shape ()"),
    (lambda: structure(modal_stiffness=[1.0]), ShapeError, "modal_stiffness: expected shape (3,), got (1,)"),
    (lambda: structure(coupling=[1.0, 2.0]), ShapeError, "coupling: expected shape (3, 3), got (2, 2)"),
    (
        lambda: structure(modal_mass=[15.0, np.nan, 9.0]),
        ModelError,
        "modal_mass: expected finite numbers, got [15.0, nan, 9.0]",
    ),
    (
        lambda: structure(modal_mass=[15.0, 0.0, 9.0]),
        ModelError,
        "modal_mass: expected numbers above 0, got 0 for mode 2",
    ),
    (
        lambda: structure(modal_stiffness=[60.0, 700.0, -3.0]),
        ModelError,
        "modal_stiffness: expected numbers above 0, got -3 for mode 3",
    ),
    (
        lambda: structure(modal_damping=[-0.1, 0.0, 0.0]),
        ModelError,
        "modal_damping: expected numbers of at least 0, got -0.1 for mode 1",
    ),
    (
        lambda: structure(inertia=[[3000.0, 35.0, 0.0], [30.0, 1500.0, 0.0], [0.0, 0.0, 2500.0]]),
        ModelError,
        "inertia: expected a symmetric matrix, got 35 for xy but 30 for yx",
    ),
    (
        lambda: structure(inertia=[1300.0, 1500.0, 2500.0]),
        ModelError,
        "inertia: expected more than the modes carry, coupling^2 / modal_mass = 1355.58 kg m^2 about x, got 1300 kg m^2",
    ),
    (
        lambda: structure(inertia=[[3.0, 4.0, 0.0], [4.0, 3.0, 0.0], [0.0, 0.0, 1.0]], coupling=[0.0, 0.0, 0.0]),
        ModelError,
        "inertia: expected a positive definite matrix beyond what the modes carry, got the eigenvalue -1 kg m^2",
    ),
    (lambda: DisturbanceTorque(0.1), ShapeError, "constant: expected 3 torques, got shape ()"),
    (lambda: FlexibleSpacecraft(substeps=0), ConfigError, "substeps: expected a whole number of at least 1, got 0"),
    (
        lambda: FlexibleSpacecraft(start=FlexibleState.at_rest(2)),
        ShapeError,
        "start.deflection: expected shape (3,), got (2,)",
    ),
    (
        lambda: FlexibleSpacecraft(deflection_sigma=[1.0, 2.0]),
        ShapeError,
        "deflection_sigma: expected one number or 3, got shape (2,)",
    ),
]


@pytest.mark.parametrize(("attempt", "error", "message"), REFUSED)
def test_a_message_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
