"""What can be told of faults before a run, and what is told after an alarm."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import observability
from gainful.faults import (
    Bias,
    actuator_offset,
    explain,
    fault_scores,
    inject,
    isolability,
    loss_of_effectiveness,
    nominal_log,
    sensor_bias,
    single_fault_scores,
)

from .plants import STEP, cart, faulty, pyramid

ROWS = 80
T = STEP * np.arange(ROWS)
WHEELS = tuple(f"offset_wheel_{k}" for k in range(1, 5))


@pytest.fixture(scope="module")
def thruster():
    """The cart with an offset and a loss of the same thruster, and a report for a command."""
    model, prior = faulty(cart(), actuator_offset("left", sigma=0.5), loss_of_effectiveness("left", sigma=0.5))

    def report(command, **options):
        u = np.stack([np.broadcast_to(command, ROWS), np.zeros(ROWS)], axis=1)
        return isolability(model, prior, nominal_log(model, prior, T, u), **options)

    return report


def test_a_loss_is_not_observed_while_the_command_is_zero(thruster):
    found = thruster(0.0)
    assert (found.information.rank, found.information.unobserved) == (1, ("loss_left",))
    assert found.sentence == "1 of 2 faults observed; not observed: loss_left"
    assert not found.isolable
    assert found.sigma[-1, 1] == pytest.approx(0.5, rel=1e-12)
    assert found.sigma[-1, 0] < 0.05


def test_an_offset_and_a_loss_are_one_while_the_command_does_not_vary(thruster):
    found = thruster(1.0)
    assert found.information.rank == 1
    # The plant gets u + offset - loss u: with u = 1, equal sizes cancel.
    assert found.information.unobserved == ("0.71 offset_left + 0.71 loss_left",)
    (pair,) = found.pairs
    assert pair.names == ("offset_left", "loss_left")
    assert pair.correlation > 0.99
    assert pair.sentence.startswith("offset_left and loss_left cannot be told apart (correlation ")
    assert pair.sentence in found.sentence
    assert not found.isolable


def test_they_are_ambiguous_until_the_command_varies(thruster):
    step = 50
    found = thruster(np.where(np.arange(ROWS) < step, 1.0, -1.0))
    assert found.information.rank == 2
    (pair,) = found.pairs
    assert T[step] < pair.until < T[-1]
    assert abs(pair.correlation) < 0.95
    assert pair.sentence == f"offset_left and loss_left ambiguous until t = {pair.until:.4g} s"
    assert found.isolable
    assert found.sentence.startswith("all 2 faults observed (condition ")


def test_four_wheels_on_three_axes_leave_their_null_direction():
    model, prior = pyramid()
    found = isolability(model, prior, nominal_log(model, prior, T))
    assert (found.information.rank, found.information.names) == (3, WHEELS)
    assert found.information.unobserved == (
        "0.5 offset_wheel_1 - 0.5 offset_wheel_2 + 0.5 offset_wheel_3 - 0.5 offset_wheel_4",
    )
    assert np.isinf(found.information.condition) or found.information.condition > 1e9
    # Of each wheel a quarter of the variance lies in the null direction.
    np.testing.assert_allclose(found.sigma[-1], np.full(4, 0.05 / 2), rtol=1e-2)
    assert found.result is not None
    assert set(WHEELS).issubset(observability(found.result).names)


def test_achievable_sigmas_are_those_of_least_squares():
    """Without process noise and with the start known, the offset shifts the position by its double integral."""
    plant = gf.linear_model(
        [[1.0, STEP], [0.0, 1.0]],
        [[1.0, 0.0]],
        Q=[0.0, 0.0],
        R=0.04,
        B=[[0.5 * STEP**2], [STEP]],
        states=["x", "v"],
        inputs=["a"],
    )
    model, prior = faulty(plant, actuator_offset("a", sigma=0.7))
    certain = gf.Gaussian.start(prior.mean, prior.cov.at[:2].set(0.0), prior.space)
    found = isolability(model, certain, nominal_log(model, certain, T))
    effect = 0.5 * T**2
    information = 1 / 0.7**2 + np.cumsum(effect**2) / 0.04
    np.testing.assert_allclose(found.sigma[:, 0], information**-0.5, rtol=1e-9)
    expected = 0.7**2 * effect @ effect / 0.04
    np.testing.assert_allclose(found.information.singular_values, [expected], rtol=1e-6)


def test_the_walk_of_the_faults_does_not_count():
    sigmas = []
    for walk in (0.0, 10.0):
        model, prior = faulty(cart(), actuator_offset("left", sigma=0.5, walk=walk))
        sigmas.append(isolability(model, prior, nominal_log(model, prior, T)).sigma)
    assert sigmas[0].tolist() == sigmas[1].tolist()


def test_what_was_learned_before_the_onset_is_not_about_the_fault(thruster):
    # The command varies only before the onset.
    command = np.where(np.arange(ROWS) < 40, np.sin(T), 1.0)
    assert thruster(command).information.rank == 2
    late = thruster(command, onset=T[40])
    assert late.information.rank == 1
    assert late.t[0] == T[41]
    assert late.sigma[0, 1] == pytest.approx(0.5, rel=1e-2)
    # By then the plant's own states are known better than before the first row.
    assert late.sigma[20, 0] < thruster(np.ones(ROWS)).sigma[20, 0]


def test_a_record_that_measured_nothing_tells_nothing():
    model, prior = faulty(cart(), sensor_bias("range0", sigma=0.2))
    log = gf.make_log(model, T, np.full(ROWS, np.nan), np.zeros((ROWS, 2)))
    found = isolability(model, prior, log)
    assert found.information.unobserved == ("bias_range0",)
    np.testing.assert_allclose(found.sigma, 0.2, rtol=1e-12)


def test_a_bias_of_the_only_sensor_passes_for_the_state():
    model, prior = faulty(cart(), sensor_bias("range0", sigma=0.2))
    # As uncertain as the start: of the two only the sum is known, so its variance is halved against 0.1 m.
    found = isolability(model, prior, nominal_log(model, prior, T))
    assert found.sigma[-1, 0] == pytest.approx((1 / 0.2**2 + 1 / 0.1**2) ** -0.5, rel=1e-2)
    assert found.information.rank == 1
    two, prior = faulty(cart(2), sensor_bias("range0", sigma=0.2))
    assert isolability(two, prior, nominal_log(two, prior, T)).sigma[-1, 0] < 0.01


def test_a_fault_that_is_known_beforehand_is_left_out():
    model, prior = faulty(cart(), actuator_offset("left", sigma=0.5), sensor_bias("range0", sigma=0.0))
    found = isolability(model, prior, nominal_log(model, prior, T))
    assert found.information.names == ("offset_left",)
    assert not found.correlation[1].any()


# After an alarm -------------------------------------------------------------------------------------------------------


def test_one_wheel_that_explains_the_data_alone_stands_out_where_four_offsets_are_not_observed():
    model, prior = pyramid()
    log = gf.draw_log(model.base, gf.make_prior(model.base, np.zeros(3), np.zeros(3)), T, key=jax.random.key(1))
    result = gf.run(gf.kalman_filter(), model, prior, inject(log, model, [Bias("wheel_2", 0.04)], jax.random.key(0)))
    mean, cov = jnp.asarray(result.mean[-1]), jnp.asarray(result.cov[-1])
    told = explain(WHEELS, single_fault_scores(mean, cov, 4))
    assert told.fault == "offset_wheel_2"
    assert not told.ambiguous
    assert told.sentence == f"offset_wheel_2 (score {told.score:.3g})"
    # The joint estimate blames all four, and none of them beyond doubt.
    joint = np.abs(np.asarray(fault_scores(mean, cov, 4)))
    assert (joint > 0.2).all()
    assert (joint < 2.0).all()


def test_the_score_of_a_fault_is_twice_its_log_likelihood_ratio(rng):
    """Two constant faults seen through a random matrix in noise: each alone against none, by hand."""
    seen, prior = rng.standard_normal((30, 2)), np.diag([4.0, 0.25])
    y = seen @ np.array([1.0, -0.2]) + rng.standard_normal(30)
    cov = np.linalg.inv(seen.T @ seen + np.linalg.inv(prior))
    mean = cov @ seen.T @ y
    scores = single_fault_scores(jnp.asarray(mean), jnp.asarray(cov), 2)
    for j in range(2):
        # The largest of the likelihood times the prior density, over its value without the fault.
        best = (seen[:, j] @ y) ** 2 / (seen[:, j] @ seen[:, j] + 1 / prior[j, j])
        assert float(scores[j]) == pytest.approx(best, rel=1e-10)


def test_scores_do_not_depend_on_units(rng):
    root = rng.standard_normal((3, 3))
    mean, cov, units = rng.standard_normal(3), root @ root.T, np.array([1.0, 1e-9, 1e6])
    plain = single_fault_scores(jnp.asarray(mean), jnp.asarray(cov), 3)
    scaled = single_fault_scores(jnp.asarray(mean * units), jnp.asarray(cov * np.outer(units, units)), 3)
    np.testing.assert_allclose(scaled, plain, rtol=1e-9)


def test_a_runner_up_within_the_margin_makes_the_answer_ambiguous():
    names = ["offset", "loss", "gyro"]
    told = explain(names, np.array([30.0, 25.0, 3.0]), margin=6.0)
    assert (told.fault, told.rivals, told.ambiguous) == ("offset", ("loss",), True)
    assert told.sentence == "ambiguous: offset or loss"
    assert not explain(names, np.array([30.0, 25.0, 3.0]), margin=4.0).ambiguous
    assert explain(names, np.array([np.nan, 1.0, np.nan])).fault == "loss"


def test_offset_and_loss_are_called_ambiguous_before_the_command_varies_and_told_apart_after():
    faults = (actuator_offset("left", sigma=0.5), loss_of_effectiveness("left", sigma=0.5))
    model, prior = faulty(cart(), *faults)
    u = np.stack([np.where(np.arange(ROWS) < 50, 1.0, -1.0), np.zeros(ROWS)], axis=1)
    start = gf.make_prior(model, [0.0, 0.0, 0.0, 0.6], np.zeros(4))
    result = gf.run(gf.kalman_filter(), model, prior, gf.draw_log(model, start, T, u, key=jax.random.key(4)))
    told = [
        explain(model.fault_names, single_fault_scores(jnp.asarray(result.mean[k]), jnp.asarray(result.cov[k]), 2))
        for k in (45, ROWS - 1)
    ]
    assert told[0].ambiguous
    assert (told[1].fault, told[1].ambiguous) == ("loss_left", False)
