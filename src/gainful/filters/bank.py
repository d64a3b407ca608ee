"""Several filters on one record, weighed by how well each predicts it."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, Status
from ..estimates import AbstractEstimate
from ..linalg import gaussian_log_density, product, root_and_inverse
from ..models import AbstractModel, Sample
from .base import AbstractEstimator, Info
from .kalman import Carry, KalmanFilter


class Bank(eqx.Module):
    """What a bank remembers: its members' memories and how probable each is."""

    members: tuple[Carry, ...]
    probabilities: Float[Array, " members"]


class InteractingMultipleModel(AbstractEstimator):
    """Members that differ in their parts, with estimates mixed before each step as if the truth jumped between them.

    ```
    c_j = sum_i T_ij mu_i;  mix i into j with T_ij mu_i / c_j;  step each;  mu_j ~ c_j N(r_j; 0, S_j)
    ```

    The estimate has the mean and covariance of the mixture. Its innovation is that of the predicted mixture.

    Attributes:
        members: filters with the same coordinates of the estimate, such as one with quiet and one with jumping biases.
        transition: `T`, probability per step of going from one member to another, rows summing to 1 (members, members).
        start: probabilities before the first sample; equal if None.

    Source: Blom and Bar-Shalom (1988), IEEE Trans. Autom. Control 33(8):780-783.
    Differs: means are mixed in the tangent space of the member that is mixed into.
    Reduces to: its member, for members that are equal.
    """

    members: tuple[KalmanFilter, ...] = (KalmanFilter(),)
    transition: tuple[tuple[float, ...], ...] = ((1.0,),)
    start: tuple[float, ...] | None = None

    def __check_init__(self) -> None:
        count = len(self.members)
        if not count:
            raise ConfigError("members: expected at least one filter, got none")
        if len({member.estimate for member in self.members}) > 1:
            raise ConfigError("members: expected filters with the same coordinates of the estimate")
        table = np.asarray(self.transition, dtype=float)
        if table.shape != (count, count) or (table < 0).any() or (abs(table.sum(axis=1) - 1.0) > 1e-9).any():
            raise ConfigError(
                f"transition: expected {count} rows of {count} probabilities that sum to 1, got {self.transition}"
            )
        first = np.full(count, 1.0 / count) if self.start is None else np.asarray(self.start, dtype=float)
        if first.shape != (count,) or (first < 0).any() or abs(first.sum() - 1.0) > 1e-9:
            raise ConfigError(f"start: expected {count} probabilities that sum to 1, got {self.start}")

    def init(self, model: AbstractModel, prior: AbstractEstimate) -> Bank:
        count = len(self.members)
        first = jnp.full(count, 1.0 / count) if self.start is None else jnp.asarray(self.start)
        members = tuple(member.init(model, prior) for member in self.members)
        return Bank(members, first.astype(prior.mean.dtype))

    def step(self, model: AbstractModel, carry: Bank, sample: Sample) -> tuple[Bank, Info]:
        estimates = [member.estimate for member in carry.members]
        moving = sample.when.dt > 0  # the truth jumps between samples, never at one
        table = jnp.asarray(self.transition, carry.probabilities.dtype)
        joint = jnp.where(moving, table, jnp.eye(len(table), dtype=table.dtype)) * carry.probabilities[:, None]
        predicted = jnp.sum(joint, axis=0)
        shares = joint / jnp.where(predicted > 0, predicted, 1.0)
        memories = []
        for j, memory in enumerate(carry.members):
            mixed = _mixture(estimates, shares[:, j], j)
            own = jax.tree.map(lambda new, old: jnp.where(moving, new, old), mixed, memory.estimate)
            memories.append(eqx.tree_at(lambda held: held.estimate, memory, own))
        afters, infos = _stepped(self.members, model, memories, sample)
        failed = jnp.stack([(info.status == Status.not_positive) | (info.status == Status.nonfinite) for info in infos])
        densities = jnp.stack([info.log_likelihood for info in infos])
        log_weights = jnp.log(jnp.maximum(predicted, jnp.finfo(predicted.dtype).tiny)) + jnp.where(
            failed, -jnp.inf, densities
        )
        total = jax.scipy.special.logsumexp(log_weights)
        judged = jnp.any(sample.seen) & ~jnp.all(failed)
        probabilities = jnp.where(judged, jnp.exp(log_weights - total), predicted)
        best = jnp.argmax(probabilities)
        estimate = _mixture([info.estimate for info in infos], probabilities, 0)
        residuals = jnp.stack([each.residual for each in infos])
        residual = predicted @ residuals
        apart = residuals - residual
        spread = jnp.einsum("k,kij->ij", predicted, jnp.stack([each.residual_cov for each in infos]))
        spread = spread + product((apart * predicted[:, None]).T, apart)
        lower, inverse, _ = root_and_inverse(spread)
        whitened = inverse @ residual
        info = Info(
            estimate,
            probabilities,
            residual,
            spread,
            jnp.sum(whitened**2),
            jnp.where(jnp.any(sample.seen), gaussian_log_density(whitened, lower, jnp.sum(sample.seen)), 0.0),
            probabilities @ jnp.stack([each.weight for each in infos]),
            jnp.stack([each.status for each in infos])[best],
        )
        return Bank(tuple(afters), probabilities), info


def _stepped(
    members: Sequence[KalmanFilter], model: AbstractModel, memories: Sequence[Carry], sample: Sample
) -> tuple[list[Carry], list[Info]]:
    """Every member's step: one program for all members where they differ in numbers only."""
    parts = [eqx.partition(member, lambda leaf: eqx.is_array(leaf) or isinstance(leaf, float)) for member in members]
    numbers, rests = zip(*parts, strict=True)
    shapes = [[jnp.shape(leaf) for leaf in jax.tree.leaves(tree)] for tree in numbers]
    alike = all(eqx.tree_equal(rest, rests[0]) is True for rest in rests) and all(each == shapes[0] for each in shapes)
    if len(members) == 1 or not alike:
        pairs = [member.step(model, memory, sample) for member, memory in zip(members, memories, strict=True)]
    else:
        stacked = [
            jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf) for leaf in leaves]), *trees)
            for trees in (numbers, memories)
        ]
        both = jax.lax.map(lambda each: eqx.combine(each[0], rests[0]).step(model, each[1], sample), tuple(stacked))
        pairs = [jax.tree.map(lambda leaf, j=j: leaf[j], both) for j in range(len(members))]
    return [after for after, _ in pairs], [info for _, info in pairs]


def _mixture(estimates: list[AbstractEstimate], weights: Float[Array, " members"], centre: int) -> AbstractEstimate:
    """The estimate with the mean and covariance of the weighted estimates, in the tangent space of one of them."""
    middle = estimates[centre]
    space = middle.space
    moves = jnp.stack([space.minus(each.mean, middle.mean) for each in estimates])
    shift = weights @ moves
    apart = moves - shift
    cov = jnp.einsum("k,kij->ij", weights, jnp.stack([each.cov for each in estimates]))
    cov = cov + product((apart * weights[:, None]).T, apart)
    return type(middle).start(space.plus(middle.mean, shift), cov, space)
