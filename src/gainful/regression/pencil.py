"""The algebra errors-in-variables estimators share: the pencil `(S, N)` of information and accumulated noise.

`a = [theta; -1]` minimises `a^T S a / a^T N a`; with `S = X^-1 X^-T` it is `X^T y` for the dominant eigenvector `y` of
`X N X^T`. Taking `S` as the definite matrix lets `N` be singular, so that columns free of noise are no special case.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import Status
from ..estimates import Gaussian
from ..linalg import congruence, inverse_lower, product, root_and_inverse, symmetrize


class Separation(eqx.Module):
    """How far an errors-in-variables estimate stands out of the noise.

    Attributes:
        noise_scale: by which factor the rows are noisier than their weights and row noise say.
        gap: ratio of the second-smallest to the smallest eigenvalue of information against noise; 1 is no information,
            and its inverse what an inverse-power step leaves of an error.
        rows: that count, forgotten ones less: `(sum omega)^2 / sum omega^2`.
    """

    noise_scale: Float[Array, ""]
    gap: Float[Array, ""]
    rows: Float[Array, ""]


def inverse_of(lower: Float[Array, "p p"]) -> Float[Array, "p p"]:
    """`L^-1`, with pivots that are zero to rounding lifted to rounding: as for inverse iteration, their direction stays."""
    size = jnp.sqrt(jnp.sum(lower**2, axis=1))
    least = jnp.where(size > 0, jnp.finfo(lower.dtype).eps * size, 1.0)
    return inverse_lower(lower + jnp.diag(jnp.maximum(least - jnp.diagonal(lower), 0.0)))


def parameters_of(direction: Float[Array, " p"]) -> tuple[Float[Array, " n"], Bool[Array, ""]]:
    """`theta` of a direction `[theta; -1]`, and whether it is finite."""
    unit = direction / jnp.sqrt(jnp.sum(direction**2))
    last = unit[-1]
    generic = jnp.abs(last) >= 1e-10  # of a unit vector
    return -unit[:-1] / jnp.where(generic, last, 1.0), generic


def largest_noise_gap(rows: Float[Array, ""], width: int) -> Float[Array, ""]:
    """The largest eigenvalue ratio that `rows` rows of pure white noise of this width would show; infinite for fewer.

    Source: Marchenko and Pastur (1967), Math. USSR Sb. 1(4):457-483.
    """
    x = jnp.sqrt(width / jnp.maximum(rows, 1.0))
    return jnp.where(x < 1, ((1 + x) / jnp.where(x < 1, 1 - x, 1.0)) ** 2, jnp.inf)


def information_covariance(
    excess: Float[Array, "n n"],
    noise: Float[Array, "p p"],
    theta: Float[Array, " n"],
    count: Float[Array, ""],
    *,
    known: bool = False,
) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """Covariance of an estimate from noisy rows, and whether it is one if `N` is.

    ```
    A^-1 (v A + v N_hh -+ m c c^T) A^-1,   v = a^T N a / m,   c = -(N a)_h / m,   + where the noise is known
    ```

    Args:
        excess: `A`, information of the regressors less their noise.
        noise: `N`, noise of all rows together, scaled to what it is.
        theta: the estimate.
        count: rows `m`.
        known: the noise's scale was known beforehand, not estimated along with theta.

    Source: Fuller (1987), Measurement Error Models, sections 2.3 and 4.1; exact to first order for normal noise.
    """
    n = len(theta)
    a = jnp.append(theta, -jnp.ones((), theta.dtype))
    turned = noise @ a
    variance = (a @ turned) / count
    c = turned[:n] / count
    _, inverse, valid = root_and_inverse(symmetrize(excess))
    valid &= jnp.all(jnp.diagonal(inverse) > 0) & (variance >= 0)
    bread = product(inverse.T, inverse)
    cross = count * jnp.outer(c, c)
    inner = variance * noise[:n, :n] + (cross if known else -cross)
    cov = symmetrize(variance * bread + congruence(bread, symmetrize(inner)))
    return cov, valid


def judged(
    last: Gaussian,
    direction: Float[Array, " p"],
    information: Float[Array, "p p"],
    noise: Float[Array, "p p"],
    spectrum: Float[Array, " p"],
    count: Float[Array, ""],
    squares: Float[Array, ""],
    gate: bool,
) -> tuple[Gaussian, Separation, Int[Array, ""]]:
    """The estimate along a direction if the data allow one, else the last; how far it stands out; and what became of it.

    Args:
        last: the estimate so far.
        direction: proportional to `[theta; -1]`.
        information: `S`, weighted sum of the rows' squares.
        noise: `N`, sum of the noise of the weighted rows.
        spectrum: eigenvalues of `S^-1 N`, rising.
        count: sum of the rows' forgetting weights.
        squares: sum of the squares of those weights.
        gate: whether the gap must exceed what noise alone would show.
    """
    p = len(direction)
    theta, generic = parameters_of(direction)
    least, eps = jnp.finfo(spectrum.dtype).tiny, jnp.finfo(spectrum.dtype).eps
    rows = count**2 / jnp.maximum(squares, least)
    largest = spectrum[-1]
    safe = jnp.where(largest > 0, largest, 1.0)
    gap = safe / jnp.maximum(spectrum[-2], eps * safe)
    level = 1.0 / safe
    enough = rows > p - 0.5  # rounding aside
    scale = level / jnp.maximum(1.0 - (p - 1) / jnp.maximum(rows, 1.0), 1.0 / jnp.maximum(rows, 1.0))
    excess = (information - level * noise)[:-1, :-1]
    cov, valid = information_covariance(excess, scale * noise, theta, jnp.maximum(count, 1.0))
    cov = cov * squares / jnp.maximum(count, least)
    # Noise that changes with the row may be no covariance until rows enough have averaged it.
    apart = valid & (largest > 0) & (spectrum[0] >= -1e-9 * largest) & jnp.all(jnp.isfinite(cov))
    if gate:
        apart &= gap > largest_noise_gap(rows, p)
    accepted = enough & apart & generic & jnp.all(jnp.isfinite(theta))
    estimate = jax.tree.map(lambda new, old: jnp.where(accepted, new, old), Gaussian(theta, cov, last.space), last)
    status = jnp.where(
        ~enough,
        Status.insufficient_data,
        jnp.where(~apart, Status.ill_separated, jnp.where(~accepted, Status.nongeneric, Status.ok)),
    )
    return estimate, Separation(scale, gap, rows), status.astype(jnp.int32)
