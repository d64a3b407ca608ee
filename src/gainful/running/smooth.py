"""Estimates that use the whole record."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..errors import ModelError, Status
from ..estimates import AbstractEstimate
from ..filters import Carry, KalmanFilter
from ..models import AbstractModel, Sample
from .compiled import compiled_call
from .result import Result, Timing
from .run import samples_of


def smooth(result: Result) -> Result:
    """The Rauch-Tung-Striebel smoother, for every linearization and every estimate.

    ```
    G = P A^T (A P A^T + N)^-1;  m_s = m [+] G (m_s,next [-] m_predicted)
    P_s = (I - G A) P (I - G A)^T + G (N + P_s,next) G^T
    ```

    Across a step that could not be predicted nothing is carried back: the row before it keeps the filter's estimate.

    The maps between neighbours are formed again from the filter's estimates and its noise law's memory.

    Args:
        result: of a filter.

    Raises:
        ModelError: the result was not made by a Kalman filter, or is smoothed already.

    Source: Rauch, Tung and Striebel (1965), AIAA J. 3(8):1445-1450; Sarkka (2008), IEEE Trans. Autom. Control
        53(3):845-849 for sigma points.
    Differs: the covariance is a sum of squares, which stays positive semi-definite.
    """
    if not isinstance(result.estimator, KalmanFilter):
        raise ModelError(
            f"smooth: expected the result of a Kalman filter, got one of {type(result.estimator).__name__}"
        )
    if result.smoothed:
        raise ModelError("smooth: the result is smoothed already")
    samples = samples_of(result.log, result.prior.mean.dtype)
    begin = time.perf_counter()
    parts = (result.estimator, result.model)
    counted = jnp.isin(jnp.asarray(result.status), jnp.asarray([Status.ok, Status.rejected]))
    filtered = (result.estimates, result.memories)
    estimates, compile_seconds = compiled_call(_smooth, parts, filtered, counted, samples)
    estimates = jax.block_until_ready(estimates)
    timing = Timing(compile_seconds, time.perf_counter() - begin - compile_seconds)
    return dataclasses.replace(result, estimates=estimates, timing=timing, filtered=result)


def _smooth(
    parts: tuple[KalmanFilter, AbstractModel],
    filtered: tuple[AbstractEstimate, Any],
    counted: Array,
    samples: Sample,
) -> AbstractEstimate:
    estimator, model = parts

    def backward(future: AbstractEstimate, row: tuple[AbstractEstimate, Any, Sample, Any]) -> tuple[Any, Any]:
        estimate, memory, following, (remembered, counted) = row
        carry = Carry(estimate, *memory)
        affine = estimator.transition_map(model, carry, following)
        process = estimator.process_noise(model, carry, following)
        extra = estimator.update.added(remembered[0], estimate.push(affine), process)
        affine = affine if extra is None else affine.plus_noise(jnp.where(counted, extra, 0.0))
        revised = estimate.revise(affine, future)
        # Across a step whose map is not finite the filter kept its last estimate, and nothing later speaks of this one.
        crossed = jnp.all(jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(affine)]))
        revised = jax.tree.map(lambda new, old: jnp.where(crossed, new, old), revised, estimate)
        return revised, revised

    last = jax.tree.map(lambda values: values[-1], filtered[0])
    estimates, memories = jax.tree.map(lambda values: values[:-1], filtered)
    following, remembered = jax.tree.map(lambda values: values[1:], (samples, (filtered[1], counted)))
    _, smoothed = jax.lax.scan(backward, last, (estimates, memories, following, remembered), reverse=True)
    return jax.tree.map(lambda body, end: jnp.concatenate([body, end[None]]), smoothed, last)
