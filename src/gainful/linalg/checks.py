"""Whether a matrix of numbers is a covariance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import CovarianceError


def check_covariance(matrix: np.ndarray, role: str, names: Sequence[str]) -> None:
    """Raise unless the matrix is finite, symmetric and positive semi-definite."""
    if not np.all(np.isfinite(matrix)):
        i, j = np.argwhere(~np.isfinite(matrix))[0]
        raise CovarianceError(f"{role}: expected finite numbers, got {matrix[i, j]} for {names[i]!r}, {names[j]!r}")
    variances = np.diag(matrix)
    if variances.min() < 0:
        k = int(variances.argmin())
        raise CovarianceError(f"{role}: expected variances of at least 0, got {variances[k]:.6g} for {names[k]!r}")
    scale = np.sqrt(variances)
    scale = np.where(scale > 0, scale, 1.0)
    unit = matrix / np.outer(scale, scale)
    skew = np.abs(unit - unit.T)
    if skew.max() > 1e-8:
        i, j = (int(k) for k in np.unravel_index(int(skew.argmax()), skew.shape))
        raise CovarianceError(
            f"{role}: expected a symmetric matrix, got {matrix[i, j]:.6g} for ({names[i]!r}, {names[j]!r}) "
            f"but {matrix[j, i]:.6g} for ({names[j]!r}, {names[i]!r})"
        )
    # Judged on correlations, so that the answer does not depend on units.
    values, vectors = np.linalg.eigh(0.5 * (unit + unit.T))
    if values[0] < -1e-9 * len(values):
        direction = vectors[:, 0] * np.sign(vectors[np.abs(vectors[:, 0]).argmax(), 0])
        parts = " ".join(f"{c:+.2g} {n!r}" for c, n in zip(direction, names, strict=True) if abs(c) > 0.05)
        actual = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0]
        raise CovarianceError(
            f"{role}: expected a positive semi-definite matrix, got the eigenvalue {actual:.6g} "
            f"({values[0]:.3g} after scaling to unit variances, along {parts})"
        )
