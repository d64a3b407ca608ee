"""Sigma points over the state alone, for functions that are affine in the biases."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate, Affine, TwoStage
from ..linalg import congruence, inverse_lower, product, root, root_and_inverse, triangularize
from ..spaces import AbstractSpace
from .base import AbstractLinearization
from .rules import AbstractRule, Unscented
from .sigma_points import regression, signed_columns

FORMS = ("bias_free", "rao_blackwell")


class MarginalSigmaPoints(AbstractLinearization):
    """Regression over the `n` states, the `p` added ones entering through differences: `2 n + 1` points, not `2 (n + p) + 1`.

    With `x = x~ + V b` (see `TwoStage`) and `f(x, b) = g(x) + B(x) b`:

    ```
    bias_free      points from P~ about m, b at its estimate:  y = value + A (x - m) + B(m) (b - m_b)
    rao_blackwell  points from P_x about m, b_i = E[b | x_i]:  y = value + (A - B' G) (x - m) + B' (b - m_b),
                   G = P_b V^T P_x^-1,  B' = mean of B(x_i),  error + spread of B(x_i) root(cov(b | x))
    ```

    The differences along a bias are exact for functions affine in it, whatever their step, so there is no Jacobian.
    `rao_blackwell` loses nothing against points over the joint state; `bias_free` leaves out the curvature along `V b`.

    Attributes:
        rule: where the points lie.
        form: "bias_free" or "rao_blackwell".

    Source: Morelande and Ristic (2006), Int. Conf. Inf. Fusion (reduced sigma points); bias-free points as in the two-stage
        unscented filters, Chen et al. (2019), Acta Aeronaut. Astronaut. Sin. 40(5):322551.
    Differs: written as an affine map with its error, so no covariance is subtracted and any estimate can use it.
    Reduces to: `Taylor` for affine functions; `SigmaPoints` where nothing was added to the model.
    """

    rule: AbstractRule = Unscented()
    form: str = eqx.field(static=True, default="bias_free")

    def __check_init__(self) -> None:
        if self.form not in FORMS:
            raise ConfigError(f"form: {self.form!r} is not known; {did_you_mean(str(self.form), FORMS)}")

    def __call__(
        self,
        fn: Callable[[Float[Array, " in_size"]], Float[Array, " out_size"]],
        estimate: AbstractEstimate,
        out_space: AbstractSpace,
    ) -> Affine:
        at, space = estimate.mean, estimate.space
        parts = estimate if isinstance(estimate, TwoStage) else TwoStage.start(at, estimate.cov, space)
        n, p = parts.coupling.shape
        rule = self.rule.points(n)
        unit = jnp.asarray(rule[0], at.dtype)
        deviations = jnp.sqrt(jnp.diagonal(parts.bias_cov))
        steps = jnp.where(deviations > 0, deviations, 1.0)
        along = jnp.concatenate([jnp.zeros((p, n), at.dtype), jnp.diag(steps)], axis=1)

        def images(moves: Float[Array, "k dof"]) -> Float[Array, "k out_size"]:
            return jax.vmap(lambda d: fn(space.plus(at, d)))(moves)

        def slopes(moved: Float[Array, "p out_size"], still: Array, value: Array) -> Float[Array, "out p"]:
            base = out_space.minus(still, value)
            return jax.vmap(lambda y: out_space.minus(y, value) - base, out_axes=1)(moved) / steps

        noise = jnp.zeros((out_space.dof, out_space.dof), at.dtype)
        if self.form == "bias_free" or p == 0:
            base, inverse, _ = root_and_inverse(parts.base_cov)
            moves = jnp.concatenate([product(base, unit).T, jnp.zeros((unit.shape[1], p), at.dtype)], axis=1)
            # All in one call: a loop compiles every call of a model anew.
            here = jnp.zeros((1, n + p), at.dtype)
            points, moved, still = jnp.split(
                images(jnp.concatenate([moves, along, here])), [len(moves), len(moves) + p]
            )
            value, slope, left = regression(points, rule, out_space)
            deficit, error = signed_columns(left, rule[2])
            matrix = jnp.concatenate([product(slope, inverse), slopes(moved, still[0], value)], axis=1)
            return Affine(value, matrix, at, noise, error, deficit, space, out_space)
        bias, _ = root(parts.bias_cov)
        coupled = product(parts.coupling, bias)
        factor = triangularize(jnp.concatenate([coupled, root(parts.base_cov)[0]], axis=1))
        inverse = inverse_lower(factor)
        regress = product(product(product(inverse, coupled), bias.T).T, inverse)
        keep = jnp.eye(p, dtype=at.dtype) - product(regress, parts.coupling)
        unexplained, _ = root(congruence(keep, parts.bias_cov) + congruence(regress, parts.base_cov))
        states = product(factor, unit)
        moves = jnp.concatenate([states, product(regress, states)]).T
        still = images(moves)
        value, slope, left = regression(still, rule, out_space)
        moved = images((moves[:, None, :] + along[None]).reshape(-1, n + p)).reshape(moves.shape[0], p, -1)
        each = jax.vmap(slopes, in_axes=(0, 0, None))(moved, still, value)
        mean = jnp.einsum("k,kop->op", jnp.asarray(rule[1], at.dtype), each)
        deficit, error = signed_columns(left, rule[2])
        for j in range(p):
            spread = jnp.stack([product(one, unexplained)[:, j] for one in each - mean], axis=1)
            less, more = signed_columns(spread, rule[1])
            deficit, error = jnp.concatenate([deficit, less], axis=1), jnp.concatenate([error, more], axis=1)
        own = product(slope, inverse) - product(mean, regress)
        return Affine(value, jnp.concatenate([own, mean], axis=1), at, noise, error, deficit, space, out_space)
