"""The laws of linearizations and of sigma-point rules."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..estimates import AbstractEstimate, Gaussian, SquareRoot
from ..linearization import AbstractLinearization, AbstractRule
from ..spaces import AbstractSpace, Circle, Euclidean, Product, Quaternion, quaternion_exp, quaternion_multiply
from .comparisons import assert_close, assert_covariance, assert_true

_MATRIX = np.array([[1.0, -0.5, 2.0], [0.3, 0.0, -1.0]])
_OFFSET = np.array([0.7, -1.3])
_ROOT = np.array([[1.5, 0.0, 0.0], [0.4, 0.2, 0.0], [-0.3, 0.1, 0.05]])
_TURN = np.array([0.4, -0.8, 0.3])  # rad
_ATTITUDE_VARIANCE = 0.04  # rad^2


def check_linearization(linearization: AbstractLinearization, *, tolerance: float = 1e-11) -> None:
    """Raise unless a linearization is exact where the function is affine, and its error is a covariance elsewhere.

    Affine means: in a vector space `F x + c`; of an angle, a shift; of an attitude, a fixed turn. The estimate may be
    dense or a square root, and may know a state exactly.

    Args:
        linearization: the linearization.
        tolerance: rounding allowed; sigma points close to the centre lose digits, `1 / alpha^2` of them.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.linearization import Taylor
        >>> check_linearization(Taylor())
    """
    name = type(linearization).__name__
    plane, line = Euclidean(("a", "b", "c")), Euclidean(("y", "z"))
    turned = Product([Circle("heading"), Quaternion("attitude")])
    vector, attitude = np.array([1.0, -2.0, 0.5]), np.array([3.1, 0.0, 0.0, 0.0, 1.0])
    full = _ROOT @ _ROOT.T
    partly = full * np.outer([1, 0, 1], [1, 0, 1])
    apply = jax.jit(_apply(linearization, SquareRoot, _affine, plane, line))
    for cov in (full, partly):
        _check_affine(apply(jnp.asarray(vector), jnp.asarray(cov)), _MATRIX, f"{name} of an affine function", tolerance)
    apply = jax.jit(_apply(linearization, Gaussian, _turn, turned, turned))
    found = apply(jnp.asarray(attitude), jnp.asarray(_ATTITUDE_VARIANCE * np.eye(4)))
    _check_affine(found, np.eye(4), f"{name} of a fixed turn of an attitude", tolerance)

    what = f"{name} of a curved function"
    found = jax.jit(_apply(linearization, Gaussian, _curve, plane, line))(jnp.asarray(vector), jnp.asarray(full))
    shape = found["matrix"].shape
    assert_true(shape == (2, 3), f"{what}: expected a matrix of shape (2, 3), got {shape}")
    assert_covariance(found["error"], f"{what}: error", tolerance=1e3 * tolerance)
    columns, deficit = (np.asarray(found[name]) for name in ("columns", "deficit"))
    assert_close(
        columns @ columns.T - deficit @ deficit.T,
        found["error"],
        f"{what}: columns columns^T - deficit deficit^T = error",
        tolerance=1e3 * tolerance,
    )


def _check_affine(found: dict[str, Any], slope: np.ndarray, what: str, tolerance: float) -> None:
    rows = len(slope)
    assert_close(found["off"], np.zeros(rows), f"{what}: value = f(mean)", tolerance=tolerance)
    # Only directions in which the estimate is uncertain can be told: A L = F L.
    root = np.asarray(found["factor"])
    assert_close(np.asarray(found["matrix"]) @ root, slope @ root, f"{what}: A L = F L", tolerance=tolerance)
    assert_close(found["error"], np.zeros((rows, rows)), f"{what}: no error", tolerance=tolerance)
    assert_true(not np.any(found["noise"]), f"{what}: expected no model noise, got {found['noise']}")


def _affine(x: Array) -> Array:
    return jnp.asarray(_MATRIX) @ x + _OFFSET


def _curve(x: Array) -> Array:
    return jnp.stack([x[0] ** 2 + x[1] * x[2], jnp.sin(x[1])])


def _turn(x: Array) -> Array:
    return jnp.concatenate([x[:1] + 0.5, quaternion_multiply(quaternion_exp(jnp.asarray(_TURN)), x[1:])])


def _apply(
    linearization: AbstractLinearization,
    kind: type[AbstractEstimate],
    fn: Callable[[Array], Array],
    space: AbstractSpace,
    out: AbstractSpace,
) -> Callable[[Array, Array], dict[str, Any]]:
    def apply(mean: Array, cov: Array) -> dict[str, Any]:
        estimate = kind.start(mean, cov, space)
        affine = linearization(fn, estimate, out)
        return {
            "off": out.minus(affine.predict(mean), fn(mean)),
            "matrix": affine.matrix,
            "noise": affine.noise,
            "error": affine.covariance(),
            "factor": estimate.factor,
            "columns": affine.columns(),
            "deficit": affine.deficit,
        }

    return apply


def check_rule(rule: AbstractRule, *, degree: int = 3, sizes: tuple[int, ...] = (1, 2, 3)) -> None:
    """Raise unless a sigma-point rule has the moments of a standard normal vector.

    The mean's weights give every monomial up to `degree` its normal moment; the covariance's weights give mean 0 and
    covariance 1; with every point its mirror image is one too.

    Args:
        rule: the rule.
        degree: total degree up to which monomials must come out exactly.
        sizes: numbers of states to try.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.linearization import GaussHermite
        >>> check_rule(GaussHermite(order=3), degree=5)
    """
    for n in sizes:
        label = f"{type(rule).__name__} for {n} states"
        points, mean_weights, cov_weights = (np.asarray(part, dtype=float) for part in rule.points(n))
        shapes = points.shape, mean_weights.shape, cov_weights.shape
        k = points.shape[-1]
        assert_true(shapes == ((n, k), (k,), (k,)), f"{label}: expected points (n, k) and weights (k,), got {shapes}")
        for powers in itertools.product(range(degree + 1), repeat=n):
            if sum(powers) <= degree:
                terms = mean_weights * np.prod(points.T ** np.array(powers), axis=1)
                _assert_sum(terms, _normal_moment(powers), f"{label}: moment of powers {powers}")
        for i in range(n):
            _assert_sum(cov_weights * points[i], 0.0, f"{label}: weights of the covariance, mean of state {i}")
            for j in range(i + 1):
                what = f"{label}: weights of the covariance, entry ({i}, {j})"
                _assert_sum(cov_weights * points[i] * points[j], float(i == j), what)
        # Rounded, since mirrored nodes may differ in the last bit; adding 0 turns -0 into 0.
        table = np.round(np.concatenate([points, mean_weights[None], cov_weights[None]]), 9) + 0.0
        mirrored = np.concatenate([-table[:n], table[n:]]) + 0.0
        same = sorted(map(tuple, table.T)) == sorted(map(tuple, mirrored.T))
        assert_true(same, f"{label}: expected the mirror image of every point, with its weight")


def _normal_moment(powers: tuple[int, ...]) -> float:
    """Expectation of a monomial: the product of the odd numbers below each power, 0 if one is odd."""
    return float(np.prod([0.0 if p % 2 else float(np.prod(np.arange(1, p, 2))) for p in powers]))


def _assert_sum(terms: np.ndarray, expected: float, what: str) -> None:
    # A sum of k rounded terms is off by at most k eps times the sum of their sizes.
    size = np.abs(terms).sum() + abs(expected)
    assert_close(terms.sum(), expected, what, tolerance=4 * len(terms) * np.finfo(float).eps, scale=max(size, 1.0))
