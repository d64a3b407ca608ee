"""How noisy the columns of a regression's rows are."""

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..linalg import check_covariance
from .rates import CENTRAL_DIFFERENCE, check_stencil, rate_noise_covariance


class AbstractRowNoise(eqx.Module):
    """Covariance of the noise of a row `[h, z]`, regressors first and regressand last.

    A sensor of weight w has this over w; both together are known up to one factor, the noise scale.
    """

    @abc.abstractmethod
    def __call__(self, row: Float[Array, " p"]) -> Float[Array, "p p"]:
        """The covariance of the row's noise."""


class ConstantRowNoise(AbstractRowNoise):
    """The same covariance for every row.

    Attributes:
        covariance: one variance for all columns (isotropic: total least squares), one each, or the matrix (p, p). Columns
            free of noise have 0: with noise in the regressand alone this is least squares.

    Example:
        >>> import jax.numpy as jnp
        >>> ConstantRowNoise((0.1, 0.0))(jnp.ones(2)).tolist()
        [[0.1, 0.0], [0.0, 0.0]]
    """

    covariance: float | tuple[float, ...] | tuple[tuple[float, ...], ...] = 1.0

    def __check_init__(self) -> None:
        if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(self.covariance)):
            return  # nothing to look at yet
        matrix = np.asarray(self.covariance, dtype=float)
        matrix = np.diag(np.atleast_1d(matrix)) if matrix.ndim < 2 else matrix
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
            raise ConfigError(f"covariance: expected a number, variances or a square matrix, got shape {matrix.shape}")
        check_covariance(matrix, "covariance", [f"column {j}" for j in range(len(matrix))])
        if not matrix.any():
            raise ConfigError("covariance: expected noise in at least one column, got none")

    def __call__(self, row: Float[Array, " p"]) -> Float[Array, "p p"]:
        given = jnp.asarray(self.covariance, row.dtype)
        if given.ndim == 0:
            return given * jnp.eye(len(row), dtype=row.dtype)
        full = jnp.diag(given) if given.ndim == 1 else given
        if full.shape != (len(row), len(row)):
            raise ConfigError(f"covariance: expected {len(row)} columns as in a row, got {full.shape[0]}")
        return full


class RateRowNoise(AbstractRowNoise):
    """Noise of rows `[rdot, r, r|r|, tau]` that come from one rate sensor and one wrench, see `rate_noise_covariance`.

    Attributes:
        rate: standard deviation of the rate sensor, in the rate's unit.
        wrench: standard deviation of the wrench, in its unit.
        dt: time between rows [s].
        stencil: with which the rate was differentiated.

    Example:
        >>> import jax.numpy as jnp
        >>> float(RateRowNoise(0.1, 2.0)(jnp.array([0.0, 0.5, 0.25, 1.0]))[1, 1])
        0.010000000000000002
    """

    rate: float = 1.0
    wrench: float = 1.0
    dt: float = 1.0
    stencil: tuple[float, ...] = eqx.field(static=True, default=CENTRAL_DIFFERENCE)

    def __check_init__(self) -> None:
        check_stencil(self.stencil)
        for name in ("rate", "wrench", "dt"):
            value: Any = getattr(self, name)
            if isinstance(value, (int, float)) and not value > 0:
                raise ConfigError(f"{name}: expected a number above 0, got {value!r}")

    def __call__(self, row: Float[Array, " p"]) -> Float[Array, "p p"]:
        if len(row) != 4:
            raise ConfigError(
                f"RateRowNoise: expected rows of a rate's derivative, rate, square and wrench, got {len(row)}"
            )
        return rate_noise_covariance(row[1], self.rate, self.wrench, self.dt, self.stencil)
