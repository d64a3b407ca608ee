"""Regression from all rows at once, given the information they hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import Status
from ..estimates import Gaussian
from ..linalg import congruence, product, root, root_and_inverse, symmetrize
from ..spaces import AbstractSpace
from .pencil import information_covariance, inverse_of, parameters_of


class Fit(eqx.Module):
    """Parameters found from a whole record; all arrays may carry leading batch axes.

    Attributes:
        theta: the parameters, NaN where the data give none (..., n).
        cov: their covariance, NaN where the number of rows was not given (..., n, n).
        noise_scale: by which factor the rows are noisier than assumed; for least squares the variance of the residuals.
        gap: of the two smallest eigenvalues of information against noise, 1 is no information; infinite where the method
            needs none.
        status: a `Status` code.
    """

    theta: Float[Array, "*batch n"]
    cov: Float[Array, "*batch n n"]
    noise_scale: Float[Array, "*batch"]
    gap: Float[Array, "*batch"]
    status: Int[Array, "*batch"]

    @property
    def std(self) -> Float[Array, "*batch n"]:
        """Standard deviations of the parameters."""
        return jnp.sqrt(jnp.diagonal(self.cov, axis1=-2, axis2=-1))

    def estimate(self, space: AbstractSpace) -> Gaussian:
        """The fit as an estimate, such as the prior of a filter that goes on with it."""
        return Gaussian.start(self.theta, self.cov, space)


def least_squares(information: Float[Array, "*batch p p"], count: Any = None) -> Fit:
    """Least squares: `theta = S_hh^-1 S_hz`.

    Biased towards zero where the regressors are noisy: see `least_squares_bias`. The covariance is about the biased limit.

    Args:
        information: weighted sums of squares of rows `[h, z]`, see `information`.
        count: rows behind them; without it there is no covariance.

    Example:
        >>> import jax.numpy as jnp
        >>> rows = jnp.array([[1.0, 2.1], [2.0, 3.9], [3.0, 6.0]])
        >>> round(float(least_squares(rows.T @ rows).theta[0]), 6)
        1.992857
    """
    return _fit(_least_squares, count, information)


def total_least_squares(information: Float[Array, "*batch p p"], count: Any = None) -> Fit:
    """Total least squares, for rows with equal and independent noise in every column.

    `theta = -v_h / v_z` with the eigenvector of `S` for its smallest eigenvalue `l`; equivalently `(S_hh - l I) theta = S_hz`.
    The noise scale is the variance of that noise, times the weight of a row.

    Args:
        information: weighted sums of squares of rows `[h, z]`, see `information`.
        count: rows behind them; without it there is no covariance.

    Source: Golub and Van Loan (1980), SIAM J. Numer. Anal. 17(6):883-893.

    Example:
        >>> import jax.numpy as jnp
        >>> rows = jnp.array([[1.0, 2.1], [2.0, 3.9], [3.0, 6.0]])
        >>> round(float(total_least_squares(rows.T @ rows).theta[0]), 6)
        1.993409
    """
    S = jnp.asarray(information)
    rows = 1.0 if count is None else jnp.asarray(count, S.dtype)[..., None, None]
    return generalized_total_least_squares(S, rows * jnp.eye(S.shape[-1], dtype=S.dtype), count)


def generalized_total_least_squares(
    information: Float[Array, "*batch p p"], noise: Float[Array, "*batch p p"], count: Any = None
) -> Fit:
    """Total least squares for any covariance of the rows' noise, known up to a factor.

    `a = [theta; -1]` minimises `a^T S a / a^T N a`. Columns free of noise have zeros in `N`: with noise in the regressand alone
    this is least squares.

    Args:
        information: `S`, weighted sums of squares of rows `[h, z]`, see `information`.
        noise: `N`, the sum of the weighted rows' covariances, see `accumulated_noise`; only its shape matters for theta.
        count: rows behind them; without it there is no covariance.

    Source: Van Huffel and Vandewalle (1989), SIAM J. Matrix Anal. Appl. 10(3):294-315.
    Reduces to: `total_least_squares` for `N` proportional to the identity.

    Example:
        >>> import jax.numpy as jnp
        >>> rows = jnp.array([[1.0, 2.1], [2.0, 3.9], [3.0, 6.0]])
        >>> round(float(generalized_total_least_squares(rows.T @ rows, jnp.diag(jnp.array([0.0, 1.0]))).theta[0]), 6)
        1.992857
    """
    return _fit(_generalized_total_least_squares, count, information, noise)


def bias_compensated_least_squares(
    information: Float[Array, "*batch p p"], noise: Float[Array, "*batch p p"], count: Any = None
) -> Fit:
    """Least squares with the noise taken out of the sums: `theta = (S_hh - N_hh)^-1 (S_hz - N_hz)`.

    For a covariance known with its scale. Where that is doubtful, `generalized_total_least_squares` cannot take away more than
    there is. The noise scale reported, residuals over what was assumed, should be near 1; the gap is the smallest ratio of
    information to noise among the regressors.

    Args:
        information: `S`, weighted sums of squares of rows `[h, z]`, see `information`.
        noise: `N`, the sum of the weighted rows' covariances, see `accumulated_noise`.
        count: rows behind them; without it there is no covariance.

    Returns:
        The fit, `not_positive` where the noise assumed exceeds the data.

    Source: Fuller (1987), Measurement Error Models, section 2.2.

    Example:
        >>> import jax.numpy as jnp
        >>> fit = bias_compensated_least_squares(jnp.array([[2.0, 2.0], [2.0, 3.0]]), jnp.diag(jnp.array([1.0, 0.0])))
        >>> fit.theta.tolist()
        [2.0]
    """
    return _fit(_bias_compensated_least_squares, count, information, noise)


def _each(matrices: int) -> Callable[[Callable[..., tuple[Array, ...]]], Callable[..., tuple[Array, ...]]]:
    """A fit of single matrices and a count, compiled for every member of a batch of them."""
    core = ",".join(["(p,p)"] * matrices)
    return lambda one: jax.jit(jnp.vectorize(one, signature=f"{core},()->(n),(n,n),(),(),()"))


def _held(
    theta: Array, cov: Array, scale: Array, gap: Any, status: Array, good: Bool[Array, ""]
) -> tuple[Array, Array, Array, Array, Array]:
    """The fit with NaN where there is none."""
    return (
        jnp.where(good, theta, jnp.nan),
        jnp.where(good, cov, jnp.nan),
        scale,
        jnp.asarray(gap, theta.dtype),
        status.astype(jnp.int32),
    )


@_each(matrices=1)
def _least_squares(S: Array, m: Array) -> tuple[Array, ...]:
    n = len(S) - 1
    _, inverse, _ = root_and_inverse(S[:n, :n])
    theta = inverse.T @ (inverse @ S[:n, n])
    enough = jnp.all(jnp.diagonal(inverse) > 0) & ~(m < n)
    a = jnp.append(theta, -jnp.ones((), theta.dtype))
    variance = jnp.maximum(a @ (S @ a), 0.0) / jnp.where(m > n, m - n, jnp.nan)
    status = jnp.where(enough, Status.ok, Status.insufficient_data)
    return _held(theta, variance * product(inverse.T, inverse), variance, jnp.inf, status, enough)


@_each(matrices=2)
def _generalized_total_least_squares(S: Array, N: Array, m: Array) -> tuple[Array, ...]:
    n = len(S) - 1
    # Factored at unit columns, so that no unit decides what is small.
    scale = 1.0 / jnp.sqrt(jnp.where(jnp.diagonal(S) > 0, jnp.diagonal(S), 1.0))
    half = inverse_of(root(S * scale[:, None] * scale)[0]) * scale
    spectrum, vectors = jnp.linalg.eigh(symmetrize(congruence(half, N)))
    largest = jnp.where(spectrum[-1] > 0, spectrum[-1], 1.0)
    theta, generic = parameters_of((half.T @ vectors[:, -1]) / scale)
    theta, generic = theta * scale[:n] / scale[n], generic & (spectrum[-1] > 0)
    gap = largest / jnp.maximum(spectrum[-2], jnp.finfo(S.dtype).eps * largest)
    level = 1.0 / largest
    factor = level / jnp.where(m > n, 1.0 - n / m, jnp.nan)
    cov, valid = information_covariance((S - level * N)[:n, :n], factor * N, theta, m)
    enough = ~(m < n + 1) & jnp.all(jnp.diagonal(S)[:n] > 0)
    apart = (valid | ~jnp.isfinite(m)) & (spectrum[0] >= -1e-9 * largest)
    status = jnp.where(apart, jnp.where(generic, Status.ok, Status.nongeneric), Status.ill_separated)
    status = jnp.where(enough, status, Status.insufficient_data)
    return _held(theta, cov, factor, gap, status, status == Status.ok)


@_each(matrices=2)
def _bias_compensated_least_squares(S: Array, N: Array, m: Array) -> tuple[Array, ...]:
    n = len(S) - 1
    excess, right = (S - N)[:n, :n], (S - N)[:n, n]
    _, inverse, _ = root_and_inverse(excess)
    positive = jnp.all(jnp.diagonal(inverse) > 0)
    theta = inverse.T @ (inverse @ right)
    a = jnp.append(theta, -jnp.ones((), theta.dtype))
    assumed = a @ (N @ a)
    scale = (a @ (S @ a)) / jnp.where(assumed > 0, assumed, jnp.nan) / jnp.where(m > n, 1.0 - n / m, jnp.nan)
    half = inverse_of(root(S[:n, :n])[0])
    most = jnp.linalg.eigvalsh(symmetrize(congruence(half, N[:n, :n])))[-1]
    gap = jnp.where(most > 0, 1.0 / jnp.where(most > 0, most, 1.0), jnp.inf)
    cov, _ = information_covariance(excess, N, theta, m, known=True)
    status = jnp.where(positive, Status.ok, Status.not_positive)
    status = jnp.where(~(m < n), status, Status.insufficient_data)
    return _held(theta, cov, scale, gap, status, status == Status.ok)


def _fit(method: Callable[..., tuple[Array, ...]], count: Any, *matrices: Any) -> Fit:
    rows = jnp.nan if count is None else count
    return Fit(*method(*(jnp.asarray(each, dtype=float) for each in (*matrices, rows))))
