"""Regulators and incremental inversion close loops, on readings and on estimates, sound and at fault."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.control import (
    AbstractCommand,
    FollowReference,
    IncrementalInversion,
    LinearPlant,
    Reading,
    SetPoint,
    StateFeedback,
    StateSource,
    linearised,
    lqi,
    lqr,
)
from gainful.plants import attitude_kinematics
from gainful.running import Observer, Rates, Simulated, simulate

from .carriage import LIMIT, STEP, Spring, carriage, carriage_model

T = 0.1
RATES = Rates(step=STEP, measure=10, control=10, estimate=10)
HOME = SetPoint([0.0, 0.0], [0.0])
PLANT = LinearPlant([[1.0, T], [0.0, 1.0]], [[0.5 * T**2], [T]])
C = [[1.0, 0.0]]


@eqx.filter_jit
def looped(controller: Any, key: jax.Array, *, sigma: float = 0.0, duration: float = 12.0, **given: Any) -> Simulated:
    return simulate(carriage(sigma), controller, key=key, duration=duration, rates=RATES, **given)


def pushed(u: jax.Array, t: jax.Array) -> jax.Array:
    return u + 0.1


def regulator(integral: bool = False, **options: Any) -> StateFeedback:
    options = {"limit": LIMIT, "interval": T} | options
    if not integral:
        return StateFeedback(lqr(PLANT, [1.0, 1.0], [1.0])[0], HOME, **options)
    gain, integral_gain = lqi(PLANT, C, [1.0, 1.0], [1.0], [0.5], T)
    return StateFeedback(gain, HOME, integral_gain=integral_gain, integrated=C, **options)


def test_the_carriages_model_is_linearised_as_by_hand() -> None:
    found = linearised(carriage_model(), [0.3, 0.1], [0.0, 0.0], T)
    np.testing.assert_allclose(found.A, PLANT.A, atol=1e-15)
    np.testing.assert_allclose(found.B[:, :1], PLANT.B, atol=1e-15)


def test_proportional_and_differential_control_is_state_feedback(key: jax.Array) -> None:
    spring = looped(Spring(), key, sigma=0.01)
    feedback = looped(StateFeedback([[4.0, 2.0]], HOME), key, sigma=0.01)
    np.testing.assert_allclose(feedback.command, spring.command, rtol=1e-12)


def test_a_regulator_brings_the_carriage_home_and_an_integral_keeps_it_there(key: jax.Array) -> None:
    sound = looped(regulator(), key)
    assert abs(float(sound.truth[-1, 0])) < 1e-2
    off = looped(regulator(), key, actuator_fault=pushed, duration=30.0)
    kept = looped(regulator(True), key, actuator_fault=pushed, duration=30.0)
    # Without an integral the push is held by gain times distance.
    assert float(off.truth[-1, 0]) == pytest.approx(0.1 / float(regulator().gain[0, 0]), rel=1e-3)
    assert abs(float(kept.truth[-1, 0])) < 1e-3


def test_an_integral_does_not_wind_up_while_the_motor_is_at_its_limit(key: jax.Array) -> None:
    still, wound = (looped(regulator(True, anti_windup=on), key, duration=20.0) for on in (True, False))
    overshoot = [-float(flight.truth[:, 0].min()) for flight in (still, wound)]
    assert overshoot[0] < 0.5 * overshoot[1]
    assert abs(float(still.truth[-1, 0])) < 0.02


def test_a_regulator_follows_the_estimate_and_outlives_a_reading_that_is_gone(key: jax.Array) -> None:
    def lost(y: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where(jnp.array([False, True]) & (t > 1.0), jnp.nan, y)

    model = carriage_model()
    observer = Observer(gf.kalman_filter(), model, gf.make_prior(model, [0.9, 0.0], [0.2, 0.1]))
    blind = regulator(source=StateSource("estimate"))
    flight = looped(blind, key, sigma=0.02, sensor_fault=lost, observer=observer)
    # Without a speed the estimate has one from the places; readings of 2 cm keep it within a few of them.
    assert np.abs(flight.truth[-20:, 0]).max() < 0.06
    raw = looped(regulator(), key, sigma=0.02, sensor_fault=lost)
    assert np.abs(raw.truth[-20:, 0]).max() > 0.2


def test_differences_are_those_of_the_space_a_state_lives_in() -> None:
    model = attitude_kinematics()
    space = model.space
    turned = space.plus(jnp.array([0.0, 0.0, 0.0, 1.0]), jnp.array([0.1, -0.2, 0.3]))
    law = StateFeedback(jnp.eye(3), SetPoint([0.0, 0.0, 0.0, 1.0], jnp.zeros(3)), space=space)
    command = law.act(law.init(), jnp.zeros(()), Reading(turned, jnp.zeros(0), None))[1]
    np.testing.assert_allclose(command, [-0.1, 0.2, -0.3], atol=1e-14)


class Homing(AbstractCommand):
    """Asks for a speed towards home."""

    interval: float

    def init(self) -> None:
        return None

    def desired(self, carry: None, t: jax.Array, x: jax.Array) -> tuple[None, jax.Array]:
        return None, jnp.stack([x[0], jnp.clip(-(x[0] + self.interval * x[1]), -0.3, 0.3)])

    def error(self, t: jax.Array, x: jax.Array) -> jax.Array:
        return x[:1]


def test_incremental_inversion_knows_the_effect_of_its_input_and_nothing_else(key: jax.Array) -> None:
    law = IncrementalInversion([[T]], Homing(T), (1,), limit=LIMIT)
    flight = looped(law, key, actuator_fault=pushed, duration=20.0)
    # The push is part of what happened, so that it takes no distance to hold it.
    assert abs(float(flight.truth[-1, 0])) < 1e-6
    assert float(flight.command[-1, 0]) == pytest.approx(-0.1, abs=1e-6)


def test_incremental_inversion_holds_its_command_while_a_reading_is_missing(key: jax.Array) -> None:
    def lost(y: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where((t > 2.05) & (t < 2.45), jnp.nan, y)

    flight = looped(IncrementalInversion([[T]], Homing(T), (1,), limit=LIMIT), key, sensor_fault=lost, duration=20.0)
    command = np.asarray(flight.command[:, 0])
    # Missing at 2.1 to 2.4 s; at 2.5 s there is no change to be known yet.
    np.testing.assert_array_equal(command[21:26], command[20])
    assert command[26] != command[20]
    assert abs(float(flight.truth[-1, 0])) < 1e-6


def test_a_reference_is_a_command_of_itself(key: jax.Array) -> None:
    law = IncrementalInversion([[T]], FollowReference(T, SetPoint([0.0, 0.2], [0.0])), (1,), limit=LIMIT)
    flight = looped(law, key, duration=5.0)
    np.testing.assert_allclose(flight.truth[10:, 1], 0.2, atol=1e-9)
