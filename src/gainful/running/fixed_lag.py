"""Estimates that use a record until a little later: what a stream can deliver with a delay."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ModelError, Status
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info, KalmanFilter
from ..models import AbstractModel, Sample
from .backward import backward_map, neighbours, revised, with_last


def fixed_lag(
    estimator: AbstractEstimator, model: AbstractModel, samples: Sample, info: Info, lag: Float[Array, ""] | float
) -> Info:
    """The reports of a run with estimates that use the record until `lag` seconds after each row.

    ```
    m_k(0) = m_k;  m_k(l) = m_k [+] G_k (m_k+1(l - 1) [-] m_predicted), until l is the last row within the lag
    ```

    Pure, so `jit`, `vmap` and use inside a study's contender apply: it takes `scan`'s reports and gives such. A lag of 0
    leaves the filter's estimates, one of the record's length makes them those of `smooth`. Costs one backward pass over
    the record for each row that the lag spans.

    Args:
        estimator: that made the reports.
        model: of the plant.
        samples: stacked along time.
        info: the reports, stacked along time.
        lag: how much later than its row an estimate may be told [s].

    Raises:
        ModelError: reports of something else than a Kalman filter.

    Source: Anderson and Moore (1979), Optimal Filtering, chapter 7.
    Differs: each row's recursion starts anew at the last row within its lag, as in `smooth`: exact where the filter is, and
        positive semi-definite.
    Reduces to: `smooth`, for a lag of the record's length.

    Example:
        >>> import gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior, log = gf.make_prior(model, [0.0], [1.0]), gf.make_log(model, [0.0, 1.0, 2.0], [0.3, -0.1, 0.5])
        >>> samples = gf.samples_of(log, float)
        >>> _, info = gf.scan(gf.kalman_filter(), model, prior, samples)
        >>> print(info.estimate.cov[:, 0, 0].round(3))
        [0.5   0.375 0.322]
        >>> print(fixed_lag(gf.kalman_filter(), model, samples, info, lag=1.0).estimate.cov[:, 0, 0].round(3))
        [0.344 0.28  0.322]
    """
    if not isinstance(estimator, KalmanFilter):
        raise ModelError(f"fixed_lag: expected a Kalman filter, got a {type(estimator).__name__}")
    counted = (info.status == Status.ok) | (info.status == Status.rejected)
    estimates = lagged((estimator, model), (info.estimate, info.memory), counted, samples, lag)
    return eqx.tree_at(lambda report: report.estimate, info, estimates)


def lagged(
    parts: tuple[KalmanFilter, AbstractModel],
    filtered: tuple[AbstractEstimate, Any],
    counted: Array,
    samples: Sample,
    lag: Float[Array, ""] | float,
) -> AbstractEstimate:
    """The estimates alone, see `fixed_lag`."""
    estimates = filtered[0]
    before = jax.tree.map(lambda values: values[:-1], estimates)
    ahead = rows_ahead(samples.when.t, lag)
    # Row by row: on a CPU a compiled loop is faster than a batch of small products.
    maps = jax.lax.map(lambda row: backward_map(parts, *row), neighbours(filtered, counted, samples))

    def sweep(turn: Int[Array, ""], held: tuple[AbstractEstimate, AbstractEstimate]) -> Any:
        """Every row revised by the next one's estimate of the last turn, so that it uses one row more."""
        latest, chosen = held
        rows = (before, maps, jax.tree.map(lambda values: values[1:], latest))
        latest = with_last(jax.lax.map(lambda row: revised(*row), rows), estimates)
        chosen = jax.vmap(lambda due, new, old: jax.tree.map(lambda a, b: jnp.where(due, a, b), new, old))(
            ahead >= turn, latest, chosen
        )
        return latest, chosen

    return jax.lax.fori_loop(1, jnp.max(ahead) + 1, sweep, (estimates, estimates))[1]


def rows_ahead(t: Float[Array, " T"], lag: Float[Array, ""] | float) -> Int[Array, " T"]:
    """How many later rows lie within a lag [s] of each; none for a lag of 0, not even those of the same moment."""
    t, lag = jnp.asarray(t), jnp.asarray(lag)
    # Times are a few roundings off the sums of their steps.
    slack = 8 * jnp.finfo(t.dtype).eps * jnp.max(jnp.abs(t))
    last = jnp.searchsorted(t, t + lag.astype(t.dtype) + slack, side="right") - 1
    return jnp.where(lag > 0, last - jnp.arange(len(t)), 0)
