"""A corrected update adds what the network says, only where it may, and never claims the filter's covariance for it."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.networks import AffineMap, CMACTraining, zero_map
from gainful.testing.comparisons import assert_close, assert_identical
from gainful.updates import Corrected, Correction, InnovationHistory, OnlineGate, UpdateFeatures

from .track import F, H, prior, steady, track_model, tracks

MODEL, FILTER = track_model(), gf.kalman_filter()
MOVE_X, MOVE_V, LEFT, GAINS = 0, 1, 2, (3, 4)
"""Where the features of an update stand."""


@pytest.fixture(scope="module")
def log(generator: object) -> gf.Log:
    """A record with rows that were not measured."""
    whole = tracks(generator("track"), 1, 60)[0]
    seen = whole.seen.copy()
    seen[[0, 20, 21, 22, 40]] = False
    return dataclasses.replace(whole, seen=seen)


def run_with(update: Corrected, log: gf.Log, **options: object) -> tuple[gf.Result, Correction]:
    result = gf.run(dataclasses.replace(FILTER, update=update, **options), MODEL, prior(), log)
    return result, result.memories[0]


def pushing(x: float = 0.0, v: float = 0.0, by: int = LEFT) -> AffineMap:
    """A network that corrects displacement and speed in proportion to one feature."""
    return AffineMap(jnp.zeros((2, 5)).at[:, by].set(jnp.array([x, v])), jnp.zeros(2))


@pytest.fixture(scope="module")
def alone(log: gf.Log) -> gf.Result:
    return gf.run(FILTER, MODEL, prior(), log)


@pytest.mark.parametrize("feedback", [False, True])
@pytest.mark.parametrize("square_root", [False, True])
def test_a_network_that_says_nothing_leaves_the_filter_to_the_last_bit(
    log: gf.Log, feedback: bool, square_root: bool
) -> None:
    estimator = gf.kalman_filter(square_root=square_root)
    plain = gf.run(estimator, MODEL, prior(), log)
    silent = Corrected(zero_map(5, 2), feedback=feedback, gate=None)
    aided = gf.run(dataclasses.replace(estimator, update=silent), MODEL, prior(), log)
    assert_close(aided.mean, plain.mean, "means", tolerance=1e-15)
    assert_close(aided.cov, plain.cov, "covariances", tolerance=1e-15)


@pytest.mark.parametrize("feedback", [False, True])
def test_a_closed_gate_leaves_the_filter(log: gf.Log, alone: gf.Result, feedback: bool) -> None:
    shut = OnlineGate(least=1000)
    aided, memory = run_with(Corrected(pushing(v=0.5), feedback=feedback, gate=shut), log)
    assert_close(aided.mean, alone.mean, "means", tolerance=1e-15)
    assert_close(aided.cov, alone.cov, "covariances", tolerance=1e-15)
    assert not np.any(memory.shift)
    assert np.any(memory.offered)


def test_features_are_functions_of_the_innovation_and_the_gain(log: gf.Log, alone: gf.Result) -> None:
    _, memory = run_with(Corrected(zero_map(5, 2), gate=None), log)
    seen = log.seen[:, 0]
    features, residual = np.asarray(memory.features)[seen], alone.residual[seen]
    gain = features[:, GAINS]
    np.testing.assert_allclose(features[:, [MOVE_X, MOVE_V]], -gain * residual, atol=1e-9)
    np.testing.assert_allclose(features[:, LEFT], (1 - gain[:, 0]) * residual[:, 0], atol=1e-9)


def test_at_a_steady_gain_they_say_one_thing(generator: object) -> None:
    whole = tracks(generator("steady"), 1, 80)[0]
    _, memory = run_with(Corrected(zero_map(5, 2), gate=None), whole)
    told = np.asarray(memory.features)[:, :3]
    assert np.linalg.matrix_rank(told, tol=1e-9 * np.linalg.norm(told)) == 1


def test_open_loop_the_filter_runs_as_if_there_were_no_network(log: gf.Log, alone: gf.Result) -> None:
    aided, memory = run_with(Corrected(pushing(0.3, 0.01), gate=None), log)
    np.testing.assert_allclose(aided.residual, alone.residual, atol=1e-12)
    np.testing.assert_allclose(aided.mean, alone.mean + np.asarray(memory.shift), atol=1e-12)
    assert np.all((np.asarray(memory.shift) != 0).any(axis=1) == log.seen[:, 0])


def test_with_feedback_a_linear_correction_is_another_gain(log: gf.Log) -> None:
    # E = M (x- - x) = -M K r, so the filter has the gain (I - M) K in its mean and K in its covariance.
    push = np.array([0.05, -0.001])
    aided, _ = run_with(Corrected(pushing(*push, by=MOVE_X), feedback=True, gate=None), log)
    x, cov = np.asarray(prior().mean), np.asarray(prior().cov)
    for k in range(len(log)):
        x, cov = F @ x, F @ cov @ F.T + np.diag([1.4**2, 0.005**2])
        if log.seen[k, 0]:
            gain = cov[:, 0] / (cov[0, 0] + 0.4**2)
            x = x + (gain - push * gain[0]) * (log.y[k, 0] - x[0])
            cov = cov - np.outer(gain, cov[0])
        # Displacements reach some kilometres.
        np.testing.assert_allclose(aided.mean[k], x, rtol=1e-11)


def test_a_corrected_estimate_has_the_validated_covariance_and_every_other_the_filters(
    log: gf.Log, alone: gf.Result
) -> None:
    validated = jnp.array([[0.02, 0.003], [0.003, 0.01]])
    for square_root in (False, True):
        estimator = gf.kalman_filter(square_root=square_root)
        update = Corrected(pushing(0.3), covariance=validated, gate=None)
        aided = gf.run(dataclasses.replace(estimator, update=update), MODEL, prior(), log)
        seen = log.seen[:, 0]
        np.testing.assert_allclose(aided.cov[seen], np.broadcast_to(validated, (seen.sum(), 2, 2)), atol=1e-15)
        np.testing.assert_allclose(aided.cov[~seen], alone.cov[~seen], atol=1e-12)


def test_without_a_validated_covariance_there_is_none(log: gf.Log) -> None:
    for square_root in (False, True):
        estimator = gf.kalman_filter(square_root=square_root)
        aided = gf.run(dataclasses.replace(estimator, update=Corrected(pushing(0.3), gate=None)), MODEL, prior(), log)
        assert np.all(np.isnan(aided.cov).all(axis=(1, 2)) == log.seen[:, 0])
        assert np.isfinite(aided.mean).all()


def test_with_feedback_the_covariance_grows_between_measurements(log: gf.Log) -> None:
    validated = np.array([[0.02, 0.003], [0.003, 0.01]])
    aided, _ = run_with(Corrected(pushing(0.3), feedback=True, covariance=jnp.asarray(validated), gate=None), log)
    expected = validated
    for k in (20, 21, 22):
        expected = F @ expected @ F.T + np.diag([1.4**2, 0.005**2])
        np.testing.assert_allclose(aided.cov[k], expected, rtol=1e-12)
    np.testing.assert_allclose(aided.cov[23], validated, atol=1e-15)


def test_regions_have_variances_of_their_own(log: gf.Log) -> None:
    everywhere = jnp.array([[4.0, 1.0], [1.0, 1.0]])
    regional = AffineMap(jnp.zeros((2, 5)), jnp.array([1.0, 0.25]))
    aided, _ = run_with(Corrected(pushing(0.3), covariance=everywhere, variances=regional, gate=None), log)
    np.testing.assert_allclose(aided.cov[1], [[1.0, 0.25], [0.25, 0.25]], rtol=1e-12)


def test_only_the_chosen_components_are_corrected(log: gf.Log, alone: gf.Result) -> None:
    aided, _ = run_with(Corrected(pushing(0.3, 0.1), components=("v",), gate=None), log)
    np.testing.assert_allclose(aided["x"], alone["x"], atol=1e-12)
    assert np.abs(aided["v"] - alone["v"]).max() > 1e-3


def test_where_too_little_was_learned_there_is_no_correction(generator: object) -> None:
    rng = generator("unseen")
    # Innovations of a third of the size that they will have.
    k = steady()[1][:, 0]
    r = 0.5 * rng.normal(size=(400, 1))
    inputs = np.concatenate([-k * r, (1 - k[:1]) * r, np.ones((400, 1)) * k], axis=1)
    network, _ = CMACTraining(levels=10, layers=2)(inputs, inputs[:, :2] + 1.0, key=jax.random.key(0))
    log = tracks(rng, 1, 40)[0]
    _, memory = run_with(Corrected(network, gate=None), log)
    unseen = np.array([float(network.visits(u)) < 20 for u in memory.features])
    outside = np.array([not bool(network.contains(u)) for u in memory.features])
    assert unseen.any()
    assert (~unseen).any()
    np.testing.assert_array_equal((np.asarray(memory.shift) == 0).all(axis=1), unseen)
    np.testing.assert_array_equal(np.asarray(memory.flagged) > 0, unseen | outside)


def test_what_is_remembered_is_held_while_nothing_is_measured(log: gf.Log) -> None:
    features = InnovationHistory()
    _, memory = run_with(Corrected(zero_map(7, 2), features), log)
    for part in (memory.told, memory.features, memory.usefulness):
        for leaf in jax.tree.leaves(part):
            np.testing.assert_array_equal(leaf[20], leaf[19])
            np.testing.assert_array_equal(leaf[22], leaf[19])
            assert not np.array_equal(leaf[23], leaf[19]) or not np.any(leaf)


def test_history_is_that_of_the_whitened_innovation(log: gf.Log, alone: gf.Result) -> None:
    _, memory = run_with(Corrected(zero_map(7, 2), InnovationHistory()), log)
    slow = fast = 0.0
    for k in np.flatnonzero(log.seen[:, 0]):
        n = alone.residual[k, 0] / np.sqrt(alone.residual_cov[k, 0, 0])
        fast, slow = 0.6 * fast + 0.4 * n, 0.95 * slow + 0.05 * n**2
        told = np.asarray(memory.features)[k]
        np.testing.assert_allclose(told[[0, 1, 2, 5]], [n, np.arcsinh(n), fast, np.log(slow + 0.01)], rtol=1e-9)


def test_the_gate_asks_whether_the_next_fix_was_better_predicted(log: gf.Log, alone: gf.Result) -> None:
    _, memory = run_with(Corrected(pushing(0.3, 0.02), gate=OnlineGate(window=10.0)), log)
    offered, mean, last = np.zeros(2), 0.0, np.asarray(prior().mean)
    for k in range(len(log)):
        offered = F @ offered
        if log.seen[k, 0]:
            ahead = log.y[k, 0] - (F @ last)[0]
            gain = (ahead**2 - (ahead - offered[0]) ** 2) / alone.residual_cov[k, 0, 0]
            mean = 0.9 * mean + 0.1 * gain
            offered = np.array([0.3, 0.02]) * np.asarray(memory.features)[k, LEFT]
        np.testing.assert_allclose(memory.usefulness.mean[k], mean, atol=1e-9)
        last = alone.mean[k]
    passed, usefulness = np.asarray(memory.passed) > 0, memory.usefulness
    seen = log.seen[:, 0]
    wanted = (np.asarray(usefulness.mean) > 0) & (np.asarray(usefulness.count) >= 5)
    np.testing.assert_array_equal(passed[seen], wanted[seen])


@pytest.mark.parametrize("feedback", [False, True])
def test_a_harmful_correction_is_stopped(generator: object, alone: gf.Result, feedback: bool) -> None:
    log = tracks(generator("harm"), 1, 150)[0]
    wrong = AffineMap(jnp.zeros((2, 5)), jnp.array([0.0, 2.0]))  # m/s too fast, always
    aided, memory = run_with(Corrected(wrong, feedback=feedback), log)
    plain = gf.run(FILTER, MODEL, prior(), log)
    # In the loop it is let through now and then to be tried anew; each time costs it what it had.
    assert np.mean(np.asarray(memory.passed) > 0) < 0.05
    assert np.mean(aided.error()[:, 1] ** 2) < np.mean(plain.error()[:, 1] ** 2) + 4.0 * 0.05


def test_a_gate_that_lets_everything_pass_judges_alike_in_the_loop_and_out_of_it() -> None:
    gate, memory = OnlineGate(), OnlineGate().init()
    residual, predicted, inverse = jnp.array([1.0, -2.0]), jnp.array([0.3, 0.4]), jnp.array([[0.5, 0.0], [0.2, 2.0]])
    outside = gate.judged(memory, residual, predicted, inverse, jnp.array(0.0))
    inside = gate.judged(memory, residual - predicted, predicted, inverse, jnp.array(1.0))
    assert_close(inside.mean, outside.mean, "usefulness", tolerance=1e-15)
    squares = [float(np.sum((np.asarray(inverse) @ np.asarray(r)) ** 2)) for r in (residual, residual - predicted)]
    assert float(outside.mean) == pytest.approx((squares[0] - squares[1]) / 30, rel=1e-12)


def test_an_update_around_a_corrected_one_shows_its_estimates(log: gf.Log) -> None:
    corrected = Corrected(pushing(0.3), covariance=jnp.eye(2), gate=None)
    plain, _ = run_with(corrected, log)
    gated = gf.run(gf.kalman_filter(update=gf.Gated(corrected, probability=1.0)), MODEL, prior(), log)
    assert_identical(gated.mean, plain.mean, "means")
    assert_identical(gated.cov, plain.cov, "covariances")


def test_a_stream_is_corrected_as_a_record_is(log: gf.Log) -> None:
    estimator = dataclasses.replace(FILTER, update=Corrected(pushing(0.3, 0.02), covariance=jnp.eye(2)))
    whole = gf.run(estimator, MODEL, prior(), log)
    stream = gf.OnlineFilter(estimator, MODEL, prior(), start=0.0)
    for k in range(30):
        y = log.y[k] if log.seen[k, 0] else np.full(1, np.nan)
        told = stream.push(H * (k + 1), y)
    np.testing.assert_allclose(told.mean, whole.mean[29], rtol=1e-12)


def test_features_of_an_update_are_named() -> None:
    assert UpdateFeatures().names(MODEL) == ("move x", "move v", "left fix", "gain x by fix", "gain v by fix")
