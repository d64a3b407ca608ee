"""Comparisons that say what differs, where and by how much."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from ..estimates import AbstractEstimate


def assert_true(condition: Any, what: str) -> None:
    """Raise with `what` unless the condition holds."""
    if not bool(condition):
        raise AssertionError(what)


def assert_close(actual: Any, expected: Any, what: str, *, tolerance: float, scale: Any = None) -> None:
    """Raise unless two arrays agree within `tolerance` times `scale`, entry by entry.

    Args:
        actual: what came.
        expected: what should have come.
        what: the law, for the message.
        tolerance: largest difference in units of `scale`.
        scale: one number or one per entry; by default the largest size of an expected entry, at least 1.
    """
    actual, expected = np.asarray(actual, dtype=float), np.asarray(expected, dtype=float)
    if actual.shape != expected.shape:
        raise AssertionError(f"{what}: expected shape {expected.shape}, got {actual.shape}")
    if not actual.size:
        return
    unit = np.maximum(1.0, np.abs(expected).max()) if scale is None else np.asarray(scale, dtype=float)
    off = np.abs(actual - expected) / np.broadcast_to(unit, expected.shape)
    if not np.all(off <= tolerance):
        # A NaN counts as infinitely far off.
        worst = np.unravel_index(int(np.where(np.isnan(off), np.inf, off).argmax()), off.shape)
        where = f" at {tuple(int(i) for i in worst)}" if off.ndim else ""
        raise AssertionError(
            f"{what}: expected {expected[worst]:.17g}{where}, got {actual[worst]:.17g}; "
            f"off by {off[worst]:.3g}, more than {tolerance:.3g}"
        )


def assert_identical(actual: Any, expected: Any, what: str) -> None:
    """Raise unless two trees of arrays agree bit for bit; -0.0 counts as 0.0."""
    assert_same_form(actual, expected, what)
    pairs = zip(jax.tree.leaves_with_path(actual), jax.tree.leaves(expected), strict=True)
    for (path, left), right in pairs:
        left, right = np.asarray(left), np.asarray(right)
        if not np.array_equal(left, right, equal_nan=np.issubdtype(left.dtype, np.floating)):
            raise AssertionError(f"{what}: expected{jax.tree_util.keystr(path)} = {right}, got {left}")


def assert_same_form(actual: Any, expected: Any, what: str) -> None:
    """Raise unless two trees have the same structure, shapes and number types, as a compiled loop needs."""
    left, right = jax.tree.structure(actual), jax.tree.structure(expected)
    if left != right:
        raise AssertionError(f"{what}: expected the structure {right}, got {left}")
    for one, other in zip(jax.tree.leaves(actual), jax.tree.leaves(expected), strict=True):
        a, b = jax.numpy.asarray(one), jax.numpy.asarray(other)
        if a.shape != b.shape or a.dtype != b.dtype:
            raise AssertionError(f"{what}: expected {b.dtype}{b.shape}, got {a.dtype}{a.shape}")


def assert_covariance(matrix: Any, what: str, *, tolerance: float = 1e-12) -> None:
    """Raise unless a matrix is finite, symmetric and positive semi-definite, judged on correlations."""
    matrix = np.asarray(matrix, dtype=float)
    assert_true(np.all(np.isfinite(matrix)), f"{what}: expected finite numbers, got {matrix}")
    variances = np.diagonal(matrix)
    assert_true(np.all(variances >= 0), f"{what}: expected variances of at least 0, got {variances}")
    scale = np.sqrt(np.where(variances > 0, variances, 1.0))
    unit = matrix / np.outer(scale, scale)
    skew = np.abs(unit - unit.T).max(initial=0.0)
    assert_true(skew <= tolerance, f"{what}: expected a symmetric matrix, got one off by {skew:.3g}")
    lowest = np.linalg.eigvalsh(0.5 * (unit + unit.T))[0]
    assert_true(
        lowest >= -tolerance * len(unit),
        f"{what}: expected a positive semi-definite matrix, got the eigenvalue {lowest:.3g} of its correlations",
    )


def assert_same_estimate(actual: AbstractEstimate, expected: AbstractEstimate, what: str, *, tolerance: float) -> None:
    """Raise unless two estimates agree within `tolerance` standard deviations, on curved spaces too."""
    cov = np.asarray(expected.cov, dtype=float)
    sigma = np.sqrt(np.maximum(np.diagonal(cov), np.finfo(float).tiny))
    off = np.asarray(expected.space.minus(actual.mean, expected.mean))
    assert_close(off, np.zeros_like(off), f"{what}: mean", tolerance=tolerance, scale=sigma)
    assert_close(actual.cov, cov, f"{what}: covariance", tolerance=tolerance, scale=np.outer(sigma, sigma))
