"""The affine map every linearization produces and every estimate consumes."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..linalg import product, root
from ..spaces import AbstractSpace


class Affine(eqx.Module):
    """`y = value [+] (A (x [-] at) + e)` with `cov(e) = noise + error error^T - deficit deficit^T`.

    Attributes:
        value: the function at `at`, or its mean: a point of the output space.
        matrix: `A` (out dof, in dof).
        at: the point the map is centred on.
        noise: covariance of the model's own noise (out dof, out dof).
        error: columns of the linearization error, zero columns for a Taylor expansion (out dof, k).
        deficit: columns to take away, one where a sigma-point rule has a negative centre weight (out dof, 0 or 1).
        inner: space of `x`.
        outer: space of `y`.
    """

    value: Float[Array, " out_size"]
    matrix: Float[Array, "out in"]
    at: Float[Array, " in_size"]
    noise: Float[Array, "out out"]
    error: Float[Array, "out k"]
    deficit: Float[Array, "out j"]
    inner: AbstractSpace
    outer: AbstractSpace

    def plus_noise(self, noise: Float[Array, "out out"]) -> Affine:
        """The map with more model noise."""
        return eqx.tree_at(lambda affine: affine.noise, self, self.noise + noise)

    def predict(self, x: Float[Array, " in_size"]) -> Float[Array, " out_size"]:
        """The mean of `y` where the mean of the input is `x`."""
        if x is self.at:  # the commonest case: linearised where the estimate is
            return self.value
        return self.outer.plus(self.value, self.matrix @ self.inner.minus(x, self.at))

    def covariance(self) -> Float[Array, "out out"]:
        """Covariance of `e`."""
        cov = self.noise
        if self.error.shape[1]:
            cov = cov + product(self.error, self.error.T)
        if self.deficit.shape[1]:
            cov = cov - product(self.deficit, self.deficit.T)
        return cov

    def columns(self) -> Float[Array, "out k"]:
        """Columns `C` with `C C^T = noise + error error^T`, formed without squaring; `deficit` is still to be taken away."""
        return jnp.concatenate([root(self.noise)[0], self.error], axis=1)

    def masked(self, seen: Bool[Array, " out"]) -> Affine:
        """The map with unseen components cut off: no dependence on `x`, unit noise of their own."""
        row = seen[:, None]
        both = row & seen[None, :]
        unit = jnp.diag(jnp.where(seen, 0.0, 1.0).astype(self.noise.dtype))
        return eqx.tree_at(
            lambda affine: (affine.matrix, affine.noise, affine.error, affine.deficit),
            self,
            (
                jnp.where(row, self.matrix, 0.0),
                jnp.where(both, self.noise, unit),
                jnp.where(row, self.error, 0.0),
                jnp.where(row, self.deficit, 0.0),
            ),
        )
