"""Roots of an inverse covariance: what makes correlated residuals uncorrelated and of unit size."""

from __future__ import annotations

from typing import Any, Literal

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from .products import product
from .psd import root_and_inverse

Whitening = Literal["zca-cor", "cholesky", "symmetric"]
"""Which root: see `whitening_root`."""

NEWTON = 10
"""Iterations, scaled: nine reach rounding from a condition number of 1e16."""

WHITENINGS: tuple[Whitening, ...] = ("zca-cor", "cholesky", "symmetric")


def whitening_root(cov: Float[Array, "m m"], kind: Whitening = "zca-cor") -> Float[Array, "m m"]:
    """A matrix `T` with `T S T^T = I`.

    ```
    zca-cor    C^-1/2 diag(S)^-1/2, C the correlations: does not depend on units or on the order of the components
    cholesky   L^-1 with S = L L^T: does not depend on units, but on the order
    symmetric  S^-1/2: does not depend on the order, but on units; inaccurate where these differ by many decades
    ```

    Args:
        cov: positive definite.
        kind: of root.

    Raises:
        ConfigError: an unknown kind.

    Source: Kessy, Lewin and Strimmer (2018), The American Statistician 72(4):309-314.

    Example:
        >>> import jax.numpy as jnp
        >>> whitening_root(jnp.array([[4.0]])).tolist()
        [[0.5]]
    """
    check_whitening(kind)
    if kind == "cholesky":
        return root_and_inverse(cov)[1]
    if kind == "symmetric":
        return _inverse_square_root(cov)
    scale = 1.0 / jnp.sqrt(jnp.diagonal(cov))
    correlation = cov * scale[:, None] * scale[None, :]
    return _inverse_square_root(correlation) * scale[None, :]


def check_whitening(kind: str) -> None:
    """Raise unless the kind of root is known."""
    if kind not in WHITENINGS:
        raise ConfigError(f"whitening: {kind!r} is not known; {did_you_mean(str(kind), WHITENINGS)}")


def _inverse_square_root(cov: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """`C^-1/2 = Q L^-1` with `C = L L^T` and `Q` the orthogonal factor of `L`: exact whitening as far as `Q` is orthogonal.

    Newton's iteration for `Q` stays inside a compiled loop, where a call for eigenvectors would not, and has derivatives
    where eigenvalues are equal.

    Source: Higham (1986), SIAM J. Sci. Stat. Comput. 7(4):1160-1174.
    """
    lower, inverse, _ = root_and_inverse(cov)
    if cov.shape[0] == 1:
        return inverse

    def newton(_: Any, q: Array) -> Array:
        _, half, _ = root_and_inverse(product(q.T, q))
        other = product(product(q, half.T), half)  # the inverse of Q^T
        scale = jnp.sqrt(jnp.sqrt(jnp.sum(other**2) / jnp.sum(q**2)))
        return 0.5 * (scale * q + other / scale)

    return product(jax.lax.fori_loop(0, NEWTON, newton, lower), inverse)
