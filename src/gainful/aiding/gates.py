"""Whether a correction is worth having, judged on records it was not trained on."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from ..errors import ConfigError, ShapeError


def validation_gate(
    base: Float[np.ndarray, "M T n"], aided: Float[np.ndarray, "M T n"], steady_from: int = 0, z: float = 1.645
) -> Bool[np.ndarray, " n"]:
    """Which components are better with the correction, beyond chance.

    ```
    d_r = mean_t base^2 - mean_t aided^2 of record r;  accept where mean(d) > z std(d) / sqrt(M)
    ```

    Args:
        base: errors without it, NaN where there is no reference.
        aided: errors with it.
        steady_from: first row that counts.
        z: how many standard errors the gain must be above 0; 1.645 lets chance pass once in twenty.

    Raises:
        ShapeError: arrays of different shapes.
        ConfigError: fewer than two records, or no row left.

    Example:
        >>> errors = np.random.default_rng(0).normal(size=(8, 50, 2))
        >>> validation_gate(errors, errors * [0.5, 1.0]).tolist()
        [True, False]
    """
    before, after = run_squares(base, aided, steady_from)
    gain = before - after
    with np.errstate(invalid="ignore"):
        return np.asarray(gain.mean(axis=0) > z * gain.std(axis=0, ddof=1) / np.sqrt(len(gain)))


def run_squares(
    base: Float[np.ndarray, "M T n"], aided: Float[np.ndarray, "M T n"], steady_from: int
) -> tuple[Float[np.ndarray, "M n"], Float[np.ndarray, "M n"]]:
    """Mean square error of each record over its steady rows, without and with the correction; NaN without a reference."""
    base, aided = np.asarray(base, dtype=float), np.asarray(aided, dtype=float)
    if base.ndim != 3 or base.shape != aided.shape:
        raise ShapeError(f"errors: expected two arrays of shape (M, T, n), got {base.shape} and {aided.shape}")
    if len(base) < 2:
        raise ConfigError(f"validation: expected at least 2 records, got {len(base)}")
    if not 0 <= steady_from < base.shape[1]:
        raise ConfigError(f"steady_from: expected a row from 0 to {base.shape[1] - 1}, got {steady_from!r}")
    return mean_squares(base[:, steady_from:]), mean_squares(aided[:, steady_from:])


def mean_squares(errors: Float[np.ndarray, "M T n"]) -> Float[np.ndarray, "M n"]:
    """Mean square over the rows that have a reference; NaN where none has."""
    known = np.isfinite(errors)
    count = known.sum(axis=1)
    total = np.where(known, errors, 0.0)
    return np.where(count > 0, (total**2).sum(axis=1) / np.maximum(count, 1), np.nan)
