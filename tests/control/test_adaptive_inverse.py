"""An inverse of a model that learns: what it does with the right model, a wrong one, and with readings it cannot trust."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.control import (
    AbstractReference,
    AdaptiveInverseController,
    ErrorStatistics,
    FollowReference,
    Guardrails,
    IncrementalInversion,
    Inversion,
    SetPoint,
    StateFeedback,
    StateSource,
    one_step_gain,
)
from gainful.identification import OneStepModel, fit_one_step
from gainful.networks import AffineMap, ProductFeatures, make_radial_basis
from gainful.regression import WeightFilter
from gainful.running import Observer, Simulated, simulate

from .carriage import LIMIT, carriage, carriage_model
from .test_state_feedback import HOME, PLANT, RATES, Homing, T, pushed

WEIGHTS = np.array([10.0, 1.0])  # of place and speed
LEARNING = WeightFilter(form="covariance", random_walk=1e-6)
QUICK = WeightFilter(form="covariance", random_walk=1e-2)
KEY = jax.random.key(3)


class Swing(AbstractReference):
    """To and fro in two tones, so that no input is told by the state alone."""

    def state(self, t: jax.Array) -> jax.Array:
        return jnp.stack([0.2 * jnp.sin(t) + 0.05 * jnp.sin(2.3 * t), 0.2 * jnp.cos(t) + 0.115 * jnp.cos(2.3 * t)])

    def input(self, t: jax.Array) -> jax.Array:
        return jnp.zeros(1)


SWING = FollowReference(T, Swing())


@eqx.filter_jit
def looped(
    controller: Any, key: jax.Array = KEY, *, sigma: float = 0.0, duration: float = 12.0, **given: Any
) -> Simulated:
    return simulate(carriage(sigma), controller, key=key, duration=duration, rates=RATES, **given)


def examples(effect: float = 1.0, reach: float = 2.0) -> Any:
    """A model of the carriage from rows about home, `effect` times as strong a motor as it has."""
    x, u = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 200, 2)) * reach
    u = u[:, :1] * LIMIT
    network = make_radial_basis(ProductFeatures([LIMIT, reach, reach]), 2, 0, tail="affine")
    return fit_one_step(network, x, u, x @ PLANT.A.T + effect * u @ PLANT.B.T, weight_filter=LEARNING)


FIT = examples()


def controller(fit: Any = FIT, *, learns: bool = True, **options: Any) -> AdaptiveInverseController:
    model = fit.model
    inversion = Inversion(WEIGHTS * model.output_scale**2, sweeps=1, damping=0.0, limit=LIMIT, input_scale=LIMIT)
    learning = {"learning": fit.weight_filter, "known": fit.state} if learns else {}
    options = {"inversion": inversion, "command": FollowReference(T, HOME)} | learning | options
    return AdaptiveInverseController(model, **options)


def effect(flight: Simulated, fit: Any = FIT) -> np.ndarray:
    """What the model says a unit of input does to the speed, relative to the truth."""
    return np.asarray(flight.report.sensitivity[:, 1, 0] * fit.model.output_scale[1]) / T


def test_with_the_right_model_it_is_the_one_step_regulator() -> None:
    flight = looped(controller(learns=False))
    gain = one_step_gain(PLANT, WEIGHTS, np.zeros((2, 2)))
    wanted = np.clip(-np.asarray(flight.truth) @ gain.T, -LIMIT, LIMIT)
    # The prior of the fit leaves the model this far from the truth.
    np.testing.assert_allclose(flight.command, wanted, atol=2e-5)
    report = flight.report
    np.testing.assert_allclose(effect(flight), 1.0, rtol=1e-5)
    assert np.isnan(report.innovation[0]).all()
    np.testing.assert_allclose(report.innovation[1:], 0.0, atol=1e-4)
    np.testing.assert_array_equal(report.state, flight.y)
    assert report.saturated.any()
    assert not report.learned[0]
    assert np.isnan(report.trace).all()


def test_a_wrong_model_is_put_right_by_what_comes_of_its_inputs() -> None:
    wrong = examples(effect=1.7)
    flight = looped(controller(wrong, learning=QUICK, command=SWING))
    learned = effect(flight, wrong)
    assert learned[0] == pytest.approx(1.7, rel=1e-3)
    # Two tones leave some doubt whether place, speed or push moved the carriage.
    assert learned[-1] == pytest.approx(1.0, abs=0.1)
    assert flight.report.learned[1:].all()
    assert flight.report.trace[-1] > 0


def test_a_motor_that_loses_most_of_its_force_is_learned() -> None:
    def weaker(u: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where(t < 1.0, u, 0.3 * u)

    adaptive = looped(controller(learning=QUICK, command=SWING), actuator_fault=weaker)
    assert effect(adaptive)[-1] == pytest.approx(0.3, abs=0.05)
    assert adaptive.report.fallback.sum() == 0


def test_a_push_nobody_knows_is_made_up_for_by_the_mean_error_or_by_learning() -> None:
    plain, compensated, learning = (
        looped(controller(learns=learns, statistics=statistics), actuator_fault=pushed, duration=20.0)
        for learns, statistics in ((False, None), (False, ErrorStatistics(rate=0.1)), (True, None))
    )
    off = [abs(float(flight.truth[-1, 0])) for flight in (plain, compensated, learning)]
    assert off[0] == pytest.approx(0.1 / float(one_step_gain(PLANT, WEIGHTS, np.zeros((2, 2)))[0, 0]), rel=0.01)
    assert off[1] < 1e-3
    assert off[2] < 5e-3
    # A push of 0.1 m/s^2 is what the model misses of the speed in a sample.
    missed = 0.1 * T / float(FIT.model.output_scale[1])
    np.testing.assert_allclose(compensated.report.bias[-1, 1], missed, rtol=1e-3)


def test_with_a_pure_gain_and_the_latest_error_it_is_incremental_inversion() -> None:
    inversion = Inversion(jnp.array([0.0, 1.0]), sweeps=1, damping=0.0, limit=LIMIT)
    gain = jnp.zeros((2, 3)).at[1, 0].set(1.3 * T)
    model = OneStepModel(AffineMap(gain, jnp.zeros(2)), jnp.ones(2))
    latest = ErrorStatistics(rate=1.0, counts=False)
    found = looped(AdaptiveInverseController(model, Homing(T), inversion, statistics=latest), sigma=0.01)
    wanted = looped(IncrementalInversion([[1.3 * T]], Homing(T), (1,), limit=LIMIT), sigma=0.01)
    np.testing.assert_allclose(found.command, wanted.command, atol=1e-9)


def gone(first: float, last: float) -> Any:
    def fault(y: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where((t > first - 0.01) & (t < last + 0.01), jnp.nan, y)

    return fault


def test_missing_readings_are_predicted_and_never_learned_from() -> None:
    flight = looped(controller(), sensor_fault=gone(2.0, 2.3))
    report = flight.report
    assert report.missing[19:26].tolist() == [0, 1, 2, 3, 4, 0, 0]
    # The sample after the last missing one has nothing to compare itself with.
    assert report.learned[19:26].tolist() == [True, False, False, False, False, False, True]
    np.testing.assert_array_equal(report.trace[20:25], report.trace[20] * np.ones(5))
    assert all(np.isfinite(leaf).all() for leaf in (report.state, flight.command, report.trace))
    np.testing.assert_allclose(report.state, flight.truth, atol=1e-4)
    assert abs(float(flight.truth[-1, 0])) < 1e-2


def test_a_part_of_a_reading_that_is_missing_is_predicted_alone() -> None:
    def half(y: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where(jnp.array([False, True]) & (t > 2.0), jnp.nan, y)

    flight = looped(controller(guardrails=Guardrails(most_missing=None)), sensor_fault=half)
    np.testing.assert_array_equal(flight.report.state[:, 0], flight.truth[:, 0])
    np.testing.assert_allclose(flight.report.state[:, 1], flight.truth[:, 1], atol=1e-3)
    assert abs(float(flight.truth[-1, 0])) < 1e-2


def test_after_too_many_missing_readings_the_fallback_takes_over_without_a_bump() -> None:
    fallback = StateFeedback([[0.0, 3.0]], SetPoint([0.0, 0.0], [0.2]), limit=LIMIT)
    flight = looped(controller(fallback=fallback), sensor_fault=gone(2.0, 3.5))
    acting = np.asarray(flight.report.fallback)
    # Missing from row 20 on; five are borne; the readings are back at row 36.
    assert np.flatnonzero(acting).tolist() == list(range(25, 36))
    command = np.asarray(flight.command[:, 0])
    assert command[25] == pytest.approx(command[24], abs=1e-12)
    # On held readings its command is constant: the difference at the start fades with a second.
    own = np.clip(0.2 - 3.0 * float(flight.truth[19, 1]), -LIMIT, LIMIT)
    fading = np.clip(own + (command[24] - own) * np.exp(-T * np.arange(11)), -LIMIT, LIMIT)
    np.testing.assert_allclose(command[25:36], fading, atol=1e-12)


def test_errors_beyond_their_bound_call_the_fallback_until_they_are_half_as_large() -> None:
    fallback = StateFeedback([[1.0, 2.0]], HOME, limit=LIMIT)
    flight = looped(controller(fallback=fallback, guardrails=Guardrails(largest_error=jnp.array([0.8, 5.0]))))
    place, acting = np.asarray(flight.truth[:, 0]), np.asarray(flight.report.fallback)
    back = int(np.flatnonzero(~acting)[0])
    assert acting[:back].all()
    assert not acting[back:].any()
    assert place[back] <= 0.4 < place[back - 1]


def test_an_effect_that_is_lost_is_not_believed() -> None:
    def dead(u: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.where(t < 1.0, u, 0.02 * u)

    watched = looped(controller(learning=QUICK, command=SWING), actuator_fault=dead)
    weak = np.asarray(watched.report.weak[:, 0])
    assert weak.any()
    assert not weak[:10].any()
    assert (effect(watched) >= 0.1).all()
    free = looped(controller(learning=QUICK, command=SWING, guardrails=Guardrails.none()), actuator_fault=dead)
    assert effect(free).min() < 0.1
    assert not free.report.weak.any()


def test_a_model_that_was_never_believed_hands_over_at_once() -> None:
    nominal = -FIT.model.control_jacobian(jnp.zeros(2), jnp.zeros(1)) / FIT.model.output_scale[:, None]
    fallback = StateFeedback([[1.0, 2.0]], HOME, limit=LIMIT)
    flight = looped(controller(fallback=fallback, nominal=nominal))
    assert flight.report.weak.all()
    assert flight.report.fallback.all()
    assert abs(float(flight.truth[-1, 0])) < 0.05


def test_outside_what_the_network_knows_nothing_is_learned() -> None:
    near = examples(reach=0.4)  # believed to 0.6 m, and the carriage starts at 1 m
    flight = looped(controller(near))
    outside = np.abs(np.asarray(flight.truth[:, 0])) > 0.6
    assert outside[0]
    assert not outside[-1]
    np.testing.assert_array_equal(flight.report.extrapolating, outside)
    np.testing.assert_array_equal(flight.report.learned[1:], ~outside[:-1])
    free = looped(controller(near, guardrails=Guardrails.none()))
    assert free.report.learned[1:].all()


def test_it_acts_on_the_estimate_of_an_observer() -> None:
    model = carriage_model()
    observer = Observer(gf.kalman_filter(), model, gf.make_prior(model, [0.9, 0.0], [0.2, 0.1]))
    lost = gone(3.0, 3.4)
    flight = looped(controller(source=StateSource("estimate")), sigma=0.02, observer=observer, sensor_fault=lost)
    assert flight.info is not None
    np.testing.assert_array_equal(flight.report.state[:30], flight.info.estimate.mean[:30])
    assert not flight.report.learned[30:36].any()
    assert np.abs(flight.truth[-20:, 0]).max() < 0.06


def test_many_loops_at_once_are_the_loops_one_by_one() -> None:
    keys = jax.random.split(KEY, 3)
    law = controller(statistics=ErrorStatistics())
    together = jax.jit(jax.vmap(lambda key: looped(law, key, sigma=0.02, duration=4.0).truth))(keys)
    for k in range(3):
        np.testing.assert_allclose(together[k], looped(law, keys[k], sigma=0.02, duration=4.0).truth, atol=1e-10)
