"""Estimates that use the whole record, or what comes a little later."""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..errors import ConfigError, ModelError, Status
from ..estimates import AbstractEstimate
from ..filters import KalmanFilter
from ..models import AbstractModel, Sample
from ..updates import AbstractUpdate, Corrected
from .backward import backward_map, neighbours, revised, with_last
from .compiled import compiled_call
from .fixed_lag import lagged
from .result import Result, Timing
from .run import samples_of


def smooth(result: Result, *, lag: float | None = None) -> Result:
    """The Rauch-Tung-Striebel smoother, for every linearization and every estimate.

    ```
    G = P A^T (A P A^T + N)^-1;  m_s = m [+] G (m_s,next [-] m_predicted)
    P_s = (I - G A) P (I - G A)^T + G (N + P_s,next) G^T
    ```

    Across a step that could not be predicted nothing is carried back: the row before it keeps the filter's estimate.

    The maps between neighbours are formed again from the filter's estimates and its noise law's memory.

    Args:
        result: of a filter.
        lag: use the record only until so many seconds after each row, as a stream delivers it with that delay [s]; 0
            leaves the filter's estimates. Costs one pass over the record per row within the lag.

    Raises:
        ModelError: the result was not made by a Kalman filter, was corrected by a network, or is smoothed already.
        ConfigError: a lag below 0.

    Source: Rauch, Tung and Striebel (1965), AIAA J. 3(8):1445-1450; Sarkka (2008), IEEE Trans. Autom. Control
        53(3):845-849 for sigma points.
    Differs: the covariance is a sum of squares, which stays positive semi-definite.
    """
    if not isinstance(result.estimator, KalmanFilter):
        raise ModelError(
            f"smooth: expected the result of a Kalman filter, got one of {type(result.estimator).__name__}"
        )
    if _is_corrected(result.estimator.update):
        raise ModelError(
            "smooth: the estimates were corrected by a network, which the smoother knows nothing of; smooth the filter "
            "without it"
        )
    if result.smoothed:
        raise ModelError("smooth: the result is smoothed already")
    if lag is not None and not lag >= 0:
        raise ConfigError(f"lag: expected seconds of at least 0, got {lag!r}")
    samples = samples_of(result.log, result.prior.mean.dtype)
    begin = time.perf_counter()
    parts = (result.estimator, result.model)
    counted = jnp.isin(jnp.asarray(result.status), jnp.asarray([Status.ok, Status.rejected]))
    filtered = (result.estimates, result.memories)
    if lag is None or lag >= result.t[-1] - result.t[0] > 0:
        estimates, compile_seconds = compiled_call(_smooth, parts, filtered, counted, samples)
    else:
        estimates, compile_seconds = compiled_call(lagged, parts, filtered, counted, samples, jnp.asarray(lag, float))
    estimates = jax.block_until_ready(estimates)
    timing = Timing(compile_seconds, time.perf_counter() - begin - compile_seconds)
    return dataclasses.replace(result, estimates=estimates, timing=timing, filtered=result, lag=lag)


def _is_corrected(update: AbstractUpdate) -> bool:
    parts = jax.tree.leaves(update, is_leaf=lambda part: isinstance(part, Corrected))
    return any(isinstance(part, Corrected) for part in parts)


def _smooth(
    parts: tuple[KalmanFilter, AbstractModel],
    filtered: tuple[AbstractEstimate, Any],
    counted: Array,
    samples: Sample,
) -> AbstractEstimate:
    def backward(future: AbstractEstimate, row: tuple[Any, Any]) -> tuple[AbstractEstimate, AbstractEstimate]:
        now = row[0]
        new = revised(now[0], backward_map(parts, *row), future)
        return new, new

    last = jax.tree.map(lambda values: values[-1], filtered[0])
    _, smoothed = jax.lax.scan(backward, last, neighbours(filtered, counted, samples), reverse=True)
    return with_last(smoothed, filtered[0])
