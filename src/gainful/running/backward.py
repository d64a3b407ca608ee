"""One step back in time: what a later row tells of the one before it."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..estimates import AbstractEstimate, Affine
from ..filters import Carry, KalmanFilter
from ..models import AbstractModel, Sample


def neighbours(filtered: Any, counted: Array, samples: Sample) -> tuple[Any, Any]:
    """Each row but the last with what followed it, stacked along time.

    Args:
        filtered: the estimates after each row, and the memories of the filter's parts.
        counted: whether each row's update was made.
        samples: of all rows.
    """
    now = jax.tree.map(lambda values: values[:-1], filtered)
    return now, jax.tree.map(lambda values: values[1:], (samples, filtered[1], counted))


def backward_map(parts: tuple[KalmanFilter, AbstractModel], now: Any, after: Any) -> Affine:
    """The map by which the filter left a row, formed again, with all the noise that its update put in.

    Args:
        parts: the filter and its model.
        now: estimate and memory after the row.
        after: sample, memory and whether the update was made, of the row that followed.
    """
    (estimator, model), (estimate, memory), (following, remembered, counted) = parts, now, after
    carry = Carry(estimate, *memory)
    affine = estimator.transition_map(model, carry, following)
    process = estimator.process_noise(model, carry, following)
    extra = estimator.update.added(remembered[0], estimate.push(affine), process)
    return affine if extra is None else affine.plus_noise(jnp.where(counted, extra, 0.0))


def revised(estimate: AbstractEstimate, affine: Affine, future: AbstractEstimate) -> AbstractEstimate:
    """The estimate of a row given that of the next; itself where no finite map leads there."""
    new = estimate.revise(affine, future)
    # Across a step whose map is not finite the filter kept its last estimate, and nothing later speaks of this one.
    crossed = jnp.all(jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(affine)]))
    return jax.tree.map(lambda new, old: jnp.where(crossed, new, old), new, estimate)


def with_last(body: AbstractEstimate, all_rows: AbstractEstimate) -> AbstractEstimate:
    """Estimates of all rows but the last, completed by the filter's own last one."""
    return jax.tree.map(lambda values, whole: jnp.concatenate([values, whole[-1:]]), body, all_rows)
