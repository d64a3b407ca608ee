"""What is known of noise laws and updates that learn the noise: formulas, what may teach them, and when they give up."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import adaptations
from gainful.filters import AbstractEstimator
from gainful.updates.variational_covariances import completed

STEP = 10.0  # s
F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q, R = np.diag([0.5**2, 0.05**2]), 2.0
ROWS = 150
MEAN, P0 = np.array([0.0, 5.0]), np.diag([100.0, 100.0])


def track(Q: np.ndarray = Q, R: float = R) -> gf.models.AbstractModel:
    """A ship with position fixes."""
    return gf.linear_model(F, H, Q=Q, R=R, states={"s": "m", "v": "m/s"}, outputs={"y": "m"})


@pytest.fixture(scope="module")
def fixes() -> np.ndarray:
    rng = np.random.default_rng(3)
    x, out = MEAN.copy(), []
    for _ in range(ROWS):
        x = F @ x + np.sqrt(np.diag(Q)) * rng.normal(size=2)
        out.append(x[0] + np.sqrt(R) * rng.normal())
    return np.array(out)


def filtered(estimator: AbstractEstimator, y: np.ndarray, model: gf.models.AbstractModel | None = None) -> gf.Result:
    model = track() if model is None else model
    log = gf.make_log(model, STEP * np.arange(1.0, len(y) + 1.0), y, start=0.0)
    return gf.run(estimator, model, gf.make_prior(model, MEAN, cov=P0), log)


def _members(count: int) -> AbstractEstimator:
    stay = 0.97
    table = np.full((count, count), (1 - stay) / (count - 1)) + (stay - (1 - stay) / (count - 1)) * np.eye(count)
    return gf.InteractingMultipleModel((gf.kalman_filter(),) * count, tuple(map(tuple, table.tolist())))


REDUCED = {
    "Sage-Husa between equal bounds": gf.KalmanFilter(noise=gf.SageHusa(floor=1.0, ceiling=1.0, patience=ROWS)),
    "a window longer than the record": gf.KalmanFilter(noise=gf.InnovationMatching(window=ROWS)),
    "R known for sure": gf.kalman_filter(update=gf.VariationalNoise(memory=1.0, start=1e12)),
    "P and R known for sure": gf.kalman_filter(
        update=gf.VariationalCovariances(prediction=1e12, memory=1.0, start=1e12)
    ),
    "no fading": gf.kalman_filter(update=gf.StrongTracking(cap=1.0)),
    "no threshold": gf.kalman_filter(update=gf.MasreliezMartin(threshold=1e9)),
    "models that are equal": _members(3),
}


@pytest.mark.parametrize("name", REDUCED)
def test_every_adaptive_filter_is_the_kalman_filter_in_its_limit(name: str, fixes: np.ndarray) -> None:
    plain, reduced = filtered(gf.kalman_filter(), fixes), filtered(REDUCED[name], fixes)
    # A confidence of 1e12 measurements leaves the squares of the start, some 1e4 R, at 1e-8 of R.
    np.testing.assert_allclose(reduced.mean, plain.mean, rtol=2e-6, atol=2e-6)


def sage_husa_by_hand(y: np.ndarray, forgetting: float, floor: float) -> tuple[np.ndarray, np.ndarray]:
    """Estimates and R in each step, R learned after the update."""
    x, P, r, estimates, noises = MEAN.copy(), P0.copy(), R, [], []
    for n, reading in enumerate(y, start=1):
        x, P = F @ x, F @ P @ F.T + Q
        S = P[0, 0] + r
        gain, nu = P[:, 0] / S, reading - x[0]
        d = (1 - forgetting) / (1 - forgetting ** (n + 1))
        used, r = r, max((1 - d) * r + d * (nu**2 - P[0, 0]), floor)
        x, P = x + gain * nu, (np.eye(2) - np.outer(gain, H)) @ P
        estimates.append(x)
        noises.append(used)
    return np.array(estimates), np.array(noises)


def test_sage_husa_is_the_published_recursion(fixes: np.ndarray) -> None:
    law = gf.SageHusa(memory=0.98, floor=0.01, ceiling=1e9)
    result = filtered(gf.KalmanFilter(noise=law), fixes)
    expected, noises = sage_husa_by_hand(fixes, 0.98, 0.01 * R)
    # Joseph form and textbook form differ by rounding of P0 over R, accumulated over the record.
    np.testing.assert_allclose(result.mean, expected, rtol=1e-9, atol=1e-9)
    factors = np.asarray(result.memories[1].factors.used)[:, 0]
    np.testing.assert_allclose(factors[:-1], noises[1:] / R, rtol=1e-9)


def variational_by_hand(y: np.ndarray, memory: float, start: float, turns: int) -> tuple[np.ndarray, np.ndarray]:
    """Sarkka and Nummenmaa's filter for one sensor: estimates, and R after each measurement."""
    x, P, alpha, beta, estimates, noises = MEAN.copy(), P0.copy(), start, start * R, [], []
    for reading in y:
        x, P = F @ x, F @ P @ F.T + Q
        alpha, past = memory * alpha + 0.5, memory * beta
        beta = past
        for _ in range(turns):
            S = P[0, 0] + beta / alpha
            gain = P[:, 0] / S
            new, cov = x + gain * (reading - x[0]), (np.eye(2) - np.outer(gain, H)) @ P
            beta = past + 0.5 * ((reading - new[0]) ** 2 + cov[0, 0])
        x, P = new, cov
        estimates.append(x)
        noises.append(beta / alpha)
    return np.array(estimates), np.array(noises)


