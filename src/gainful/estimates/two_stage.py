"""The two-stage estimate: a state apart from the biases that drive it."""

from __future__ import annotations

from typing import Self

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..linalg import (
    congruence,
    inverse_lower,
    joseph,
    product,
    root,
    root_and_inverse,
    symmetrize,
    times_inverse,
    triangularize,
)
from ..spaces import AbstractSpace
from .affine import Affine
from .base import AbstractEstimate, Innovation, backward_gain, residual_of


class TwoStage(AbstractEstimate):
    """`x = x~ + V b` with `x~` independent of the biases `b`: the joint estimate in separated coordinates.

    The biases are the degrees of freedom that were added to the model (`space.added`): parameters, biases, faults.

    ```
    P = [[P~ + V Pb V^T, V Pb], [Pb V^T, Pb]]
    push       W = F11 V + F12;  G = F21 V + F22;  Pb' = F21 P~ F21^T + G Pb G^T + N22
               V' = (F11 P~ F21^T + W Pb G^T + N12) Pb'^-1;  P~' = D1 P~ D1^T + D2 Pb D2^T + [I, -V'] N [I, -V']^T
               with D1 = F11 - V' F21, D2 = W - V' G
    condition  S~ = Hx P~ Hx^T + R;  K~ = P~ Hx^T S~^-1;  C = Hx V + Hb;  S = S~ + C Pb C^T;  Kb = Pb C^T S^-1
               V' = V - K~ C;  db = Kb r;  dx = K~ r + V' db;  P~ and Pb in Joseph form
    ```

    Every covariance is a sum of squares, and the mean is the total one, so large biases and curved spaces do no harm.

    Attributes:
        mean: a point of the space (size,).
        base_cov: `P~` (dof - added, dof - added).
        bias_cov: `Pb` (added, added).
        coupling: `V` (dof - added, added).
        space: where the state lives.

    Source: Friedland (1969), IEEE Trans. Autom. Control 14(4):359-367; Hsieh and Chen (1999), IEEE Trans. Autom. Control
        44(1):194-199; general transitions: Hsieh and Chen (2000), 45(4):819-824.
    Differs: total mean, sums of squares in place of differences, transitions of any form.
    Reduces to: `Gaussian`, which it equals to rounding.

    Example:
        >>> import jax.numpy as jnp
        >>> from gainful.spaces import Euclidean, Product
        >>> space = Product([Euclidean(("x",)), Euclidean(("bias",))], added=1)
        >>> TwoStage.start(jnp.zeros(2), jnp.array([[5.0, 2.0], [2.0, 4.0]]), space).coupling.tolist()
        [[0.5]]
    """

    mean: Float[Array, " size"]
    base_cov: Float[Array, "n n"]
    bias_cov: Float[Array, "p p"]
    coupling: Float[Array, "n p"]
    space: AbstractSpace

    # Written out, since type checkers would take the abstract `cov` and `factor` for further arguments.
    def __init__(
        self,
        mean: Float[Array, " size"],
        base_cov: Float[Array, "n n"],
        bias_cov: Float[Array, "p p"],
        coupling: Float[Array, "n p"],
        space: AbstractSpace,
    ):
        self.mean = mean
        self.base_cov = base_cov
        self.bias_cov = bias_cov
        self.coupling = coupling
        self.space = space

    @classmethod
    def start(cls, mean: Float[Array, " size"], cov: Float[Array, "dof dof"], space: AbstractSpace) -> Self:
        n = space.dof - space.added
        none = cls(mean, jnp.zeros((n, n), cov.dtype), cov[n:, n:] * 0.0, cov[:n, n:] * 0.0, space)
        return none._moved(jnp.eye(space.dof, dtype=cov.dtype), cov, mean, space)

    @property
    def cov(self) -> Float[Array, "dof dof"]:
        shared = product(self.coupling, self.bias_cov)
        state = symmetrize(self.base_cov + product(shared, self.coupling.T))
        return jnp.block([[state, shared], [shared.T, self.bias_cov]])

    @property
    def factor(self) -> Float[Array, "dof dof"]:
        base, _ = root(self.base_cov)
        bias, _ = root(self.bias_cov)
        beneath = jnp.zeros((bias.shape[0], base.shape[1]), base.dtype)
        return triangularize(jnp.block([[product(self.coupling, bias), base], [bias, beneath]]))

    @property
    def roots(self) -> tuple[Float[Array, "dof dof"], Float[Array, "dof dof"]]:
        factor = self.factor
        return factor, inverse_lower(factor)

    def push(self, affine: Affine) -> Self:
        return self._moved(affine.matrix, affine.covariance(), affine.predict(self.mean), affine.outer)

    def condition(
        self,
        affine: Affine,
        y: Float[Array, " out_size"],
        seen: Bool[Array, " out"],
        *,
        gain: Float[Array, "dof out"] | None = None,
    ) -> tuple[Self, Innovation]:
        n, noise = self.base_cov.shape[0], affine.covariance()
        state = affine.matrix[:, :n]
        coupled = product(state, self.coupling) + affine.matrix[:, n:]
        own = symmetrize(congruence(state, self.base_cov) + noise)
        spread = symmetrize(own + congruence(coupled, self.bias_cov))
        lower, inverse, _ = root_and_inverse(spread)
        residual = residual_of(affine, self.mean, y, seen)
        innovation = Innovation(residual, spread, lower, inverse, seen, jnp.all(jnp.diagonal(lower) > 0))
        if gain is not None:
            return self._corrected(gain, gain @ residual, affine.matrix, noise), innovation
        _, own_inverse, _ = root_and_inverse(own)
        gain_state = times_inverse(product(state, self.base_cov), own_inverse)
        gain_bias = times_inverse(product(coupled, self.bias_cov), inverse)
        coupling = self.coupling - product(gain_state, coupled)
        bias = gain_bias @ residual
        mean = self.space.plus(self.mean, jnp.concatenate([gain_state @ residual + coupling @ bias, bias]))
        return type(self)(
            mean,
            joseph(self.base_cov, gain_state, state, noise),
            joseph(self.bias_cov, gain_bias, coupled, own),
            coupling,
            self.space,
        ), innovation

    def plus_noise(self, cov: Float[Array, "dof dof"]) -> Self:
        return self._moved(jnp.eye(self.space.dof, dtype=cov.dtype), cov, self.mean, self.space)

    def revise(self, affine: Affine, future: Self) -> Self:
        gain = backward_gain(affine, self.cov)
        moved = gain @ affine.outer.minus(future.mean, affine.predict(self.mean))
        return self._corrected(gain, moved, affine.matrix, affine.covariance() + future.cov)

    def _corrected(self, gain: Array, move: Array, matrix: Array, noise: Array) -> Self:
        """The estimate moved, its covariance in Joseph form for any gain."""
        keep = jnp.eye(self.space.dof, dtype=gain.dtype) - product(gain, matrix)
        return self._moved(keep, congruence(gain, noise), self.space.plus(self.mean, move), self.space)

    def _moved(
        self, matrix: Float[Array, "out dof"], noise: Float[Array, "out out"], mean: Array, space: AbstractSpace
    ) -> Self:
        """The estimate with covariance `F P F^T + N`, in its own coordinates."""
        n, m = self.base_cov.shape[0], space.dof - space.added
        (f11, f12), (f21, f22) = ((block[:, :n], block[:, n:]) for block in (matrix[:m], matrix[m:]))
        across, along = product(f11, self.coupling) + f12, product(f21, self.coupling) + f22
        bias_cov = symmetrize(congruence(f21, self.base_cov) + congruence(along, self.bias_cov) + noise[m:, m:])
        shared = product(product(f11, self.base_cov), f21.T) + product(product(across, self.bias_cov), along.T)
        _, inverse, _ = root_and_inverse(bias_cov)
        coupling = times_inverse((shared + noise[:m, m:]).T, inverse)
        left = jnp.concatenate([jnp.eye(m, dtype=noise.dtype), -coupling], axis=1)
        base_cov = (
            congruence(f11 - product(coupling, f21), self.base_cov)
            + congruence(across - product(coupling, along), self.bias_cov)
            + congruence(left, noise)
        )
        return type(self)(mean, symmetrize(base_cov), bias_cov, coupling, space)
