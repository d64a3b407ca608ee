"""A model with faults is its base where they are zero, and does what each kind of fault says where they are not."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.faults import (
    Fault,
    actuator_offset,
    base_prior,
    extend_prior,
    isolability,
    loss_of_effectiveness,
    nominal_log,
    sensor_bias,
    sensor_scale_error,
    with_faults,
)
from gainful.filters import GeneralizedLikelihoodRatio
from gainful.models import Instant
from gainful.spaces import wrap_angle
from gainful.testing import check_model
from gainful.testing.cart import cart_model, cart_prior

from .plants import STEP, cart, faulty

EVERY = (
    actuator_offset("left", walk=0.3, sigma=0.5),
    loss_of_effectiveness("left", walk=0.2, sigma=0.1),
    loss_of_effectiveness("right", time_constant=2.0, walk=0.4, sigma=0.1),
    sensor_bias("range0", walk=0.1, sigma=0.2, per_step=True),
    sensor_scale_error("range0", sigma=0.01),
)


def moment(u=(3.0, -2.0), dt=STEP):
    return Instant(jnp.asarray(1.0), jnp.asarray(dt), jnp.asarray(u))


def state(*sizes):
    return jnp.array([1.0, 0.5, *sizes])


def test_a_model_with_faults_keeps_the_laws_of_a_model():
    check_model(faulty(cart(), *EVERY)[0])


def test_fault_states_come_last_and_are_counted_as_added():
    model = faulty(cart(), *EVERY)[0]
    assert model.fault_names == ("offset_left", "loss_left", "loss_right", "bias_range0", "scale_range0")
    assert model.space.names == ("position", "speed", *model.fault_names)
    assert model.space.units == ("m", "m/s", "N", "1", "1", "m", "1")
    assert model.space.added == 5
    assert with_faults(gf.augment(cart(), biases={"range0": 0.0}), EVERY[:2]).space.added == 3


def test_without_faults_the_model_is_its_base_to_the_last_bit():
    base, model = cart(), faulty(cart(), *EVERY)[0]
    x = state(*[0.0] * 5)
    assert model.transition(x, moment())[:2].tolist() == base.transition(x[:2], moment()).tolist()
    assert model.observe(x, moment()).tolist() == base.observe(x[:2], moment()).tolist()


def test_the_plant_gets_the_command_shifted_and_weakened():
    base, model = cart(), faulty(cart(), *EVERY)[0]
    got = model.transition(state(0.4, 0.25, 0.5, 0.0, 0.0), moment())
    expected = base.transition(state(), moment(((1 - 0.25) * 3.0 + 0.4, (1 - 0.5) * -2.0)))
    np.testing.assert_allclose(got[:2], expected, rtol=4 * np.finfo(float).eps)


def test_the_sensor_reads_the_true_value_shifted_and_magnified():
    model = faulty(cart(), *EVERY)[0]
    assert float(model.observe(state(0.0, 0.0, 0.0, 0.2, 0.1), moment())[0]) == pytest.approx(
        1.1 * 1.0 + 0.2, rel=1e-15
    )


def test_faults_of_an_angle_wrap_with_it():
    model = with_faults(cart_model(), [sensor_bias("compass"), sensor_scale_error("compass")])
    y = model.observe(jnp.array([1.0, 3.1, 0.2, 0.5]), moment((0.0,)))
    assert float(y[2]) == pytest.approx(float(wrap_angle(jnp.asarray(3.1 + 0.2 + 0.5 * 3.1))), rel=1e-14)


def test_faults_stay_or_fade_out_exponentially():
    model = faulty(cart(), *EVERY)[0]
    sizes = np.array([0.4, 0.25, 0.5, 0.2, 0.1])
    left = np.asarray(model.transition(state(*sizes), moment()))[2:]
    np.testing.assert_allclose(left, sizes * np.array([1, 1, np.exp(-STEP / 2.0), 1, 1]), rtol=1e-15)
    assert left[[0, 1, 3, 4]].tolist() == sizes[[0, 1, 3, 4]].tolist()


def test_the_walk_of_a_fading_fault_is_that_of_its_stochastic_equation():
    model = faulty(cart(), *EVERY)[0]
    variance = np.diagonal(model.process_noise(state(*[0.0] * 5), moment()))[2:]
    fading = 0.4**2 * 2.0 / 2 * (1 - np.exp(-2 * STEP / 2.0))
    np.testing.assert_allclose(variance, [0.09 * STEP, 0.04 * STEP, fading, 0.01, 0.0], rtol=1e-13)
    # A stationary fault keeps its variance: what fades is what the walk adds.
    long = np.diagonal(model.process_noise(state(*[0.0] * 5), moment(dt=1e4)))[4]
    assert long == pytest.approx(0.4**2 * 2.0 / 2, rel=1e-13)
    assert not np.diagonal(model.process_noise(state(*[0.0] * 5), moment(dt=0.0))).any()


def test_a_walk_per_step_does_not_know_the_step():
    assert not with_faults(gf.models.continuous_model(*clock()[0], **clock()[1]), [EVERY[3]]).noise_takes_dt
    model = with_faults(gf.models.continuous_model(*clock()[0], **clock()[1]), [sensor_bias("range0", walk=0.1)])
    assert model.noise_takes_dt


def clock():
    def rate(x):
        return jnp.ones(1)

    def read(x):
        return x

    return (rate, read), {"states": ["x"], "outputs": ["range0"], "Q": 0.1, "R": 1.0}


def test_the_numbers_of_the_faults_can_be_differentiated_and_changed():
    model, _ = faulty(cart(), *EVERY)

    def spread(model):
        return jnp.trace(model.process_noise(state(*[0.0] * 5), moment()))

    slope = jax.grad(lambda walk: spread(with_walk(model, walk)))(model.walk)
    np.testing.assert_allclose(slope[:2], 2 * np.array([0.3, 0.2]) * STEP, rtol=1e-13)
    assert float(jnp.sum(model.without_walk().process_noise(state(*[0.0] * 5), moment())[2:])) == 0.0


def with_walk(model, walk):
    return eqx.tree_at(lambda model: model.walk, model, walk)


def test_bounds_are_one_for_what_is_relative_and_infinite_else():
    model = faulty(cart(), *EVERY, Fault("offset", "right", bound=0.1, sigma=0.1))[0]
    assert model.bound.tolist() == [np.inf, 1.0, 1.0, np.inf, 1.0, 0.1]
    assert model.bounds == {"loss_left": 1.0, "loss_right": 1.0, "scale_range0": 1.0, "offset_right": 0.1}
    bank = GeneralizedLikelihoodRatio(gf.kalman_filter(), bounds=model.bounds)
    assert bank.bounds == model.bounds


def test_a_prior_is_extended_by_the_sigmas_and_cut_back_to_the_same():
    model = with_faults(cart_model(), [actuator_offset("speed", sigma=0.3)])
    prior = extend_prior(model, cart_prior())
    assert prior.mean.tolist() == [*cart_prior().mean.tolist(), 0.0]
    assert float(prior.cov[2, 2]) == pytest.approx(0.09)
    assert not np.asarray(prior.cov[2, :2]).any()
    assert base_prior(model, prior).cov.tolist() == cart_prior().cov.tolist()


def test_a_filter_finds_a_constant_fault_of_each_side():
    model, prior = faulty(cart(2), actuator_offset("left", sigma=1.0), sensor_bias("range1", sigma=1.0))
    t = STEP * np.arange(300)
    u = np.stack([np.sin(t), np.cos(t)], axis=1)
    start = gf.make_prior(model, [0.0, 0.0, 0.7, -0.2], [0.0, 0.0, 0.0, 0.0])
    log = gf.draw_log(model, start, t, u, key=jax.random.key(3))
    result = gf.run(gf.kalman_filter(), model, prior, log)
    error, sigma = result.error()[-1, 2:], result.std[-1, 2:]
    assert (np.abs(error) < 4 * sigma).all()  # 6e-5 of all sound runs fail, per fault
    assert (sigma < 0.1).all()


DRIFTING = (
    actuator_offset("left", walk=0.3, sigma=0.5, rate_sigma=0.2, rate_walk=0.05),
    loss_of_effectiveness("right", walk=0.1, sigma=0.1),
    sensor_bias("range0", walk=0.1, sigma=0.2, per_step=True, rate_sigma=0.1),
)


def test_the_rates_of_faults_that_drift_are_states_after_all_sizes():
    model, prior = faulty(cart(), *DRIFTING, sensor_scale_error("range0", sigma=0.1, rate_sigma=0.0))
    rates = ("offset_left_rate", "bias_range0_rate", "scale_range0_rate")
    assert model.fault_names == ("offset_left", "loss_right", "bias_range0", "scale_range0", *rates)
    assert model.space.units[2:] == ("N", "1", "m", "1", "N/s", "m/s", "1/s")
    assert model.space.added == 7
    assert model.bounds == {"loss_right": 1.0, "scale_range0": 1.0}
    np.testing.assert_allclose(np.diagonal(prior.cov)[2:] ** 0.5, [0.5, 0.1, 0.2, 0.1, 0.2, 0.1, 0.0], rtol=1e-15)
    check_model(model)


def test_a_fault_drifts_by_its_rate_and_the_plant_feels_its_size_alone():
    base, model = cart(), faulty(cart(), *DRIFTING)[0]
    x = state(0.4, 0.25, 0.2, 0.7, -0.3)
    after = np.asarray(model.transition(x, moment()))
    np.testing.assert_allclose(after[2:], [0.4 + 0.7 * STEP, 0.25, 0.2 - 0.3 * STEP, 0.7, -0.3], rtol=1e-15)
    expected = base.transition(state(), moment((3.0 + 0.4, (1 - 0.25) * -2.0)))
    np.testing.assert_allclose(after[:2], expected, rtol=4 * np.finfo(float).eps)
    assert float(model.observe(x, moment())[0]) == pytest.approx(1.0 + 0.2, rel=1e-15)


def test_the_noise_of_a_drift_over_two_steps_is_that_over_both_together():
    model = faulty(cart(), *DRIFTING[:2])[0]
    x = state(0.0, 0.0, 0.0)
    moving = np.array(jax.jacobian(lambda x: model.transition(x, moment()))(x))[2:, 2:]
    once, twice = (np.asarray(model.process_noise(x, moment(dt=dt)))[2:, 2:] for dt in (STEP, 2 * STEP))
    np.testing.assert_allclose(moving @ once @ moving.T + once, twice, rtol=1e-13, atol=1e-18)
    assert twice[0, 2] == pytest.approx(0.05**2 * (2 * STEP) ** 2 / 2)
    assert not np.asarray(model.process_noise(x, moment(dt=0.0)))[2:, 2:].any()


@pytest.mark.parametrize(
    ("fault", "of"),
    [
        (actuator_offset, "left"),
        (loss_of_effectiveness, "left"),
        (sensor_bias, "range1"),
        (sensor_scale_error, "range1"),
    ],
)
def test_a_ramp_without_noise_is_followed_without_lag_and_by_a_walk_with(fault, of):
    rate = 0.02  # 1/s
    t = STEP * np.arange(400)
    u = np.stack([np.sin(t), np.cos(t)], axis=1)
    drifting, prior = faulty(cart(2), fault(of, sigma=1.0, rate_sigma=1.0))
    start = jnp.array([1.0, 0.5, 0.1, rate])
    log = nominal_log(drifting, gf.make_prior(drifting, start, np.zeros(4)), t, u)
    off = gf.run(gf.kalman_filter(), drifting, prior, log).error()[-1, 2:]
    walking, short = faulty(cart(2), fault(of, sigma=1.0, walk=1e-3))
    truth = {name: log.truth[name] for name in walking.space.names}
    lag = gf.run(gf.kalman_filter(), walking, short, dataclasses.replace(log, truth=truth)).error()[-1, 2]
    # What is left is the prior's share: its information over the record's.
    assert np.abs(off).max() < 1e-4
    assert lag > 50 * np.abs(off).max()


def test_isolability_counts_the_rate():
    model, prior = faulty(
        cart(2), sensor_bias("range1", sigma=1.0, rate_sigma=1e-3), actuator_offset("left", sigma=1.0)
    )
    t, u = STEP * np.arange(200), np.zeros((200, 2))
    whole = isolability(model, prior, nominal_log(model, prior, t, u))
    assert whole.names == ("bias_range1", "offset_left", "bias_range1_rate")
    assert whole.information.rank == 3
    # A tenth of the time tells a thousandth of a slope's information.
    short = isolability(model, prior, nominal_log(model, prior, t[:20], u[:20]))
    assert short.information.rank == 2
    assert short.information.unobserved == ("bias_range1_rate",)


def test_a_jump_bank_finds_where_a_ramp_begins():
    onset, rate = 20.0, 0.05
    model, prior = faulty(cart(2), actuator_offset("left", sigma=0.01, rate_sigma=1e-4))
    t, u = STEP * np.arange(400), np.ones((400, 2))
    start = gf.make_prior(model, np.zeros(4), np.zeros(4))
    sound = gf.draw_log(model, start, t, u, key=jax.random.key(8))
    bank = GeneralizedLikelihoodRatio(gf.two_stage_kalman_filter(), bounds={"offset_left_rate": 1.0}, hold=20)
    # What the plant would have done with the ramp, linear as it is.
    ramp = np.where(t >= onset, rate * (t - onset), 0.0)
    moved = nominal_log(
        cart(2), gf.make_prior(cart(2), [0.0, 0.0], [0.0, 0.0]), t, np.stack([np.r_[0, ramp[:-1]], 0 * t], 1)
    )
    log = dataclasses.replace(sound, y=sound.y + moved.y, truth={})
    report = gf.run(bank, model, prior, log).memories
    rows = np.flatnonzero(report.alarm)
    assert len(rows)
    assert model.fault_names[int(report.bias[rows[0]])] == "offset_left_rate"
    assert onset < t[rows[0]] < onset + 5
    assert t[rows[0]] - STEP * int(report.age[rows[0]]) == pytest.approx(onset, abs=1.5)
