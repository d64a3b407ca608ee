"""Recursive total least squares, for rows whose regressors are noisy too."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..linalg import congruence, inverse_lower, product, root, root_and_inverse, symmetrize, triangularize
from ..models import AbstractModel, Sample
from .base import as_regression, check_arguments
from .errors_in_variables import TotalLeastSquaresCarry, concluded, started, taken
from .pencil import inverse_of
from .row_noise import AbstractRowNoise, ConstantRowNoise

Form = Literal["qr", "covariance", "exact"]
FORMS: tuple[Form, ...] = ("qr", "covariance", "exact")


class RecursiveTotalLeastSquares(AbstractEstimator):
    """Total least squares, generalised to any covariance of a row, by one inverse-power step per sample.

    ```
    S <- lam S + D^T W D,   N <- lam N + sum_i Sigma,   v <- S^-1 N v / |S^-1 N v|,   theta = -v_h / v_z
    ```

    `D` holds the rows `[h, z]` of all sensors, each with noise of covariance `Sigma / w_i`. Consistent where least squares is
    biased, if that covariance is known up to a factor. Told the wrong one it is far worse than least squares: the default,
    equal noise in all columns, is right only for columns that were brought to it. See `noise_from_differences` and
    `rate_noise_covariance`.

    The estimate is the prior until there are rows enough, and the last one accepted while the data do not tell the parameters
    from the noise. The prior's covariance is no information, only what is reported before; a walk of the model's parameters
    is left out: forget instead.

    Attributes:
        weights: per sensor, inverse to its noise; by default the inverse variances of the model's regressands.
        forgetting: `lam`, how much a row counts one step later; steps without a measurement forget nothing.
        noise: `Sigma`, covariance of the noise of a row of weight 1, singular where columns are free of it.
        form: "qr" carries a root of `S` and loses no digits; "covariance" carries `S^-1` by the matrix inversion lemma, as
            published, and fails in float32 or with forgetting on clean data; "exact" solves for the eigenvector.
        iterations: inverse-power steps per sample.
        gap_gate: accept an estimate only if the eigenvalue gap exceeds what noise alone would show.
        loading: rows' worth of noise that `S` starts with; moves no eigenvector where all rows are alike.

    Source: Golub and Van Loan (1980), SIAM J. Numer. Anal. 17(6):883-893; Van Huffel and Vandewalle (1991), The Total Least
        Squares Problem; Choi, Lim and Sung (2005), LNCS 3496:558-565; Zhu et al. (2017), J. Ship Mech. 21(10):1263-1270.
    Differs: any row covariance, a root in place of the inverse, and a gate on the eigenvalue gap.
    Reduces to: least squares for noise in the regressand alone; `total_least_squares` of all rows once converged.

    Example:
        >>> RecursiveTotalLeastSquares(forgetting=0.998).form
        'qr'
    """

    weights: tuple[float, ...] | None = None
    forgetting: float = 1.0
    noise: AbstractRowNoise = ConstantRowNoise()
    form: Form = eqx.field(static=True, default="qr")
    iterations: int = eqx.field(static=True, default=1)
    gap_gate: bool = eqx.field(static=True, default=True)
    loading: float = 1e-3

    def __check_init__(self) -> None:
        check_arguments(self.weights, self.forgetting)
        if self.form not in FORMS:
            raise ConfigError(f"form: {self.form!r} is not known; {did_you_mean(str(self.form), FORMS)}")
        if not isinstance(self.iterations, int) or self.iterations < 1:
            raise ConfigError(f"iterations: expected a whole number of at least 1, got {self.iterations!r}")
        if isinstance(self.loading, (int, float)) and not self.loading > 0:
            raise ConfigError(f"loading: expected a number above 0, got {self.loading!r}")

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> TotalLeastSquaresCarry:
        as_regression(model, self.weights)
        one = jnp.ones((), prior.mean.dtype)
        a = jnp.append(prior.mean, -one)
        first = self.noise(jnp.zeros_like(a))
        if self.form == "covariance":
            mean = jnp.trace(first) / len(a)
            square = jnp.eye(len(a), dtype=a.dtype) / (self.loading * jnp.where(mean > 0, mean, 1.0))
        else:
            square = jnp.sqrt(self.loading * one) * root(first)[0]
        return started(model, prior, square, a / jnp.sqrt(jnp.sum(a**2)))

    def step(
        self, model: AbstractModel, carry: TotalLeastSquaresCarry, sample: Sample
    ) -> tuple[TotalLeastSquaresCarry, Info]:
        new = taken(model, carry, sample, self.weights, self.forgetting, self.noise)
        square, half, information, valid = self._accumulated(carry.square, new.rows, new.whole, new.weights)
        inner = symmetrize(congruence(half, new.noise))
        if self.form == "exact":
            spectrum, vectors = jnp.linalg.eigh(inner)
            direction = half.T @ vectors[:, -1]
        else:
            spectrum, direction = jnp.linalg.eigvalsh(inner), carry.direction
            for _ in range(self.iterations):
                turned = half.T @ (half @ (new.noise @ direction))
                direction = turned / jnp.sqrt(jnp.sum(turned**2))
        direction = direction / jnp.sqrt(jnp.sum(direction**2))
        return concluded(carry, square, direction, information, spectrum, new, gate=self.gap_gate, valid=valid)

    def _accumulated(
        self,
        square: Float[Array, "p p"],
        rows: Float[Array, "s p"],
        whole: Bool[Array, " s"],
        weights: Float[Array, " s"],
    ) -> tuple[Float[Array, "p p"], Float[Array, "p p"], Float[Array, "p p"], Bool[Array, ""]]:
        """With the sample's rows: what is carried, `X` with `S^-1 = X^T X`, `S`, and whether `S` is positive definite."""
        lam = self.forgetting
        if self.form == "covariance":
            seen = product(rows, square)
            spread = lam * jnp.diag(jnp.where(whole, 1.0 / weights, 1.0)) + product(seen, rows.T)
            _, inverse, _ = root_and_inverse(symmetrize(spread))
            back = product(inverse, seen)
            new = symmetrize(square - product(back.T, back)) / lam
            lower = root(new)[0]
            other = inverse_lower(lower)
            return new, lower.T, product(other.T, other), jnp.all(jnp.diagonal(lower) > 0)
        faded, weighted = jnp.sqrt(jnp.asarray(lam, rows.dtype)) * square, jnp.sqrt(weights)[:, None] * rows
        lower = triangularize(jnp.concatenate([faded, weighted.T], axis=1))
        return lower, inverse_of(lower), product(lower, lower.T), jnp.array(True)
