"""Whether a record tells the parameters apart, from each other and from its noise."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..errors import ShapeError
from .batch import generalized_total_least_squares
from .pencil import largest_noise_gap
from .rows import count_rows, information

_ALIKE, _UNEQUAL = 0.95, 1.5
"""Cosine of two columns from which they are called alike; ratio of columns' noise from which it is called unequal."""


@dataclasses.dataclass(frozen=True)
class Identifiability:
    """What a record can tell about the parameters.

    Attributes:
        columns: names of the regressors.
        rows: that are whole.
        condition: of the regressors scaled to columns of equal size; 1 is best.
        gap: ratio of the two smallest eigenvalues of information against noise; NaN where the noise is not known.
        noise_gap: largest ratio noise alone would show.
        correlations: cosines between columns of regressors (n, n).
        noise_ratio: of the noisiest column's standard deviation to that of the quietest; infinite if one is free of noise,
            NaN where that is not known.
    """

    columns: tuple[str, ...]
    rows: int
    condition: float
    gap: float
    noise_gap: float
    correlations: np.ndarray
    noise_ratio: float

    @property
    def contraction(self) -> float:
        """What one inverse-power step leaves of an error."""
        return 1.0 / self.gap

    @property
    def worst_pair(self) -> tuple[str, str, float]:
        """The two columns most alike, and their cosine."""
        size = np.abs(np.triu(self.correlations, 1))
        i, j = np.unravel_index(int(size.argmax()), size.shape)
        return self.columns[i], self.columns[j], float(self.correlations[i, j])

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader of estimates from this record should know."""
        found = []
        if self.gap <= self.noise_gap:
            found.append(
                f"the parameters are not told from noise: eigenvalue gap {self.gap:.3g}, "
                f"and {self.rows} rows of noise alone would show up to {self.noise_gap:.3g}"
            )
        if len(self.columns) > 1:
            first, second, cosine = self.worst_pair
            if abs(cosine) > _ALIKE:
                found.append(
                    f"the columns {first!r} and {second!r} are nearly alike (cosine {cosine:.3g}): their parameters are hard "
                    "to tell apart; excite at more than one level"
                )
        if self.noise_ratio > _UNEQUAL:
            ratio = "some columns have none" if np.isinf(self.noise_ratio) else f"by a factor of {self.noise_ratio:.3g}"
            found.append(
                f"the columns' noise is unequal ({ratio}): isotropic total least squares would be far off; "
                "give the covariance of a row"
            )
        return tuple(found)


def identifiability(rows: Any, noise: Any = None, *, columns: Sequence[str] | None = None) -> Identifiability:
    """What a record can tell about the parameters.

    Args:
        rows: `[h, z]` of every sensor (T, s, p); rows with a NaN count for nothing.
        noise: covariance of the noise of a row (p, p), or one variance for all columns; None where it is not known.
        columns: names of the regressors.

    Raises:
        ShapeError: a covariance or names that are not as many as the columns.

    Example:
        >>> rows = np.random.default_rng(0).normal(size=(50, 1, 3))
        >>> identifiability(rows, 1.0, columns=("r", "r|r|")).worst_pair[:2]
        ('r', 'r|r|')
    """
    table = jnp.asarray(rows, dtype=float)
    S, count = np.asarray(information(table)), float(count_rows(table))
    p = len(S)
    names = tuple(f"h{j}" for j in range(p - 1)) if columns is None else tuple(columns)
    N = np.asarray(np.nan if noise is None else noise, dtype=float)
    N = N * np.eye(p) if N.ndim == 0 else N
    if N.shape != (p, p):
        raise ShapeError(f"noise: expected shape ({p}, {p}), got {N.shape}")
    if len(names) != p - 1:
        raise ShapeError(f"columns: expected {p - 1} names, got {len(names)}")
    size = np.sqrt(np.diagonal(S)[:-1])
    unit = S[:-1, :-1] / np.outer(*(np.where(size > 0, size, 1.0),) * 2)
    values = np.linalg.eigvalsh(unit)
    condition = float(np.sqrt(values[-1] / values[0])) if values[0] > 0 else float("inf")
    gap = float(generalized_total_least_squares(jnp.asarray(S), jnp.asarray(count * N), count).gap)
    spread = np.sqrt(np.diagonal(N))
    ratio = float("inf") if spread.min() == 0 else float(spread.max() / spread.min())
    limit = float(largest_noise_gap(jnp.asarray(count), p))
    return Identifiability(names, int(count), condition, gap, limit, unit, ratio)
