"""What recursive errors-in-variables estimators remember, and the two ends that their steps share."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import Status
from ..estimates import AbstractEstimate, Gaussian
from ..filters import Info
from ..models import AbstractModel, Sample
from .base import as_regression, reported, rows_of, weights_of
from .pencil import Separation, judged
from .row_noise import AbstractRowNoise


class TotalLeastSquaresCarry(eqx.Module):
    """What recursive total least squares remembers.

    Attributes:
        estimate: the last one accepted.
        square: what stands for the information `S`: a root, its inverse or itself, as the estimator has it (p, p).
        noise: `N`, sum of the noise of the weighted rows (p, p).
        direction: along `[theta; -1]` (p,).
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


class Taken(eqx.Module):
    """A sample's rows, and the sums with them.

    Attributes:
        rows: `[h, z]` of each sensor, zero where not whole (s, p).
        whole: which of them count (s,).
        weights: of the sensors (s,).
        covariances: of the noise of a row of weight 1 (s, p, p).
        noise: `N` with them (p, p).
        count: sum of the rows' forgetting weights with them.
        squares: sum of the squares of those weights with them.
    """

    rows: Float[Array, "s p"]
    whole: Bool[Array, " s"]
    weights: Float[Array, " s"]
    covariances: Float[Array, "s p p"]
    noise: Float[Array, "p p"]
    count: Float[Array, ""]
    squares: Float[Array, ""]


def started(
    model: AbstractModel, prior: AbstractEstimate, square: Float[Array, "p p"], direction: Float[Array, " p"]
) -> TotalLeastSquaresCarry:
    """The memory before the first row."""
    zero, one = jnp.zeros((), direction.dtype), jnp.ones((), direction.dtype)
    estimate = Gaussian.start(prior.mean, prior.cov, model.space)
    empty = Separation(one, one, zero)
    return TotalLeastSquaresCarry(estimate, square, jnp.zeros_like(square), direction, zero, zero, one, empty)


def taken(
    model: AbstractModel,
    carry: TotalLeastSquaresCarry,
    sample: Sample,
    weights: tuple[float, ...] | None,
    forgetting: float,
    noise: AbstractRowNoise,
) -> Taken:
    """The rows of a sample, and the sums with them."""
    regression = as_regression(model, weights)
    rows, whole = rows_of(regression, sample)
    covariances = jax.vmap(noise)(rows)
    return Taken(
        rows,
        whole,
        weights_of(weights, regression, carry.estimate, sample),
        covariances,
        forgetting * carry.noise + jnp.tensordot(whole.astype(rows.dtype), covariances, 1),
        forgetting * carry.count + jnp.sum(whole),
        forgetting**2 * carry.squares + jnp.sum(whole),
    )


def concluded(
    carry: TotalLeastSquaresCarry,
    square: Float[Array, "p p"],
    direction: Float[Array, " p"],
    information: Float[Array, "p p"],
    spectrum: Float[Array, " p"],
    new: Taken,
    *,
    gate: bool,
    valid: Bool[Array, ""] | bool = True,
) -> tuple[TotalLeastSquaresCarry, Info]:
    """The memory and report of a step: the new memory unless nothing was measured or its numbers cannot be used.

    Args:
        carry: the memory before.
        square: what stands for the information, with the new rows.
        direction: along `[theta; -1]`.
        information: `S`.
        spectrum: eigenvalues of `S^-1 N`, rising.
        new: the rows.
        gate: whether the eigenvalue gap must exceed what noise alone would show.
        valid: whether `S` is positive definite.
    """
    estimate, separation, status = judged(
        carry.estimate, direction, information, new.noise, spectrum, new.count, new.squares, gate
    )
    scale = jnp.where(status == Status.ok, separation.noise_scale, carry.scale)
    status = jnp.where(valid, status, Status.not_positive)
    memory = TotalLeastSquaresCarry(estimate, square, new.noise, direction, new.count, new.squares, scale, separation)
    measured = jnp.any(new.whole)
    finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(each)) for each in (square, new.noise, direction)]))
    usable = measured & finite & (status != Status.not_positive)
    after = jax.tree.map(lambda fresh, old: jnp.where(usable, fresh, old), memory, carry)
    status = jnp.where(~measured, Status.missing, jnp.where(finite, status, Status.nonfinite)).astype(jnp.int32)
    a = jnp.append(carry.estimate.mean, -jnp.ones((), new.rows.dtype))
    variances = carry.scale * jnp.einsum("i,sij,j->s", a, new.covariances, a) / new.weights
    return after, reported(new.rows, new.whole, carry.estimate, variances, after.estimate, after.separation, status)
