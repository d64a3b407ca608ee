"""Estimates that use the whole record."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import jax

from ..errors import ModelError
from ..estimates import AbstractEstimate
from ..filters import KalmanFilter
from ..filters.kalman import transition_map
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

    The filter is run once more, so that the maps between neighbours are those it used, noise law and all.

    Args:
        result: of a filter.

    Raises:
        ModelError: the result was not made by a Kalman filter, or is smoothed already.

    Source: Rauch, Tung and Striebel (1965), AIAA J. 3(8):1445-1450; Sarkka (2008), IEEE Trans. Autom. Control
        53(3):845-849 for sigma points.
    Differs: the covariance is a sum of squares, which stays positive semi-definite.
    """
    if not isinstance(result.estimator, KalmanFilter):
        raise ModelError(f"smooth: expected the result of a Kalman filter, got one of {type(result.estimator).__name__}")
    if result.smoothed:
        raise ModelError("smooth: the result is smoothed already")
    samples = samples_of(result.log, result.prior.mean.dtype)
    begin = time.perf_counter()
    estimates, compile_seconds = compiled_call(
        _smooth, (result.estimator, result.model), result.prior, samples
    )
    estimates = jax.block_until_ready(estimates)
    timing = Timing(compile_seconds, time.perf_counter() - begin - compile_seconds)
    return dataclasses.replace(result, estimates=estimates, timing=timing, filtered=result)


def _smooth(parts: tuple[KalmanFilter, AbstractModel], prior: AbstractEstimate, samples: Sample) -> AbstractEstimate:
    estimator, model = parts

    def forward(carry: Any, sample: Sample) -> tuple[Any, Any]:
        affine = transition_map(estimator, model, carry, sample)
        carry, _ = estimator.step(model, carry, sample)
        return carry, (carry.estimate, affine)

    def backward(future: AbstractEstimate, pair: Any) -> tuple[AbstractEstimate, AbstractEstimate]:
        estimate, affine = pair
        revised = estimate.revise(affine, future)
        return revised, revised

    carry, (filtered, maps) = jax.lax.scan(forward, estimator.init(model, prior), samples)
    # The map stored with row k leads to row k from row k - 1.
    earlier = jax.tree.map(lambda values: values[:-1], filtered)
    later = jax.tree.map(lambda values: values[1:], maps)
    _, smoothed = jax.lax.scan(backward, carry.estimate, (earlier, later), reverse=True)
    return jax.tree.map(lambda body, last: jax.numpy.concatenate([body, last[None]]), smoothed, carry.estimate)