def test_the_variational_filter_of_the_noise_is_the_published_recursion(fixes: np.ndarray) -> None:
    update = gf.VariationalNoise(memory=0.97, start=5.0, floor=1e-9, ceiling=1e9)
    result = filtered(gf.kalman_filter(update=update), fixes)
    expected, noises = variational_by_hand(fixes, 0.97, 5.0, 5)
    np.testing.assert_allclose(result.mean, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.asarray(result.memories[0].factors.value)[:, 0], noises / R, rtol=1e-9)


def wishart_by_hand(y: np.ndarray, tau: float, memory: float, start: float, turns: int) -> np.ndarray:
    """Huang's filter for one sensor."""
    x, P, u, U, estimates = MEAN.copy(), P0.copy(), start + 2.0, start * R, []
    for reading in y:
        x, P = F @ x, F @ P @ F.T + Q
        u, U = memory * (u - 2.0) + 2.0, memory * U
        now, cov = x, P
        for _ in range(turns):
            wide = (cov + np.outer(now - x, now - x) + tau * P) / (tau + 1)
            total = (reading - now[0]) ** 2 + cov[0, 0] + U
            S = wide[0, 0] + total / (u + 1 - 2.0)
            gain = wide[:, 0] / S
            now, cov = x + gain * (reading - x[0]), (np.eye(2) - np.outer(gain, H)) @ wide
        x, P, u, U = now, cov, u + 1, total
        estimates.append(x)
    return np.array(estimates)


def test_the_variational_filter_of_both_covariances_is_the_published_recursion(fixes: np.ndarray) -> None:
    update = gf.VariationalCovariances(floor=1e-9, ceiling=1e9)
    result = filtered(gf.kalman_filter(update=update), fixes)
    np.testing.assert_allclose(result.mean, wishart_by_hand(fixes, 3.0, 0.99, 3.0, 8), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "estimator",
    [
        gf.KalmanFilter(noise=gf.SageHusa(memory=1.0)),
        gf.KalmanFilter(noise=gf.InnovationMatching(window=300)),
        gf.kalman_filter(update=gf.VariationalNoise(memory=1.0)),
    ],
    ids=["sage_husa", "innovation_matching", "variational_noise"],
)
def test_a_wrong_variance_of_each_sensor_is_found(estimator: gf.KalmanFilter, rng: np.random.Generator) -> None:
    true, told = np.array([4.0, 0.25]), np.array([1.0, 1.0])
    rows = 600
    x = np.cumsum(0.1 * rng.normal(size=rows))
    y = x[:, None] + np.sqrt(true) * rng.normal(size=(rows, 2))
    y[::7, 1] = np.nan
    model = gf.linear_model([[1.0]], [[1.0], [1.0]], Q=0.01, R=told)
    result = gf.run(estimator, model, gf.make_prior(model, [0.0], [1.0]), gf.make_log(model, np.arange(rows), y))
    found = np.array([each.factor for each in adaptations(result)])
    # A variance from 300 squares has a standard deviation of 8 %; five of them, and some bias of the variational mean.
    np.testing.assert_allclose(found, true, rtol=0.45)


