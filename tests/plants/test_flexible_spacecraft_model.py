"""The model of a flexible spacecraft predicts it, and its noise is the spacecraft's."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg

from gainful.models import Instant
from gainful.plants import (
    FlexibleSpacecraft,
    FlexibleState,
    FlexibleStructure,
    flexible_spacecraft,
    flexible_spacecraft_model,
)
from gainful.running import AbstractController, Rates, Reading, simulate
from gainful.testing import check_model

COUPLING = [[145.0, 3.0, -5.0], [4.0, 11.2, 2.0], [-6.0, 1.0, 84.0]]  # kg m


def linear_motion(structure: FlexibleStructure) -> tuple[np.ndarray, np.ndarray]:
    """Rates of attitude, deflections, rate and rates of deflections about rest, from the mass matrix at once."""
    inverse = np.linalg.inv(np.asarray(structure.mass_matrix))
    drift, gain = np.zeros((12, 12)), np.zeros((12, 3))
    drift[:6, 6:] = np.eye(6)
    drift[6:, 3:6] = -inverse[:, 3:] * np.asarray(structure.modal_stiffness)
    drift[6:, 9:] = -inverse[:, 3:] * np.asarray(structure.modal_damping)
    gain[6:] = inverse[:, :3]
    return drift, gain


def test_small_motion_is_that_of_the_linear_structure() -> None:
    structure, dt = FlexibleStructure(coupling=COUPLING), 0.02
    model = flexible_spacecraft_model(FlexibleSpacecraft(structure, substeps=4))
    rest = FlexibleState.at_rest(3).coordinates

    @jax.jit
    def moved(d: jax.Array, u: jax.Array) -> jax.Array:
        when = Instant(jnp.asarray(dt), jnp.asarray(dt), u)
        return model.space.minus(model.transition(model.space.plus(rest, d), when), rest)

    transition, effect = jax.jit(jax.jacfwd(moved, argnums=(0, 1)))(jnp.zeros(12), jnp.zeros(3))
    drift, gain = linear_motion(structure)
    both = scipy.linalg.expm(dt * np.block([[drift, gain], [np.zeros((3, 15))]]))
    # Runge-Kutta leaves (7.1 * 0.005)^5 / 120 of the fastest entries, of size 80, in each of 4 steps.
    np.testing.assert_allclose(transition, both[:12, :12], rtol=0, atol=80 * 4 * 0.036**5 / 120)
    np.testing.assert_allclose(effect, both[:12, 12:], rtol=0, atol=80 * 4 * 0.036**5 / 120 / 1000.0)


class Swinging(AbstractController):
    """Commands that swing, whatever is read, beyond what the actuators can do."""

    def init(self) -> None:
        return None

    def act(self, carry: None, t: jax.Array, reading: Reading) -> tuple[None, jax.Array]:
        return None, jnp.array([40.0, -10.0, 20.0]) * jnp.sin(1.3 * t)


def test_the_model_predicts_the_truth_and_readings_are_as_noisy_as_they_say(key: jax.Array) -> None:
    craft = FlexibleSpacecraft(torque_density=0.0)
    model = flexible_spacecraft_model(craft)
    flight = simulate(craft, Swinging(), key=key, duration=100.0, rates=Rates(0.1, measure=1, control=1))
    applied = np.asarray(flight.u)
    assert np.abs(applied).max(axis=0).round(1).tolist() == [30.0, 10.0, 20.0]  # N m

    @jax.jit
    @jax.vmap
    def off(x: jax.Array, t: jax.Array, u: jax.Array, after: jax.Array) -> jax.Array:
        return model.space.minus(model.transition(x, Instant(t, jnp.asarray(0.1), u)), after)

    error = off(flight.truth[:-1], flight.t[1:], flight.u[1:], flight.truth[1:])
    assert np.abs(error).max() < 1e-13  # the same integrator
    assert np.ptp(np.asarray(flight.truth)[:, 4]) > 0.01  # m: the first mode swings
    noise = np.asarray(jax.vmap(model.output.minus)(flight.y, flight.truth))
    x, when = flight.truth[0], Instant(jnp.zeros(()), jnp.asarray(0.1), jnp.zeros(3))
    sigmas = np.sqrt(np.diag(model.measurement_noise(x, when)))
    np.testing.assert_allclose(sigmas, [2e-5] * 3 + [1e-4, 1e-6, 1e-5] + [1e-5] * 3 + [2e-4, 6e-6, 6e-5], rtol=1e-12)
    # Four sigma of a sample deviation.
    np.testing.assert_allclose(np.std(noise, axis=0), sigmas, rtol=4.0 / np.sqrt(2.0 * len(noise)))


def test_without_gauges_attitude_and_rate_are_all_there_is(key: jax.Array) -> None:
    craft = FlexibleSpacecraft(modal_sensors=False, attitude_sigma=0.0, rate_sigma=0.0)
    model = flexible_spacecraft_model(craft)
    assert [name for name, _ in model.sensors] == ["star_tracker", "gyro"]
    assert model.output.names == craft.output.names
    attitude = jnp.array([0.1, -0.3, 0.2, 0.9])
    numbers = (attitude / jnp.linalg.norm(attitude), 0.01 * jnp.arange(3.0), 0.2 * jnp.arange(3.0), jnp.arange(3.0))
    state = FlexibleState(*numbers)
    expected = np.concatenate([state.attitude, state.rate])
    np.testing.assert_allclose(craft.read(state, jnp.zeros(()), key), expected, rtol=1e-15, atol=0)
    observed = model.observe(state.coordinates, Instant(jnp.zeros(()), jnp.asarray(0.1), jnp.zeros(3)))
    np.testing.assert_array_equal(observed, expected)


def test_torque_noise_adds_the_covariance_that_the_model_has(key: jax.Array) -> None:
    # In a step much shorter than any mode, noise that is held and noise that is white do the same to rates.
    craft, dt, count = FlexibleSpacecraft(torque_density=4.0, substeps=1), 1e-3, 4000
    model = flexible_spacecraft_model(craft)
    start = craft.init()

    @jax.jit
    @jax.vmap
    def kick(key: jax.Array) -> jax.Array:
        after = craft.advance(start, jnp.zeros(3), jnp.zeros(()), dt, key)
        return model.space.minus(after.coordinates, start.coordinates)[6:]

    kicks = np.asarray(kick(jax.random.split(key, count)))
    when = Instant(jnp.asarray(dt), jnp.asarray(dt), jnp.zeros(3))
    covariance = np.asarray(eqx.filter_jit(model.process_noise)(start.coordinates, when))[6:, 6:]
    deviations = np.sqrt(np.diag(covariance))
    gain = linear_motion(craft.structure)[1][6:]
    # The modes answer within the step by (7 * 1e-3)^2.
    np.testing.assert_allclose(covariance, 4.0 * dt * gain @ gain.T, rtol=0, atol=1e-4 * deviations.max() ** 2)
    found = kicks.T @ kicks / count / np.outer(deviations, deviations)
    # Four sigma and a half of a sample variance, for 21 of them.
    np.testing.assert_allclose(
        found, covariance / np.outer(deviations, deviations), rtol=0, atol=4.5 * (2 / count) ** 0.5
    )


def test_it_is_a_model_of_as_many_modes_as_it_has() -> None:
    one = flexible_spacecraft(
        (30.0, 20.0, 10.0), [5.0], [0.1], [40.0], [[0.0, 3.0, 1.0]], deflection_sigma=1e-4, deflection_rate_sigma=1e-4
    )
    assert one.space.tangent_names[3:] == ("mode_1", "wx", "wy", "wz", "mode_1_rate")
    check_model(one, u=[1.0, -2.0, 3.0])
