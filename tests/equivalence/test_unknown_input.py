"""A disturbance of which nothing is known is a fault whose walk is large; biases may be split off in stages."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.estimates import TwoStage
from gainful.faults import actuator_offset, extend_prior, sensor_bias, with_faults
from gainful.spaces import Euclidean

from .test_two_stage import affine_map, joint_space, random_covariance

F = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.3], [0.0, 0.1, 0.95]])
E = np.array([[0.5, 0.0], [0.1, 0.4], [0.3, -0.2]])
H = np.array([[1.0, 0.2, 0.0], [0.0, 1.0, 0.4], [0.1, 0.0, 1.0]])
Q, R = np.diag([0.02, 0.03, 0.01]), np.diag([0.04, 0.05, 0.06])
MEAN, COV = np.array([0.3, -0.2, 0.1]), np.diag([0.5, 0.4, 0.3])
ROWS, RHO = 40, 1e8


def robust_two_stage(ys):
    """Hsieh's filter, which assumes nothing about the input `d` of `x <- F x + E d + w`; the first row is not predicted.

    The inputs are those that acted before each row, found at that row.
    """
    x, P, states, covs, inputs, input_covs = MEAN, COV, [], [], [], []
    for k, y in enumerate(ys):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        P, residual = (np.eye(3) - K @ H) @ P @ (np.eye(3) - K @ H).T + K @ R @ K.T, y - H @ x
        x = x + K @ residual
        if k:
            G = H @ E
            input_cov = np.linalg.inv(G.T @ np.linalg.inv(S) @ G)
            d = input_cov @ G.T @ np.linalg.inv(S) @ residual
            V = E - K @ G
            x, P = x + V @ d, P + V @ input_cov @ V.T
            inputs.append(d)
            input_covs.append(input_cov)
        states.append(x)
        covs.append(P)
    return tuple(np.array(each) for each in (states, covs, inputs, input_covs))


@pytest.fixture(scope="module")
def readings(generator):
    """Of a plant driven by steps, waves and noise that no filter is told of."""
    rng, x, ys, ds = generator("unknown input"), MEAN.copy(), [], []
    for k in range(ROWS):
        if k:
            d = np.array([3.0 * (k > 15), np.sin(k)]) + rng.normal(size=2)
            ds.append(d)
            x = F @ x + E @ d + np.sqrt(np.diag(Q)) * rng.normal(size=3)
        ys.append(H @ x + np.sqrt(np.diag(R)) * rng.normal(size=3))
    return np.array(ys), np.array(ds)


def plant(noise):
    return gf.linear_model(F, H, Q=noise, R=R, B=E, states=3, inputs=["left", "right"])


def test_process_noise_without_end_along_the_disturbance_is_the_filter_that_knows_nothing_of_it(readings):
    states, covs, _, _ = robust_two_stage(readings[0])
    model = plant(Q + RHO * E @ E.T)
    log = gf.make_log(model, np.arange(ROWS), readings[0], np.zeros((ROWS, 2)))
    result = gf.run(gf.kalman_filter(), model, gf.make_prior(model, MEAN, cov=COV), log)
    # What is left falls with 1 / RHO, until rounding.
    np.testing.assert_allclose(result.mean, states, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.cov, covs, rtol=0, atol=1e-6)


@pytest.mark.parametrize("estimator", [gf.two_stage_kalman_filter(), gf.kalman_filter(square_root=True)])
def test_offsets_with_a_large_walk_are_it_too_and_a_lag_of_one_row_finds_the_disturbance(estimator, readings):
    states, covs, inputs, input_covs = robust_two_stage(readings[0])
    model = with_faults(plant(Q), [actuator_offset(u, sigma=1e4, walk=1e4, per_step=True) for u in ("left", "right")])
    prior = extend_prior(model, gf.make_prior(plant(Q), MEAN, cov=COV))
    log = gf.make_log(model, np.arange(ROWS), readings[0], np.zeros((ROWS, 2)))
    result = gf.run(estimator, model, prior, log)
    np.testing.assert_allclose(result.mean[:, :3], states, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.cov[:, :3, :3], covs, rtol=0, atol=1e-6)
    # An offset acts on the interval after its row, so the next row is the first to tell.
    late = gf.smooth(result, lag=1.0)
    np.testing.assert_allclose(late.mean[:-1, 3:], inputs, rtol=0, atol=1e-6)
    np.testing.assert_allclose(late.cov[:-1, 3:, 3:], input_covs, rtol=0, atol=1e-6)
    # The state of a row that has a next one knows more than the robust filter's, which never looks back.
    assert (np.trace(late.cov[1:-1, :3, :3], axis1=1, axis2=2) < np.trace(covs[1:-1], axis1=1, axis2=2)).all()


def test_what_is_found_of_the_disturbance_is_unbiased_with_the_sigma_it_claims(readings):
    _, _, inputs, input_covs = robust_two_stage(readings[0])
    off = (inputs - readings[1]) / np.sqrt(np.diagonal(input_covs, axis1=1, axis2=2))
    # 78 nearly independent unit errors: three sigmas of their mean and of their mean square.
    assert abs(off.mean()) < 3 / np.sqrt(off.size)
    assert abs((off**2).mean() - 1) < 3 * np.sqrt(2 / off.size)


def test_where_the_biases_are_split_off_does_not_matter(generator):
    """One bias apart from the state and the two others, two, or all three."""
    rng = generator("stages")
    start, cov = jnp.asarray(rng.normal(size=5)), jnp.asarray(random_covariance(rng, 5))
    matrix, noise = rng.normal(size=(5, 5)), random_covariance(rng, 5)
    sense, sensed = rng.normal(size=(2, 5)), random_covariance(rng, 2)

    @eqx.filter_jit
    def five_steps(estimate, moving, reading):
        for _ in range(5):
            estimate = estimate.push(moving)
            estimate, innovation = estimate.condition(reading, jnp.array([0.3, -0.1]), jnp.ones(2, bool))
        return estimate, innovation.cov

    found = []
    for added in (1, 2, 3):
        space = joint_space(5 - added, added)
        moving = affine_map(generator("moving"), matrix, noise, space, space)
        reading = affine_map(generator("reading"), sense, sensed, space, Euclidean(("u", "v")))
        estimate, spread = five_steps(TwoStage.start(start, cov, space), moving, reading)
        assert estimate.bias_cov.shape == (added, added)
        found.append((estimate.mean, estimate.cov, spread))
    for other in found[1:]:
        for one, same in zip(found[0], other, strict=True):
            np.testing.assert_allclose(one, same, rtol=1e-9, atol=1e-11)


def test_two_blocks_of_biases_one_filtered_around_the_other_are_the_joint_filter():
    """The inner stage is a filter of its own: state and actuator offsets jointly, sensor biases apart."""
    inner = with_faults(plant(Q), [actuator_offset("left", sigma=0.5, walk=0.1)])
    outer = with_faults(inner, [sensor_bias("y0", sigma=0.3, walk=0.05)])
    both = with_faults(
        plant(Q), [actuator_offset("left", sigma=0.5, walk=0.1), sensor_bias("y0", sigma=0.3, walk=0.05)]
    )
    assert outer.space.names == both.space.names
    start = gf.make_prior(plant(Q), MEAN, cov=COV)
    results = []
    for model, prior in ((outer, extend_prior(outer, extend_prior(inner, start))), (both, extend_prior(both, start))):
        t = np.arange(float(ROWS))
        u = np.stack([np.sin(t), np.cos(t)], axis=1)
        log = gf.draw_log(both, extend_prior(both, start), t, u, key=jax.random.key(5))
        results.append(gf.run(gf.two_stage_kalman_filter(), model, prior, log))
    np.testing.assert_allclose(results[0].mean, results[1].mean, rtol=0, atol=1e-12)
    np.testing.assert_allclose(results[0].cov, results[1].cov, rtol=0, atol=1e-12)