def test_what_the_update_rejects_or_weighs_down_teaches_no_noise(fixes: np.ndarray, rng: np.random.Generator) -> None:
    wild = fixes.copy()
    wild[20::10] += 40.0 * rng.choice([-1.0, 1.0], size=len(wild[20::10]))
    law = gf.SageHusa(memory=1.0)
    learned = {}
    for name, update in (("exact", gf.Exact()), ("gated", gf.Gated()), ("robust", gf.MasreliezMartin())):
        learned[name] = adaptations(filtered(gf.KalmanFilter(update=update, noise=law), wild))[0].factor
    clean = adaptations(filtered(gf.KalmanFilter(noise=law), fixes))[0].factor
    assert learned["exact"] > 20 * clean
    assert learned["gated"] < 1.5 * clean
    assert learned["robust"] < 0.2 * learned["exact"]


@pytest.mark.parametrize(
    "estimator",
    [
        gf.KalmanFilter(noise=gf.SageHusa(memory=0.9)),
        gf.KalmanFilter(noise=gf.InnovationMatching()),
        gf.kalman_filter(update=gf.VariationalNoise()),
    ],
    ids=["sage_husa", "innovation_matching", "variational_noise"],
)
def test_a_prediction_that_is_wrong_is_not_taken_for_noise_for_ever(estimator: gf.KalmanFilter) -> None:
    # A turn at constant speed that the model, sure of its speed, cannot follow.
    y = 300.0 * np.sin(STEP * np.arange(1.0, 401.0) / 300.0)
    model = track(Q=np.diag([1e-4, 1e-10]), R=0.01)
    result = filtered(estimator, y, model)
    (found,) = adaptations(result)
    assert found.lost_at is not None
    assert found.factor == 1.0
    assert found.warning == f"R of y was given up at t = {found.lost_at:.6g} s: it grew 100 times, so Q is too small"
    assert found.warning in str(gf.verdict(result))


def test_a_filter_that_learns_no_noise_has_no_adaptations(fixes: np.ndarray) -> None:
    assert adaptations(filtered(gf.kalman_filter(), fixes)) == ()


def test_missing_components_are_completed_by_what_is_expected_of_them(rng: np.random.Generator) -> None:
    root = rng.normal(size=(3, 3))
    noise = root @ root.T + 0.1 * np.eye(3)
    residual = np.array([1.0, -2.0, 0.0])
    seen = np.array([True, True, False])
    square = np.asarray(completed(jnp.outer(residual, residual), jnp.asarray(noise), jnp.asarray(seen)))
    mean = noise[2, :2] @ np.linalg.solve(noise[:2, :2], residual[:2])
    rest = noise[2, 2] - noise[2, :2] @ np.linalg.solve(noise[:2, :2], noise[:2, 2])
    full = np.array([1.0, -2.0, mean])
    expected = np.outer(full, full) + np.diag([0.0, 0.0, rest])
    np.testing.assert_allclose(square, expected, rtol=1e-9, atol=1e-9)


def test_the_smoother_goes_with_covariances_that_were_inferred(fixes: np.ndarray) -> None:
    for square_root in (False, True):
        update = gf.VariationalCovariances()
        result = filtered(gf.kalman_filter(update=update, square_root=square_root), fixes)
        smoothed = gf.smooth(result)
        assert (np.linalg.eigvalsh(smoothed.cov) > 0).all()
        assert (smoothed.std[10:-10, 1] < result.std[10:-10, 1]).all()


def test_noise_laws_have_derivatives_in_their_memory(fixes: np.ndarray) -> None:
    model = track()
    prior = gf.make_prior(model, MEAN, cov=P0)
    samples = gf.samples_of(gf.make_log(model, STEP * np.arange(1.0, 31.0), fixes[:30], start=0.0), float)

    @jax.jit
    def value(memory: jax.Array) -> jax.Array:
        estimator = eqx.tree_at(lambda part: part.noise.memory, gf.KalmanFilter(noise=gf.SageHusa()), memory)
        return gf.log_likelihood(estimator, model, prior, samples)

    at, small = jnp.array(0.9), 1e-5
    difference = (value(at + small) - value(at - small)) / (2 * small)
    # Central differences: rounding 1e-16 * 100 / 1e-5 and curvature.
    np.testing.assert_allclose(jax.jit(jax.grad(value))(at), difference, rtol=1e-5)
