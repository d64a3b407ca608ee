"""Squares in units of their covariance, and how they should be spread: plain arrays, for one run or many."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from scipy.special import gammaincinv

from ..errors import ConfigError


def nees(errors: Float[np.ndarray, "... n"], covs: Float[np.ndarray, "... n n"]) -> Float[np.ndarray, "..."]:
    """Normalised estimation errors squared, `e^T P^-1 e`, for any number of rows and runs.

    Components that are NaN, and directions that have no variance, are left out; an error where a component's variance
    is zero makes the result infinite, and a covariance that is not finite makes it NaN.

    Args:
        errors: truth minus estimate in tangent coordinates.
        covs: their claimed covariances.

    Example:
        >>> nees(np.array([[1.0, 2.0]]), np.diag([1.0, 4.0])[None]).tolist()
        [2.0]
    """
    return whiten(np.asarray(errors), np.asarray(covs))[0]


def chi_square_bounds(degrees: float, runs: int = 1, level: float = 0.95) -> tuple[float, float]:
    """Bounds for the average over independent runs of a chi-square quantity, such as a NEES.

    Args:
        degrees: degrees of freedom of each.
        runs: how many are averaged.
        level: probability between the bounds.

    Raises:
        ConfigError: a level outside (0, 1), or degrees or runs that are not above zero.

    Example:
        >>> tuple(round(bound, 2) for bound in chi_square_bounds(4, 50))
        (3.25, 4.82)
    """
    check_level(level)
    if not (degrees > 0 and runs > 0):
        raise ConfigError(f"degrees and runs: expected numbers above 0, got {degrees!r} and {runs!r}")
    tail, half = 0.5 * (1 - level), 0.5 * degrees * runs
    return float(2 * gammaincinv(half, tail) / runs), float(2 * gammaincinv(half, 1 - tail) / runs)


def correlation_time(whitened: Float[np.ndarray, "T n"]) -> float:
    """Rows per independent sample of the squared norm of a Gaussian series; from 1 to about the number of rows."""
    rows, n = whitened.shape
    if rows < 3:
        return 1.0
    # Each component in its own size, or a slow error that happens to be small would go unnoticed.
    size = np.sqrt(np.mean(whitened**2, axis=0))
    whitened = whitened / np.where(size > 0, size, 1.0)
    base = np.sum((whitened.T @ whitened / rows) ** 2)
    if not base > 0:
        return 1.0
    lags, shares = [0], [1.0]
    # Spaced ever wider, so that a long record costs no more than a hundred products.
    for lag in np.unique(np.geomspace(1, rows - 1, 100).astype(int)).tolist():
        product = whitened[:-lag].T @ whitened[lag:] / (rows - lag)
        # White noise alone would leave n / (rows - lag).
        share = np.clip(np.sum(product**2) / base - n / (rows - lag), 0.0, 1.0)
        lags.append(lag)
        shares.append(float(share) * (1 - lag / rows))
        if share < 0.05:
            break
    return float(1 + 2 * np.interp(np.arange(1, lags[-1] + 1), lags, shares).sum())


def whiten(
    errors: Float[np.ndarray, "... n"], covs: Float[np.ndarray, "... n n"]
) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "... n"], Int[np.ndarray, "..."]]:
    """Squares, the errors times an inverse root of their covariance, and degrees of freedom."""
    n, eps = errors.shape[-1], np.finfo(covs.dtype).eps
    usable = np.asarray(np.isfinite(covs).all(axis=(-2, -1)))
    covs = np.where(usable[..., None, None], covs, np.eye(n)).astype(float)
    variances = np.diagonal(covs, axis1=-2, axis2=-1)
    known = np.isfinite(errors) & (variances > 0)
    scale = np.where(known, np.sqrt(np.where(known, variances, 1.0)), 1.0)
    both = known[..., :, None] & known[..., None, :]
    # Judged on correlations, so that the rank does not depend on units.
    unit = np.where(both, covs / (scale[..., :, None] * scale[..., None, :]), np.eye(n))
    whitened, lost = _solve(unit, np.where(known, errors / scale, 0.0), 8 * n * eps)
    off = (np.isfinite(errors) & (variances <= 0) & (errors != 0)).any(axis=-1)
    squares = np.where(usable, np.where(off, np.inf, np.sum(whitened**2, axis=-1)), np.nan)
    return squares, whitened, np.where(usable, known.sum(axis=-1) - lost, 0)


def _solve(
    matrices: Float[np.ndarray, "... n n"], vectors: Float[np.ndarray, "... n"], tolerance: float
) -> tuple[Float[np.ndarray, "... n"], Int[np.ndarray, "..."]]:
    """The vectors times an inverse root of their matrix, alike for neighbouring rows, and directions dropped."""
    try:
        lower = np.linalg.cholesky(matrices)
        if (np.diagonal(lower, axis1=-2, axis2=-1) ** 2 > tolerance).all():
            return np.linalg.solve(lower, vectors[..., None])[..., 0], np.zeros(vectors.shape[:-1], int)
    except np.linalg.LinAlgError:
        pass
    values, axes = np.linalg.eigh(matrices)
    kept = values > tolerance
    scaled = axes * np.where(kept, 1 / np.sqrt(np.where(kept, values, 1.0)), 0.0)[..., None, :]
    # The symmetric root: axes alone change sign from row to row, and rows must remain comparable.
    return np.einsum("...ij,...kj,...k->...i", scaled, axes, vectors, optimize=True), (~kept).sum(axis=-1)


def check_level(level: float) -> None:
    """Raise unless the level is a probability between 0 and 1."""
    if not 0 < level < 1:
        raise ConfigError(f"level: expected a probability between 0 and 1, got {level!r}")
