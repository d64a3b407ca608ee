"""The square-root form is the dense form, and survives where the dense form does not."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.estimates import Affine
from gainful.linearization import Cubature, Unscented
from gainful.spaces import Euclidean

from .problems import Exact, pendulum, single

LINEARIZATIONS = {
    "taylor": (gf.Taylor(), 1e-11),
    "cubature": (gf.SigmaPoints(Cubature()), 1e-11),
    # A small alpha weighs the centre with 1 - 1 / alpha^2, and as many digits cancel in either form.
    "unscented": (gf.SigmaPoints(Unscented(alpha=0.01)), 1e-7),
}


@pytest.fixture(scope="module")
def problem(generator: object) -> tuple[Any, Any, Any]:
    return pendulum(generator("pendulum"))  # type: ignore[operator]


@pytest.mark.parametrize("name", LINEARIZATIONS)
def test_the_square_root_filter_is_the_dense_filter(name: str, problem: tuple[Any, Any, Any]) -> None:
    model, prior, log = problem
    linearization, tolerance = LINEARIZATIONS[name]
    dense, root = (
        gf.run(gf.KalmanFilter(linearization, estimate=kind), model, prior, log)
        for kind in (gf.Gaussian, gf.SquareRoot)
    )
    sigma = dense.std
    assert dense.counts() == root.counts() == {"ok": 23, "missing": 2}
    assert np.abs((root.mean - dense.mean) / sigma).max() <= tolerance
    assert np.abs((root.cov - dense.cov) / (sigma[:, :, None] * sigma[:, None, :])).max() <= tolerance
    np.testing.assert_allclose(root.log_likelihood, dense.log_likelihood, rtol=tolerance, atol=tolerance)
    np.testing.assert_allclose(root.residual_cov, dense.residual_cov, rtol=tolerance)
    if name == "cubature":
        ours, theirs = gf.smooth(root), gf.smooth(dense)
        assert np.abs((ours.mean - theirs.mean) / theirs.std).max() <= 10 * tolerance
        assert np.abs((ours.std / theirs.std) - 1.0).max() <= 10 * tolerance


@pytest.mark.parametrize("alpha", [0.1, 1e-3])
def test_a_curved_function_without_noise_keeps_the_two_forms_equal_for_any_alpha(alpha: float) -> None:
    """What the negative weight takes away is of lower rank than the state; taking it must not fail for that."""
    space = Euclidean(("a", "b", "c"))

    def bend(x: Any) -> Any:
        return jnp.stack([x[0] + 0.3 * x[0] ** 2, x[1] + 0.6 * x[0] ** 2, x[2]])

    @jax.jit
    def push() -> list[Any]:
        covs = []
        for kind in (gf.Gaussian, gf.SquareRoot):
            estimate = kind.start(jnp.array([0.1, 0.1, 0.0]), 0.01 * jnp.eye(3), space)
            covs.append(estimate.push(gf.SigmaPoints(Unscented(alpha=alpha))(bend, estimate, space)).cov)
        return covs

    pushed = push()
    # The weight's size is 1 / alpha^2 and the differences it meets are alpha^2 of the standard deviation.
    np.testing.assert_allclose(pushed[1], pushed[0], rtol=0, atol=1e-2 * 1e-15 / alpha**2 + 1e-16)


# Where squaring loses the digits --------------------------------------------------------------------------------------


@functools.cache
def _condition(kind: type) -> Any:
    def condition(P: Any, H: Any, R: Any, y: Any) -> Any:
        m, n = H.shape
        inner, outer = Euclidean(tuple("abc"[:n])), Euclidean(tuple("yz"[:m]))
        affine = Affine(
            0 * y, H, jnp.zeros(n, y.dtype), R, jnp.zeros((m, 0), y.dtype), jnp.zeros((m, 0), y.dtype), inner, outer
        )
        estimate, innovation = kind.start(affine.at, P, inner).condition(affine, y, jnp.ones(m, bool))
        return estimate.cov, innovation.positive

    return jax.jit(condition)


def _posterior(kind: type, dtype: Any, P: Any, H: Any, R: Any) -> tuple[np.ndarray, bool, np.ndarray]:
    """Posterior covariance by the library, whether it calls the innovation positive, and the exact one."""
    P, H, R = (np.asarray(matrix, dtype) for matrix in (P, H, R))
    m, n = H.shape
    cov, positive = _condition(kind)(P, H, R, np.ones(m, dtype))
    assert cov.dtype == dtype
    _, exact = Exact(np.zeros((n, 1))).condition(Exact(P), Exact(H), Exact(R), Exact(np.ones((m, 1))))
    return np.asarray(cov, float), bool(positive), exact.numbers()


def _error(cov: np.ndarray, exact: np.ndarray) -> float:
    """Largest error in units of the exact standard deviations."""
    sigma = np.sqrt(np.diag(exact))
    return float(np.abs((cov - exact) / np.outer(sigma, sigma)).max())


@pytest.mark.parametrize(
    ("dtype", "delta"), [(np.float64, 1e-8), (np.float64, 1e-10), (np.float32, 1e-3), (np.float32, 1e-4)]
)
def test_nearly_dependent_measurements_break_the_dense_form_only(dtype: Any, delta: float) -> None:
    # Grewal and Andrews (2008), Kalman Filtering, chapter 6: delta^2 < eps < delta, so that H P H^T + R rounds to a
    # singular matrix. The square root sees delta itself, to eps / delta.
    problem = np.eye(3), [[1, 1, 1], [1, 1, 1 + delta]], delta**2 * np.eye(2)
    eps = float(np.finfo(dtype).eps)
    cov, positive, exact = _posterior(gf.SquareRoot, dtype, *problem)
    assert positive
    assert _error(cov, exact) < 4 * eps / delta
    cov, positive, exact = _posterior(gf.Gaussian, dtype, *problem)
    assert not positive
    assert _error(cov, exact) > 0.1


@pytest.mark.parametrize("kind", [gf.SquareRoot, gf.Gaussian])
@pytest.mark.parametrize(("dtype", "ratio"), [(np.float64, 1e12), (np.float32, 1e6)])
def test_a_vague_prior_and_precise_measurements_keep_half_their_digits_in_both_forms(
    kind: type, dtype: Any, ratio: float
) -> None:
    # P0 / R = ratio^2 is beyond 1 / eps. A gain off by eps leaves eps^2 P0, which is (eps ratio)^2 in units of R; a root
    # off by eps sqrt(P0) leaves the same.
    eps = float(np.finfo(dtype).eps)
    for slope in (1.0, 1.1, 1.3, 1.7):
        cov, positive, exact = _posterior(kind, dtype, ratio * np.eye(2), [[1, 0], [1, slope]], np.eye(2) / ratio)
        assert positive
        assert _error(cov, exact) < 16 * (eps + (eps * ratio) ** 2)


STEP = 0.5  # s
CHAIN = np.array([[1.0, STEP, STEP**2 / 2], [0.0, 1.0, STEP], [0.0, 0.0, 1.0]])
SEEN = np.array([[1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("dtype", "spread", "dense_fails"),
    [(np.float64, 1e6, True), (np.float64, 1e5, False), (np.float32, 1e3, True), (np.float32, 1e2, False)],
)
def test_a_whole_run_from_a_vague_prior_stays_exact_as_a_square_root(
    dtype: Any, spread: float, dense_fails: bool, rng: np.random.Generator
) -> None:
    """An accelerating target seen to 1 / spread from a prior of spread, twelve rows, against fractions."""
    P0, noise = np.asarray(spread**2, dtype) * np.eye(3), np.asarray([[1 / spread**2]], dtype)
    model = gf.linear_model(CHAIN, SEEN, Q=[0.0, 0.0, 0.0], R=noise.tolist())
    truth = [np.array([1.0, -2.0, 0.5])]
    for _ in range(11):
        truth.append(CHAIN @ truth[-1])
    y = np.array([x[:1] + rng.normal(size=1) / spread for x in truth], dtype)
    prior = gf.make_prior(model, np.zeros(3), cov=P0.astype(float))
    prior = single(prior) if dtype is np.float32 else prior
    log = gf.make_log(model, STEP * np.arange(12), y.astype(float))
    root = gf.run(gf.kalman_filter(square_root=True), model, prior, log)
    dense = gf.run(gf.kalman_filter(), model, prior, log, throw=False)
    assert root.cov.dtype == dense.cov.dtype == dtype

    mean, cov = Exact(np.zeros((3, 1))), Exact(P0)
    F, H, R = Exact(CHAIN), Exact(SEEN), Exact(noise)
    worst = {"root": 0.0, "dense": 0.0, "mean": 0.0}
    for k in range(12):
        if k:
            mean, cov = F @ mean, F @ cov @ F.T
        mean, cov = mean.condition(cov, H, R, Exact(y[k][:, None]))
        exact = cov.numbers()
        worst["root"] = max(worst["root"], _error(root.cov[k].astype(float), exact))
        worst["dense"] = max(worst["dense"], _error(dense.cov[k].astype(float), exact))
        off = np.abs(root.mean[k].astype(float) - mean.numbers()[:, 0]) / np.sqrt(np.diag(exact))
        worst["mean"] = max(worst["mean"], float(off.max()))
    # Roots span spread^2, and lose no more than that; covariances span spread^4.
    limit = float(np.finfo(dtype).eps) * spread**2
    assert worst["root"] < 2 * limit
    assert worst["mean"] < 2 * limit
    assert worst["dense"] > 50 * worst["root"]
    assert ("not_positive" in dense.counts()) == dense_fails
