"""Injected faults do what they say while they last, and nothing to anything else."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.faults import (
    Bias,
    Drift,
    FaultySignals,
    Intermittent,
    Loss,
    NoiseIncrease,
    Outliers,
    Stuck,
    actuator_offset,
    disturb,
    inject,
    loss_of_effectiveness,
    sensor_bias,
    sensor_scale_error,
    with_faults,
)
from gainful.testing.cart import cart_model, cart_prior

from .plants import STEP, cart, faulty

ROWS = 60
T = STEP * np.arange(ROWS)
U = np.stack([np.sin(T), 1.0 + np.cos(T)], axis=1)
SPAN = {"onset": 1.0, "end": 3.0}
EVERY = [
    (Bias("left", 0.3, **SPAN), lambda v, t: v + 0.3),
    (Drift("left", 0.2, **SPAN), lambda v, t: v + 0.2 * (t - 1.0)),
    (Stuck("left", 0.7, **SPAN), lambda v, t: 0.7 + 0 * v),
    (Loss("left", 0.4, **SPAN), lambda v, t: 0.6 * v),
    (Intermittent(Bias("left", 0.3, **SPAN), period=0.5, duty=0.5), None),
    (NoiseIncrease("left", 0.5, **SPAN), None),
    (Outliers("left", 0.3, 0.5, **SPAN), None),
]


@pytest.fixture(scope="module")
def record():
    return gf.draw_log(cart(2), gf.make_prior(cart(2), [0, 0], [0, 0]), T, U, key=jax.random.key(0))


def spread(fault, values, t):
    keys = jax.random.split(jax.random.key(1), len(t))
    return np.asarray(jax.jit(jax.vmap(fault))(jnp.asarray(values), jnp.asarray(t), keys))


@pytest.mark.parametrize(("fault", "law"), EVERY, ids=lambda given: getattr(given, "word", ""))
def test_a_fault_acts_from_its_onset_to_before_its_end_and_not_outside(fault, law):
    values = np.cos(T)
    found = spread(fault, values, T)
    inside = (T >= 1.0) & (T < 3.0)
    assert found[~inside].tolist() == values[~inside].tolist()
    if law is not None:
        np.testing.assert_allclose(found[inside], law(values, T)[inside], rtol=1e-14, atol=1e-15)


def test_a_stuck_signal_is_exactly_its_level():
    assert set(spread(Stuck("left", 0.7, **SPAN), np.cos(T), T)[(T >= 1.0) & (T < 3.0)]) == {0.7}


def test_an_intermittent_fault_is_there_for_its_duty_of_every_period():
    fault = Intermittent(Bias("left", 0.3, **SPAN), period=0.5, duty=0.4)
    t = 1.0 + 0.01 * np.arange(200) + 1e-6  # off the edges, where rounding decides
    there = np.asarray(jax.vmap(fault.active)(jnp.asarray(t)))
    assert there.tolist() == ((t - 1.0) % 0.5 < 0.2).tolist()
    assert there.mean() == pytest.approx(0.4)


def test_added_noise_has_its_sigma_and_another_draw_in_every_row():
    added = spread(NoiseIncrease("left", 0.5), np.zeros(4000), np.zeros(4000))
    assert len(set(added)) == 4000
    # The standard deviation of 4000 has a relative standard error of 1.1 %; five of them.
    assert added.std() == pytest.approx(0.5, rel=5 / np.sqrt(2 * 4000))
    assert abs(added.mean()) < 5 * 0.5 / np.sqrt(4000)


def test_faults_of_one_signal_add_up_on_the_sound_value_and_others_are_left_alone():
    faults = [Bias("b", 1.0), Loss("b", 0.5), Drift("elsewhere", 1.0)]
    found = jax.jit(lambda v: disturb(v, ("a", "b"), faults, 0.0, jax.random.key(0)))(jnp.array([0.1, 4.0]))
    assert found.tolist() == [0.1, 3.0]


def test_sizes_and_times_can_be_mapped_over():
    def at_end(size, onset):
        return disturb(jnp.zeros(1), ("a",), [Bias("a", size, onset)], jnp.asarray(2.0), jax.random.key(0))[0]

    assert jax.vmap(at_end)(jnp.array([1.0, 2.0]), jnp.array([0.0, 3.0])).tolist() == [1.0, 0.0]


def test_a_loop_takes_its_faults_as_a_function_of_values_and_time():
    signals = FaultySignals(("a", "b"), (NoiseIncrease("a", 1.0, onset=1.0), Bias("b", 2.0, onset=1.0)))
    make = jax.jit(jax.vmap(lambda t: signals(jnp.array([5.0, 6.0]), t)))
    times = jnp.array([0.99, 1.0, 1.01, 1.01])
    found = make(times)
    assert found[0].tolist() == [5.0, 6.0]
    assert found[1:, 1].tolist() == [8.0] * 3
    assert len({float(noisy) for noisy in found[:, 0]}) == 3
    assert found[2].tolist() == found[3].tolist()


def test_a_record_keeps_every_other_signal_and_itself_to_the_last_bit(record):
    before = [record.t.copy(), record.u.copy(), record.y.copy()]
    model = faulty(cart(2), sensor_bias("range1", sigma=1.0))[0]
    faults = [Bias("range1", 0.5, **SPAN), NoiseIncrease("right", 0.1, **SPAN)]
    made = inject(record, model, faults, jax.random.key(0))
    assert all((was == now).all() for was, now in zip(before, (record.t, record.u, record.y), strict=True))
    assert made.y[:, 0].tobytes() == record.y[:, 0].tobytes()
    assert made.u[:, 0].tobytes() == record.u[:, 0].tobytes()
    inside = (T >= 1.0) & (T < 3.0)
    np.testing.assert_allclose(made.y[:, 1] - record.y[:, 1], 0.5 * inside, atol=1e-15)
    assert made.y[~inside, 1].tobytes() == record.y[~inside, 1].tobytes()
    assert made.counts == {"noise of right injected": 20, "bias of range1 injected": 20}
    assert (made.seen == record.seen).all()


def test_the_truth_of_a_fault_state_says_how_large_the_fault_is(record):
    model = faulty(cart(2), sensor_bias("range0", sigma=1.0), sensor_scale_error("range1", sigma=1.0))[0]
    faults = [Drift("range0", 0.2, **SPAN), Loss("range1", 0.1, **SPAN)]
    truth = inject(record, model, faults, jax.random.key(0)).truth
    inside = (T >= 1.0) & (T < 3.0)
    np.testing.assert_allclose(truth["bias_range0"], np.where(inside, 0.2 * (T - 1.0), 0.0), rtol=1e-12)
    np.testing.assert_allclose(truth["scale_range1"], np.where(inside, -0.1, 0.0), rtol=1e-12)
    assert set(truth) == {"position", "speed", "bias_range0", "scale_range1"}


def test_what_has_no_state_of_its_own_counts_by_what_it_adds(record):
    model = faulty(cart(2), sensor_bias("range0", sigma=1.0))[0]
    made = inject(record, model, [Stuck("range0", 2.0, **SPAN)], jax.random.key(0))
    np.testing.assert_allclose(made.y[:, 0], record.y[:, 0] + made.truth["bias_range0"], atol=1e-15)


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        (Bias("left", 0.3, **SPAN), actuator_offset("left", sigma=1.0)),
        (Drift("left", 0.3, **SPAN), actuator_offset("left", sigma=1.0)),
        (Loss("left", 0.4, **SPAN), loss_of_effectiveness("left", sigma=1.0)),
        (Loss("left", 0.4, **SPAN), actuator_offset("left", sigma=1.0)),
        (Intermittent(Bias("left", 0.3, **SPAN), period=0.55), actuator_offset("left", sigma=1.0)),
    ],
    ids=lambda given: getattr(given, "word", getattr(given, "kind", "")),
)
def test_with_the_true_fault_the_model_gives_the_plant_what_it_got(record, fault, kind):
    model = faulty(cart(2), kind)[0]
    made = inject(record, model, [fault], jax.random.key(0))
    size = made.truth[kind.name]
    # The size at a row acts on the interval that follows.
    command, before = made.u[1:, 0], size[:-1]
    got = command + before if kind.kind == "offset" else (1 - before) * command
    np.testing.assert_allclose(got, record.u[1:, 0], rtol=1e-14, atol=1e-15)
    assert np.abs(made.u - record.u).max() > 0.1


def test_an_injected_actuator_fault_is_found_with_its_sign_and_size(record):
    model, prior = faulty(cart(2), actuator_offset("left", sigma=1.0))
    made = inject(record, model, [Bias("left", 0.8)], jax.random.key(0))
    result = gf.run(gf.kalman_filter(), model, prior, made)
    assert abs(result.error()[-1, 2]) < 4 * result.std[-1, 2] < 0.4


def test_angles_wrap_and_their_sound_rows_stay():
    model = with_faults(cart_model(), [sensor_bias("compass")])
    log = gf.draw_log(cart_model(), cart_prior(), T, np.ones((ROWS, 1)), key=jax.random.key(2))
    made = inject(log, model, [Bias("compass", 3.0, **SPAN)], jax.random.key(0))
    inside = (T >= 1.0) & (T < 3.0)
    assert (np.abs(made.y[:, 2]) <= np.pi).all()
    turned = np.exp(1j * (made.y[:, 2] - log.y[:, 2]))
    np.testing.assert_allclose(turned[inside], np.exp(3j), atol=1e-14)
    assert made.y[~inside].tobytes() == log.y[~inside].tobytes()
    assert made.y[:, :2].tobytes() == log.y[:, :2].tobytes()


def test_a_quaternion_is_turned_and_stays_one():
    model = gf.discrete_model(
        lambda x, u, t: x, lambda x, u, t: x, states={"q": "quaternion"}, outputs={"z": "quaternion"}, Q=0.1, R=1.0
    )
    log = gf.make_log(model, T, np.tile([0.0, 0.6, 0.0, 0.8], (ROWS, 1)))
    signal = model.output.tangent_names[0]
    made = inject(log, model, [Bias(signal, 0.2, **SPAN)], jax.random.key(0))
    turned = np.asarray(jax.vmap(model.output.minus)(made.y, log.y))
    inside = (T >= 1.0) & (T < 3.0)
    np.testing.assert_allclose(turned, inside[:, None] * np.array([0.2, 0.0, 0.0]), atol=1e-14)
    assert made.y[~inside].tobytes() == log.y[~inside].tobytes()


def test_truth_that_is_there_already_is_added_to(record):
    model = faulty(cart(2), sensor_bias("range0", sigma=1.0))[0]
    start = gf.make_prior(model, [0, 0, 0.25], [0, 0, 0])
    log = gf.draw_log(model, start, T, U, key=jax.random.key(0))
    made = inject(log, model, [Bias("range0", 0.5, **SPAN)], jax.random.key(0))
    assert made.truth["bias_range0"][15] == 0.75
    assert log.truth["bias_range0"][15] == 0.25
