"""Jumps of biases: found, sized, dated and taken into the estimate."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..linalg import product, times_inverse
from ..models import AbstractModel, Sample
from ..updates.adaptation import check_bounds, ridge_of
from .base import AbstractEstimator, Info
from .kalman import Carry, KalmanFilter


class Jumps(eqx.Module):
    """What the jump hypotheses remember.

    Attributes:
        quiet: memory of the filter.
        signature: error a unit jump has caused by now, per onset (oldest first) and bias (window, dof, p).
        score: `d`, correlation of the innovations with what each jump would have caused (window, p).
        information: `c`, information about each jump's size (window, p).
        ridge: inverse squares of the largest biases that are possible (p,).
        count: samples with a measurement so far.
    """

    quiet: Carry
    signature: Float[Array, "window dof p"]
    score: Float[Array, "window p"]
    information: Float[Array, "window p"]
    ridge: Float[Array, " p"]
    count: Int[Array, ""]


class JumpReport(eqx.Module):
    """What the jump hypotheses found at a sample.

    Attributes:
        statistic: largest log likelihood ratio (times two) per bias (p,).
        alarm: whether a jump was taken into the estimate.
        bias: which of the added states jumped, counted from 0; -1 without an alarm.
        age: samples since its onset.
        size: of the jump; 0 without an alarm.
    """

    statistic: Float[Array, " p"]
    alarm: Bool[Array, ""]
    bias: Int[Array, ""]
    age: Int[Array, ""]
    size: Float[Array, ""]


class GeneralizedLikelihoodRatio(AbstractEstimator):
    """A filter of constant or slow biases that asks at each sample whether one of them jumped in the last `window` samples.

    ```
    E <- F E, with [0; I] for a jump now;  G = H E;  d += G^T S^-1 r;  c += diag(G^T S^-1 G);  E <- (I - K H) E
    l = d^2 / (c + b_max^-2);  alarm if max l > threshold:  x <- x [+] e d / c',  P <- P + e e^T / c',  c' = c + b_max^-2
    ```

    A jump found is put into the estimate at once, with the uncertainty of its size, and the search begins anew. Between
    jumps the estimate is that of the quiet filter.

    Attributes:
        quiet: the filter; its updates must use the optimal gain.
        window: onsets looked back on [samples].
        threshold: of the statistic, chi-square with one degree for one fixed onset; calibrate it for a false-alarm rate.
        bounds: largest size of a bias that is possible, by the name of its state.
        hold: measured samples before the first alarm, for the start's transient.

    Source: Willsky and Jones (1976), IEEE Trans. Autom. Control 21(1):108-112.
    Differs: jumps bounded by a prior of standard deviation `b_max`, which keeps the ratio finite where a bias is not seen.
    Reduces to: `quiet` for an infinite threshold.
    """

    quiet: KalmanFilter = KalmanFilter()
    window: int = eqx.field(static=True, default=60)
    threshold: float = 30.0
    bounds: dict[str, float] = eqx.field(default_factory=dict)
    hold: int = eqx.field(static=True, default=0)

    def __check_init__(self) -> None:
        if not isinstance(self.window, int) or self.window < 1:
            raise ConfigError(f"window: expected a whole number of at least 1, got {self.window!r}")
        if isinstance(self.threshold, (int, float)) and not self.threshold > 0:
            raise ConfigError(f"threshold: expected a number above 0, got {self.threshold!r}")
        check_bounds(self.bounds)

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> Jumps:
        space, dtype = model.space, prior.mean.dtype
        p = space.added
        if not p:
            raise ConfigError("model: expected added states (biases, faults) that can jump, got none; see augment")
        return Jumps(
            self.quiet.init(model, prior),
            jnp.zeros((self.window, space.dof, p), dtype),
            jnp.zeros((self.window, p), dtype),
            jnp.zeros((self.window, p), dtype),
            ridge_of(self.bounds, space).astype(dtype),
            jnp.array(0),
        )

    def step(self, model: AbstractModel, carry: Jumps, sample: Sample) -> tuple[Jumps, Info]:
        transition = self.quiet.transition_map(model, carry.quiet, sample).matrix
        transition = jnp.where(sample.when.dt > 0, transition, jnp.eye(len(transition), dtype=transition.dtype))
        quiet, info, update = self.quiet.advance(model, carry.quiet, sample)
        matrix, inverse = update.affine.matrix, update.innovation.inverse
        dof, p = carry.signature.shape[1:]
        fresh = jnp.eye(dof, dtype=matrix.dtype)[:, dof - p :]
        moved = jax.vmap(lambda each: product(transition, each))(carry.signature[1:])
        signature = jnp.concatenate([moved, fresh[None]])
        caused = jax.vmap(lambda each: product(inverse, product(matrix, each)))(signature)
        score = _shifted(carry.score) + jnp.einsum("wmp,m->wp", caused, update.innovation.whitened)
        information = _shifted(carry.information) + jnp.sum(caused**2, axis=1)
        gain = times_inverse(product(matrix, update.prior.cov), inverse)
        keep = jnp.eye(dof, dtype=matrix.dtype) - product(gain, matrix)
        signature = jax.vmap(lambda each: product(keep, each))(signature)
        count = carry.count + jnp.any(sample.seen)
        certainty = information + carry.ridge
        ratio = score**2 / jnp.where(certainty > 0, certainty, jnp.inf)
        onset, bias = jnp.unravel_index(jnp.argmax(ratio), ratio.shape)
        alarm = (ratio[onset, bias] > self.threshold) & (count > self.hold) & jnp.any(sample.seen)
        size = score[onset, bias] / certainty[onset, bias]
        effect = signature[onset, :, bias]
        space = model.space
        jumped = quiet.estimate.plus_noise(jnp.outer(effect, effect) / certainty[onset, bias])
        jumped = eqx.tree_at(lambda each: each.mean, jumped, space.plus(quiet.estimate.mean, effect * size))
        estimate = jax.tree.map(lambda new, old: jnp.where(alarm, new, old), jumped, quiet.estimate)
        report = JumpReport(
            jnp.max(ratio, axis=0),
            alarm,
            jnp.where(alarm, bias, -1),
            jnp.where(alarm, self.window - 1 - onset, 0),
            jnp.where(alarm, size, 0.0),
        )
        empty = jnp.where(alarm, 0.0, 1.0).astype(matrix.dtype)
        held = Carry(estimate, quiet.update, quiet.noise)
        after = Jumps(held, signature * empty, score * empty, information * empty, carry.ridge, count)
        return after, eqx.tree_at(lambda each: (each.estimate, each.memory), info, (estimate, report))


def _shifted(values: Float[Array, "window p"]) -> Float[Array, "window p"]:
    return jnp.concatenate([values[1:], jnp.zeros_like(values[:1])])
