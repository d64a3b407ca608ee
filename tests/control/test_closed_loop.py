"""A closed loop is what its parts do, each at its own rate."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.running import Observer, Rates, Simulated, simulate
from gainful.running.closed_loop import _degrees, _known
from gainful.spaces import make_space

from .carriage import LIMIT, SIGMA, STEP, Spring, carriage, carriage_model

RATES = Rates(step=STEP, measure=2, control=6, estimate=4)


def observer(estimator: Any = None) -> Observer:
    model = carriage_model()
    return Observer(estimator or gf.kalman_filter(), model, gf.make_prior(model, [0.9, 0.0], [0.2, 0.1]))


@eqx.filter_jit
def looped(
    key: jax.Array, *, duration: float = 2.4, controller: Any = None, sigma: float = SIGMA, **given: Any
) -> Simulated:
    given = {"rates": RATES} | given
    return simulate(carriage(sigma), controller or Spring(), key=key, duration=duration, **given)


@pytest.fixture(scope="module")
def closed() -> Callable[[jax.Array], Simulated]:
    """A loop through an estimator slower than the readings and faster than the controller."""
    own = observer()
    return jax.jit(lambda key: looped(key, controller=Spring(estimated=True), observer=own))


def by_hand(flight: Simulated, rates: Rates) -> list[np.ndarray]:
    """The states of a loop on raw readings, from the readings it took."""
    x, states, command = np.array([1.0, 0.0]), [], 0.0
    for k in range((len(flight.t) - 1) * rates.measure + 1):
        if k % rates.measure == 0:
            states.append(x)
            y = np.asarray(flight.y[k // rates.measure])
        if k % rates.control == 0:
            command = -(4.0 * y[0] + 2.0 * y[1])
        push = np.clip(command, -LIMIT, LIMIT)
        x = np.array([x[0] + STEP * x[1] + 0.5 * STEP**2 * push, x[1] + STEP * push])
    return states


@pytest.mark.parametrize(("measure", "control"), [(2, 6), (3, 2), (4, 1), (1, 1), (5, 5)])
def test_a_loop_is_what_its_parts_do_step_by_step(measure: int, control: int, key: jax.Array) -> None:
    rates = Rates(step=STEP, measure=measure, control=control)
    flight = looped(key, duration=12 * measure * STEP, rates=rates)
    np.testing.assert_allclose(flight.t, np.arange(13) * measure * STEP, rtol=1e-15, atol=0)
    np.testing.assert_allclose(flight.truth, by_hand(flight, rates), rtol=0, atol=1e-13)


def test_a_command_is_held_until_the_controller_acts_again_and_cut_to_what_the_motor_can_do(key: jax.Array) -> None:
    flight = looped(key)
    command, applied = np.asarray(flight.command)[:, 0], np.asarray(flight.applied)[:, 0]
    acts = np.arange(len(command)) % 3 == 0
    assert np.all(np.diff(command)[~acts[1:]] == 0)
    assert np.all(np.diff(command)[acts[1:]] != 0)
    assert np.abs(command).max() > LIMIT  # so that there is something to cut
    np.testing.assert_allclose(applied[1:], np.clip(command, -LIMIT, LIMIT)[:-1], rtol=1e-15)
    assert applied[0] == 0


def test_inputs_are_what_was_told_at_the_start_of_an_interval_and_applied_in_it(key: jax.Array) -> None:
    flight = looped(key)
    heat = np.asarray(flight.state["heat"])
    np.testing.assert_allclose(flight.u, np.hstack([flight.applied, np.vstack([heat[:1], heat[:-1]])]), rtol=1e-15)
    np.testing.assert_allclose(np.diff(heat[:, 0]), 2 * STEP * np.abs(flight.applied[1:, 0]), rtol=1e-12)


def test_an_interval_with_two_commands_is_told_their_mean(key: jax.Array) -> None:
    flight = looped(key, rates=Rates(step=STEP, measure=4, control=2), sigma=0.0, duration=2.0)
    # The place follows from the commands one by one; the speed needs their mean alone.
    np.testing.assert_allclose(np.diff(flight.truth[:, 1]), 4 * STEP * flight.applied[1:, 0], rtol=0, atol=1e-14)


def test_an_estimator_in_the_loop_is_a_run_along_the_record(key: jax.Array) -> None:
    rates = Rates(step=STEP, measure=2, control=6, estimate=2)
    through = observer()
    flight = looped(key, observer=through, controller=Spring(estimated=True), rates=rates)
    log = gf.make_log(through.model, flight.t, flight.y, flight.u)
    result = gf.run(through.estimator, through.model, through.prior, log)
    assert flight.info is not None
    np.testing.assert_allclose(flight.info.estimate.mean, result.mean, rtol=0, atol=1e-13)
    np.testing.assert_allclose(flight.info.estimate.cov, result.cov, rtol=1e-12)


def test_a_slow_estimator_is_told_the_mean_input_of_its_own_interval(closed: Any, key: jax.Array) -> None:
    flight = closed(key)
    own = observer()
    rows = slice(None, None, 2)  # readings at its steps
    t = np.asarray(flight.t)[rows]
    pushes = np.asarray(flight.applied)[:, 0]
    means = np.append(0.0, 0.5 * (pushes[1::2] + pushes[2::2]))
    u = np.column_stack([means, np.zeros(len(t))])
    result = gf.run(own.estimator, own.model, own.prior, gf.make_log(own.model, t, np.asarray(flight.y)[rows], u))
    np.testing.assert_allclose(flight.info.estimate.mean[rows], result.mean, rtol=0, atol=1e-13)
    between = np.asarray(flight.info.estimate.mean)
    np.testing.assert_allclose(between[1::2], between[:-1:2], rtol=0, atol=0)  # its last report is held


def test_an_estimator_faster_than_the_readings_predicts_in_between(key: jax.Array) -> None:
    own = observer()
    flight = looped(key, observer=own, rates=Rates(step=STEP, measure=6, control=6, estimate=2))
    assert flight.info is not None
    np.testing.assert_array_equal(flight.info.status, 0)  # measured at every row
    # One command from reading to reading, so that each third of the interval has the same input.
    third = np.repeat(np.asarray(flight.u)[1:], 3, axis=0)
    t = np.arange(len(third) + 1) * 2 * STEP
    y = np.full((len(t), 2), np.nan)
    y[::3] = flight.y
    log = gf.make_log(own.model, t, y, np.vstack([flight.u[:1], third]))
    result = gf.run(own.estimator, own.model, own.prior, log)
    np.testing.assert_allclose(flight.info.estimate.mean, result.mean[::3], rtol=0, atol=1e-13)


def test_the_controller_follows_the_estimate_if_it_asks_for_it(closed: Any, key: jax.Array) -> None:
    flight = closed(key)
    mean = np.asarray(flight.info.estimate.mean)[::3]
    # Where both act at once, which is at every 12th step of the simulation.
    np.testing.assert_allclose(flight.command[::6, 0], -(4.0 * mean[::2, 0] + 2.0 * mean[::2, 1]), rtol=1e-13)


def test_a_fault_changes_what_happens_and_not_what_is_told(key: jax.Array) -> None:
    sound = looped(key)
    faulty = looped(key, actuator_fault=lambda u, t: jnp.where(t >= 1.2, u + 0.3, u))
    before = np.asarray(sound.t) <= 1.2 + 1e-9
    np.testing.assert_array_equal(np.asarray(sound.truth)[before], np.asarray(faulty.truth)[before])
    row = int(before.sum())
    np.testing.assert_array_equal(sound.applied[row], faulty.applied[row])
    extra = np.asarray(faulty.truth)[row, 1] - np.asarray(sound.truth)[row, 1]
    assert extra == pytest.approx(0.3 * 2 * STEP, rel=1e-9)


def test_a_faulty_reading_reaches_the_controller_and_leaves_the_noise_alone(key: jax.Array) -> None:
    sound = looped(key)
    faulty = looped(key, sensor_fault=lambda y, t: y + jnp.where(t >= 1.2, 0.1, 0.0))
    row = int(np.flatnonzero(np.asarray(sound.t) >= 1.2 - 1e-9)[0])
    np.testing.assert_array_equal(np.asarray(sound.y)[:row], np.asarray(faulty.y)[:row])
    np.testing.assert_allclose(faulty.y[row] - sound.y[row], 0.1, rtol=1e-12)
    assert float(faulty.command[row, 0] - sound.command[row, 0]) == pytest.approx(-0.1 * (4.0 + 2.0), rel=1e-9)


def test_a_reading_taken_away_keeps_its_last_value_for_the_controller_and_is_missing_for_the_estimator(
    key: jax.Array,
) -> None:
    def lost(y: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where(jnp.array([False, True]) & (t > 0.5), jnp.nan, y)

    own = observer()
    flight = looped(key, sensor_fault=lost, observer=own, rates=Rates(step=STEP, measure=2, control=2, estimate=2))
    gone = np.asarray(flight.t) > 0.5
    assert np.isnan(flight.y[gone, 1]).all()
    assert np.isfinite(flight.y[:, 0]).all()
    last = float(flight.y[~gone, 1][-1])
    np.testing.assert_allclose(flight.command[gone, 0], -(4.0 * flight.y[gone, 0] + 2.0 * last), rtol=1e-13)
    log = gf.make_log(own.model, flight.t, flight.y, flight.u)
    result = gf.run(own.estimator, own.model, own.prior, log)
    assert flight.info is not None
    np.testing.assert_allclose(flight.info.estimate.mean, result.mean, rtol=0, atol=1e-13)


def test_a_reading_taken_away_from_the_start_is_stood_in_for(key: jax.Array) -> None:
    flight = looped(key, sensor_fault=lambda y, t: jnp.full_like(y, jnp.nan), sigma=0.0)
    # The carriage starts at 1 m: the command answers to that for good.
    assert np.isnan(flight.y).all()
    np.testing.assert_array_equal(flight.command, -4.0)


def test_a_quaternion_with_one_number_missing_is_missing() -> None:
    space = make_space({"rate": "rad/s", "q": "quaternion", "phi": "angle"})
    known = _known(space, jnp.array([1.0, 0.0, jnp.nan, 0.0, 1.0, jnp.inf]))
    assert known.tolist() == [True, False, False, False, False, False]
    assert _degrees(space, known).tolist() == [True, False, False, False, False]


def test_many_loops_at_once_are_the_loops_one_by_one(closed: Any, key: jax.Array) -> None:
    keys = jax.random.split(key, 3)
    together = jax.vmap(closed)(keys)
    for k in range(3):
        alone = closed(keys[k])
        for name in ("truth", "y", "u", "command"):
            np.testing.assert_allclose(getattr(together, name)[k], getattr(alone, name), rtol=0, atol=1e-13)
    assert not np.array_equal(together.y[0], together.y[1])


def test_a_loop_can_be_differentiated_in_its_gains(key: jax.Array) -> None:
    def cost(stiffness: jax.Array) -> jax.Array:
        flight = simulate(carriage(), Spring(stiffness), key=key, duration=1.2, rates=RATES, actuator_fault=half)
        return jnp.sum(flight.truth**2)

    def half(u: jax.Array, t: jax.Array) -> jax.Array:
        return 0.5 * u

    # The motor is at its limit to begin with, so a weaker spring tells how the cost changes.
    slope = jax.jit(jax.grad(cost))(jnp.asarray(0.3))
    ahead, behind = (jax.jit(cost)(jnp.asarray(0.3 + s)) for s in (1e-5, -1e-5))
    assert float(slope) == pytest.approx(float(ahead - behind) / 2e-5, rel=1e-5)
    assert float(slope) != 0.0
