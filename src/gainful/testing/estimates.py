"""The laws of an estimate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..estimates import AbstractEstimate, Affine
from ..spaces import Circle, Euclidean, Product
from .comparisons import assert_close, assert_covariance, assert_true

_SEEDED = 20240229


def check_estimate(cls: type[AbstractEstimate], *, tolerance: float = 1e-10) -> None:
    """Raise unless an estimate does the one linear-Gaussian algebra.

    Each operation is compared with its textbook formula in NumPy, where any component may be unseen, the map carries
    noise, error columns and a deficit, a state is known exactly, and angles wrap.

    ```
    push       A P A^T + N          condition  K = P A^T S^-1 over the seen rows, P - K S K^T
    revise     G = P A^T S^-1, P + G (P_s - S) G^T        any gain: (I - K A) P (I - K A)^T + K N K^T
    ```

    Args:
        cls: the class of estimate, such as `Gaussian`.
        tolerance: rounding allowed, in standard deviations.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.estimates import SquareRoot
        >>> check_estimate(SquareRoot)
    """
    operate: Callable[..., dict[str, Any]] = jax.jit(lambda *given: _operate(cls, *given))
    rng = np.random.default_rng(_SEEDED)
    for known in (False, True):
        problem = _problem(rng, known)
        for seen in ([True, True], [True, False], [False, False]):
            mask = np.array(seen)
            label = f"{cls.__name__} with {mask.sum()} of 2 seen" + (", one state known" if known else "")
            found = operate(problem, jnp.asarray(mask))
            _compare(found, _textbook(problem, mask), label, tolerance)


def _spaces() -> tuple[Product, Product]:
    return Product([Euclidean(("a", "b")), Circle("c")]), Product([Euclidean(("y",)), Circle("z")])


def _problem(rng: np.random.Generator, known: bool) -> dict[str, np.ndarray]:
    root = rng.normal(size=(3, 3)) * np.array([[2.0], [0.5], [0.1]])
    if known:
        root[1] = 0.0
    noise, future, extra = rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), rng.normal(size=(3, 1))
    return {
        "mean": np.array([1.0, -2.0, 3.1]),
        "cov": root @ root.T,
        "matrix": rng.normal(size=(2, 3)) * np.array([[1.0], [0.3]]),
        "value": np.array([0.5, -3.1]),
        "at": np.array([1.1, -2.1, -3.1]),
        "noise": noise @ noise.T * 0.1,
        "error": 0.1 * rng.normal(size=(2, 3)),
        "deficit": 0.02 * rng.normal(size=(2, 1)),
        "y": np.array([1.0, 3.0]),
        "gain": 0.3 * rng.normal(size=(3, 2)),
        "future_mean": np.array([0.2, 3.0]),
        "future_cov": 0.05 * future @ future.T,
        "extra": extra @ extra.T,
    }


def _operate(cls: type[AbstractEstimate], p: dict[str, Any], seen: Any) -> dict[str, Any]:
    inner, outer = _spaces()
    p = {name: jnp.asarray(value) for name, value in p.items()}
    affine = Affine(p["value"], p["matrix"], p["at"], p["noise"], p["error"], p["deficit"], inner, outer)
    estimate = cls.start(p["mean"], p["cov"], inner)
    posterior, innovation = estimate.condition(affine.masked(seen), p["y"], seen)
    chosen, _ = estimate.condition(affine.masked(seen), p["y"], seen, gain=p["gain"])
    future = cls.start(p["future_mean"], p["future_cov"], outer)
    results = {
        "start": estimate,
        "push": estimate.push(affine),
        "condition": posterior,
        "condition with a gain": chosen,
        "plus_noise": estimate.plus_noise(p["extra"]),
        "revise": estimate.revise(affine, future),
    }
    out: dict[str, Any] = {name: (each.mean, each.cov, each.factor) for name, each in results.items()}
    out["innovation"] = (innovation.residual, innovation.cov, innovation.nis, innovation.log_likelihood)
    return out


def _textbook(p: dict[str, np.ndarray], seen: np.ndarray) -> dict[str, Any]:
    A, P = p["matrix"], p["cov"]
    N = p["noise"] + p["error"] @ p["error"].T - p["deficit"] @ p["deficit"].T
    S = A @ P @ A.T + N
    expected = _wrap(p["value"] + A @ _wrap(p["mean"] - p["at"]))
    rows = np.flatnonzero(seen)
    H, Sr = A[rows], S[np.ix_(rows, rows)]
    residual = np.where(seen, _wrap(p["y"] - expected), 0.0)
    K = np.linalg.solve(Sr, H @ P).T if len(rows) else np.zeros((3, 0))
    nis = residual[rows] @ np.linalg.solve(Sr, residual[rows]) if len(rows) else 0.0
    log_density = -0.5 * (nis + np.linalg.slogdet(2 * np.pi * Sr)[1]) if len(rows) else 0.0
    both = np.outer(seen, seen)
    masked, noise = np.where(seen[:, None], A, 0.0), np.where(both, N, np.diag(~seen))
    keep = np.eye(3) - p["gain"] @ masked
    G = np.linalg.solve(S, A @ P).T
    return {
        "start": (p["mean"], P),
        "push": (expected, S),
        "condition": (_wrap(p["mean"] + K @ residual[rows]), P - K @ Sr @ K.T),
        "condition with a gain": (
            _wrap(p["mean"] + p["gain"] @ residual),
            keep @ P @ keep.T + p["gain"] @ noise @ p["gain"].T,
        ),
        "plus_noise": (p["mean"], P + p["extra"]),
        "revise": (_wrap(p["mean"] + G @ _wrap(p["future_mean"] - expected)), P + G @ (p["future_cov"] - S) @ G.T),
        "innovation": (residual, np.where(both, S, np.diag(~seen)), nis, log_density),
    }


def _wrap(vector: np.ndarray) -> np.ndarray:
    """The last entry is an angle [rad]."""
    return np.append(vector[:-1], np.arctan2(np.sin(vector[-1]), np.cos(vector[-1])))


def _compare(found: dict[str, Any], expected: dict[str, Any], label: str, tolerance: float) -> None:
    for name, value in zip(("residual", "covariance", "NIS", "log likelihood"), range(4), strict=True):
        what = f"{label}: {name} of the innovation"
        assert_close(found["innovation"][value], expected["innovation"][value], what, tolerance=tolerance)
    for name in expected.keys() - {"innovation"}:
        (mean, cov, factor), (expected_mean, expected_cov) = found[name], expected[name]
        sigma = np.sqrt(np.maximum(np.diag(expected_cov), 1e-30))
        unit = np.maximum(sigma, 1e-3)
        what = f"{label}: {name}"
        assert_close(_turned(mean, expected_mean), expected_mean, f"{what}: mean", tolerance=tolerance, scale=1.0)
        assert_close(cov, expected_cov, f"{what}: covariance", tolerance=tolerance, scale=np.outer(unit, unit))
        assert_covariance(cov, f"{what}: covariance")
        product = np.asarray(factor) @ np.asarray(factor).T
        assert_close(product, cov, f"{what}: factor factor^T = covariance", tolerance=tolerance)
        above = np.triu(np.asarray(factor), 1)
        assert_true(not np.any(above), f"{what}: expected a lower-triangular factor, got {above} above the diagonal")


def _turned(mean: Any, expected: np.ndarray) -> np.ndarray:
    """The mean with its angle on the same side of the cut as the expected one."""
    difference = np.asarray(mean) - expected
    return expected + _wrap(difference)
