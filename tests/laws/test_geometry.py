"""Filters do not care where zero is on a circle, nor which axes a rotation is written in."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.linearization import Cubature, GaussHermite
from gainful.models import Sample
from gainful.models.model import Model
from gainful.spaces import quaternion_conjugate, quaternion_exp, quaternion_multiply, rotate
from gainful.testing.comparisons import assert_covariance

ESTIMATORS = {
    "taylor": gf.KalmanFilter(),
    "unscented-root": gf.unscented_kalman_filter(square_root=True),
    "cubature-iterated": gf.KalmanFilter(gf.SigmaPoints(Cubature()), gf.Iterated(iterations=2)),
    "hermite": gf.KalmanFilter(gf.SigmaPoints(GaussHermite(3))),
}


@eqx.filter_jit
def filtered(estimator: gf.KalmanFilter, model: Model, prior: gf.Gaussian, samples: Sample) -> tuple[Any, ...]:
    _, infos = gf.scan(estimator, model, prior, samples)
    covs = jax.vmap(lambda estimate: estimate.cov)(infos.estimate)
    return infos.estimate.mean, covs, infos.log_likelihood, infos.status


# One angle ------------------------------------------------------------------------------------------------------------


def _swing(x: jax.Array, u: jax.Array, t: jax.Array, dt: jax.Array) -> jax.Array:
    return jnp.stack([x[0] + dt * (x[1] + 0.1 * x[1] ** 2), 0.95 * x[1]])


def _compass(x: jax.Array) -> jax.Array:
    return x[:1] + 0.2 * jnp.sin(x[1:])


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_heading_that_crosses_the_cut_is_filtered_like_one_that_does_not(name: str) -> None:
    states = {"heading": "angle", "rate": "rad/s"}
    model = gf.discrete_model(_swing, _compass, states=states, outputs={"y": "angle"}, Q=[0.001, 0.01], R=0.02)
    rng = np.random.default_rng(8)
    t = np.arange(14) * 0.3
    # From -1 to +1 rad along the way; shifted by pi it crosses the cut both in state and in measurement.
    y = np.linspace(-1.0, 1.0, 14) + rng.normal(scale=0.1, size=14)
    y[5] = np.nan
    results = []
    for shift in (0.0, np.pi, 2.7, -20.0):
        prior = gf.make_prior(model, [-1.0 + shift, 0.4], [0.3, 0.2])
        log = gf.make_log(model, t, y + shift)
        results.append((shift, *map(np.asarray, filtered(ESTIMATORS[name], model, prior, gf.samples_of(log, float)))))
    _, mean, cov, density, _ = results[0]
    wrapped = np.abs(results[1][1][:, 0]).max()
    assert 3.0 < wrapped <= np.pi + 1e-15  # it did come close to the cut, from both sides
    assert len(set(np.sign(results[1][1][:, 0]))) == 2
    for shift, other, other_cov, other_density, _ in results[1:]:
        # The shifted angles carry the rounding of 20 rad, a few eps times 20, over 14 steps.
        away = np.angle(np.exp(1j * (other[:, 0] - mean[:, 0] - shift)))
        np.testing.assert_allclose(away, 0.0, atol=1e-12)
        np.testing.assert_allclose(other[:, 1], mean[:, 1], atol=1e-12)
        np.testing.assert_allclose(other_cov, cov, rtol=1e-10)
        np.testing.assert_allclose(other_density, density, atol=1e-11)


# The plane ------------------------------------------------------------------------------------------------------------


def _drive(x: jax.Array, u: jax.Array, t: jax.Array, dt: jax.Array) -> jax.Array:
    return x + dt * jnp.stack([u[0] * jnp.cos(x[2]), u[0] * jnp.sin(x[2]), u[1]])


def test_a_plane_turned_turns_the_estimate() -> None:
    states, gps = (
        {"x": "m", "y": "m", "heading": "angle"},
        gf.sensor("gps", lambda x: x[:2], outputs=["px", "py"], R=0.2),
    )
    compass = gf.sensor("compass", lambda x: x[2:], outputs={"psi": "angle"}, R=0.05)
    noise = [0.02, 0.02, 0.01]
    model = gf.discrete_model(_drive, states=states, inputs=["speed", "turn"], Q=noise, sensors=[gps, compass])
    rng = np.random.default_rng(2)
    t, u = np.arange(12) * 0.5, np.column_stack([np.full(12, 2.0), np.full(12, 0.4)])
    y = np.column_stack(
        [rng.normal(size=(12, 2)) + np.arange(12)[:, None], 0.2 * np.arange(12) + rng.normal(scale=0.2, size=12)]
    )
    y[4, 1], y[7] = np.nan, np.nan
    y[4, 0] = np.nan  # a position is turned as a whole
    cov = np.array([[1.0, 0.2, 0.1], [0.2, 0.5, 0.0], [0.1, 0.0, 0.3]])
    results = []
    for angle in (0.0, 2.5):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        prior = gf.make_prior(model, turn @ [1.0, -1.0, 0.3] + [0, 0, angle], cov=turn @ cov @ turn.T)
        log = gf.make_log(model, t, y @ turn.T + [0, 0, angle], u)
        results.append((turn, *map(np.asarray, filtered(gf.KalmanFilter(), model, prior, gf.samples_of(log, float)))))
    (_, mean, covs, density, _), (turn, other, other_covs, other_density, _) = results
    np.testing.assert_allclose(other[:, :2], mean[:, :2] @ turn[:2, :2].T, atol=1e-12)
    np.testing.assert_allclose(np.angle(np.exp(1j * (other[:, 2] - mean[:, 2] - 2.5))), 0.0, atol=1e-12)
    np.testing.assert_allclose(other_covs, turn @ covs @ turn.T, atol=1e-12)
    np.testing.assert_allclose(other_density, density, atol=1e-11)


# Attitude -------------------------------------------------------------------------------------------------------------


def _gyro(x: jax.Array, u: jax.Array, t: jax.Array, dt: jax.Array) -> jax.Array:
    return jnp.concatenate([quaternion_multiply(x[:4], quaternion_exp(dt * (u - x[4:]))), x[4:]])


def _tracker(x: jax.Array) -> jax.Array:
    return x[:4]


def _direction(x: jax.Array, u: jax.Array, t: jax.Array, p: dict[str, jax.Array]) -> jax.Array:
    return rotate(quaternion_conjugate(x[:4]), p["star"])


def attitude_model(star: np.ndarray) -> Model:
    states = {"q": "quaternion", "bx": "rad/s", "by": "rad/s", "bz": "rad/s"}
    tracker = gf.sensor("tracker", _tracker, outputs={"m": "quaternion"}, R=1e-3)
    camera = gf.sensor("camera", _direction, outputs=["dx", "dy", "dz"], R=1e-3)
    noise = [4e-5] * 3 + [4e-7] * 3
    inputs = ["wx", "wy", "wz"]
    return gf.discrete_model(
        _gyro, states=states, inputs=inputs, Q=noise, sensors=[tracker, camera], parameters={"star": star}
    )


@pytest.mark.parametrize("name", ["taylor", "unscented-root"])
def test_an_attitude_filter_does_not_depend_on_the_reference_axes_nor_on_the_sign_of_a_quaternion(name: str) -> None:
    rng = np.random.default_rng(5)
    t, rows = np.arange(8) * 0.4, 8
    rates = np.tile([0.3, -0.5, 0.8], (rows, 1))
    star = np.array([0.6, 0.0, 0.8])
    truth, body = [np.array([0.0, 0.0, 0.0, 1.0])], []
    for k in range(rows):
        if k:
            truth.append(np.asarray(quaternion_multiply(truth[-1], quaternion_exp(jnp.asarray(rates[k] * 0.4)))))
        body.append(np.asarray(rotate(quaternion_conjugate(jnp.asarray(truth[k])), jnp.asarray(star))))
    measured = [
        np.asarray(quaternion_multiply(q, quaternion_exp(jnp.asarray(rng.normal(scale=0.03, size=3))))) for q in truth
    ]
    directions = np.array(body) + rng.normal(scale=0.03, size=(rows, 3))
    std = [0.4] * 3 + [0.05] * 3
    change = np.asarray(quaternion_exp(jnp.array([1.2, -2.0, 0.7])))
    results = []
    for g, signs in ((np.array([0.0, 0.0, 0.0, 1.0]), np.ones(rows)), (change, (-1.0) ** np.arange(rows))):
        turned = np.array([np.asarray(quaternion_multiply(g, q)) for q in measured]) * signs[:, None]
        turned[3] = np.nan
        model = attitude_model(np.asarray(rotate(jnp.asarray(g), jnp.asarray(star))))
        start = np.asarray(quaternion_multiply(g, quaternion_exp(jnp.array([0.2, 0.1, -0.3]))))
        prior = gf.make_prior(model, [*start, 0.0, 0.0, 0.0], std)
        log = gf.make_log(model, t, np.hstack([turned, directions]), rates)
        results.append((g, *map(np.asarray, filtered(ESTIMATORS[name], model, prior, gf.samples_of(log, float)))))
    (_, mean, covs, density, _), (g, other, other_covs, other_density, _) = results
    expected = np.array([np.asarray(quaternion_multiply(g, q)) for q in mean[:, :4]])
    same = np.sign(np.sum(expected * other[:, :4], axis=1, keepdims=True))
    np.testing.assert_allclose(other[:, :4] * same, expected, atol=1e-12)
    np.testing.assert_allclose(other[:, 4:], mean[:, 4:], atol=1e-12)
    np.testing.assert_allclose(other_covs, covs, atol=1e-12)
    np.testing.assert_allclose(other_density, density, atol=1e-9)
    # And it is a filter: the attitude ends within a few sigma of the truth.
    off = np.asarray(model.space.minus(jnp.asarray(mean[-1]), jnp.asarray(np.append(truth[-1], np.zeros(3)))))
    assert off @ np.linalg.solve(covs[-1], off) < 30.0  # chi-square of 6 degrees: 22.5 at 0.999


# Bounds ---------------------------------------------------------------------------------------------------------------


def test_a_bounded_state_stays_inside_whatever_is_measured() -> None:
    states = {"gain": (0.0, 1.0), "mass": (0.0, None)}
    model = gf.discrete_model(lambda x: x, lambda x: x, states=states, outputs=["g", "m"], Q=0.1, R=[1e-4, 1e-4])
    rng = np.random.default_rng(1)
    wild = rng.normal(size=(30, 2)) * 10.0 ** rng.uniform(-2, 2, size=(30, 2))
    prior = gf.make_prior(model, [0.5, 1.0], [0.3, 0.5])
    samples = gf.samples_of(gf.make_log(model, np.arange(30.0), wild), float)
    means, covs, _, status = filtered(gf.KalmanFilter(), model, prior, samples)
    assert np.all(np.asarray(status) == 0)
    assert np.all((np.asarray(means) > 0) & (np.asarray(means)[:, :1] < 1))
    for cov in np.asarray(covs):
        assert_covariance(cov, "covariance")
