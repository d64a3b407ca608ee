"""Recursive total least squares, for rows whose regressors are noisy too."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, Status, did_you_mean
from ..estimates import AbstractEstimate, Gaussian
from ..filters import AbstractEstimator, Info
from ..linalg import congruence, inverse_lower, product, root, root_and_inverse, symmetrize, triangularize
from ..models import AbstractModel, Sample
from .base import as_regression, check_arguments, reported, rows_of, weights_of
from .pencil import Separation, inverse_of, judged
from .row_noise import AbstractRowNoise, ConstantRowNoise

Form = Literal["qr", "covariance", "exact"]
FORMS: tuple[Form, ...] = ("qr", "covariance", "exact")


class TotalLeastSquaresCarry(eqx.Module):
    """What recursive total least squares remembers.

    Attributes:
        estimate: the last one accepted.
        square: lower-triangular root `L` of the information `S = L L^T`, or `P = S^-1` in covariance form (p, p).
        noise: `N`, sum of the noise of the weighted rows (p, p).
        direction: unit vector along `[theta; -1]` (p,).
        count: sum of the rows' forgetting weights.
        squares: sum of the squares of those weights.
        scale: noise scale when an estimate was accepted last, 1 before.
        separation: how far the estimate stood out of the noise at the last measurement.
    """

    estimate: Gaussian
    square: Float[Array, "p p"]
    noise: Float[Array, "p p"]
    direction: Float[Array, " p"]
    count: Float[Array, ""]
    squares: Float[Array, ""]
    scale: Float[Array, ""]
    separation: Separation


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
        theta = prior.mean
        zero, one = jnp.zeros((), theta.dtype), jnp.ones((), theta.dtype)
        a = jnp.append(theta, -one)
        first = self.noise(jnp.zeros_like(a))
        if self.form == "covariance":
            mean = jnp.trace(first) / len(a)
            square = jnp.eye(len(a), dtype=a.dtype) / (self.loading * jnp.where(mean > 0, mean, 1.0))
        else:
            square = jnp.sqrt(self.loading * one) * root(first)[0]
        start = Gaussian.start(theta, prior.cov, model.space)
        unit = a / jnp.sqrt(jnp.sum(a**2))
        empty = Separation(one, one, zero)
        return TotalLeastSquaresCarry(start, square, jnp.zeros_like(first), unit, zero, zero, one, empty)

    def step(
        self, model: AbstractModel, carry: TotalLeastSquaresCarry, sample: Sample
    ) -> tuple[TotalLeastSquaresCarry, Info]:
        regression = as_regression(model, self.weights)
        rows, whole = rows_of(regression, sample)
        weights = weights_of(self.weights, regression, carry.estimate, sample)
        covariances = jax.vmap(self.noise)(rows)
        noise = self.forgetting * carry.noise + jnp.tensordot(whole.astype(rows.dtype), covariances, 1)
        square, half, information, valid = self._accumulated(carry.square, rows, whole, weights)
        inner = symmetrize(congruence(half, noise))
        if self.form == "exact":
            spectrum, vectors = jnp.linalg.eigh(inner)
            direction = half.T @ vectors[:, -1]
        else:
            spectrum, direction = jnp.linalg.eigvalsh(inner), carry.direction
            for _ in range(self.iterations):
                turned = half.T @ (half @ (noise @ direction))
                direction = turned / jnp.sqrt(jnp.sum(turned**2))
        direction = direction / jnp.sqrt(jnp.sum(direction**2))
        count = self.forgetting * carry.count + jnp.sum(whole)
        squares = self.forgetting**2 * carry.squares + jnp.sum(whole)
        estimate, separation, status = judged(
            carry.estimate, direction, information, noise, spectrum, count, squares, self.gap_gate
        )
        scale = jnp.where(status == Status.ok, separation.noise_scale, carry.scale)
        new = TotalLeastSquaresCarry(estimate, square, noise, direction, count, squares, scale, separation)
        return concluded(carry, new, jnp.where(valid, status, Status.not_positive), rows, whole, weights, covariances)

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


def concluded(
    carry: TotalLeastSquaresCarry,
    new: TotalLeastSquaresCarry,
    status: Array,
    rows: Float[Array, "s p"],
    whole: Bool[Array, " s"],
    weights: Float[Array, " s"],
    covariances: Float[Array, "s p p"],
) -> tuple[TotalLeastSquaresCarry, Info]:
    """The memory and report of a step: the new memory unless nothing was measured or its numbers cannot be used."""
    measured = jnp.any(whole)
    held = (new.square, new.noise, new.direction)
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(each)) for each in held]))
    usable = measured & finite & (status != Status.not_positive)
    after = jax.tree.map(lambda fresh, old: jnp.where(usable, fresh, old), new, carry)
    status = jnp.where(~measured, Status.missing, jnp.where(finite, status, Status.nonfinite)).astype(jnp.int32)
    a = jnp.append(carry.estimate.mean, -jnp.ones((), rows.dtype))
    variances = carry.scale * jnp.einsum("i,sij,j->s", a, covariances, a) / weights
    return after, reported(rows, whole, carry.estimate, variances, after.estimate, after.separation, status)
