"""Expectation and maximisation: noise as large as the smoothed record says it was, again and again."""

from __future__ import annotations

from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...errors import ConfigError, Status
from ...estimates import AbstractEstimate
from ...estimates.base import backward_gain, residual_of
from ...filters import Carry, KalmanFilter
from ...linalg import congruence, product, root_and_inverse
from ...models import Sample
from ..backward import backward_map, neighbours, revised, with_last
from ..compiled import compiled_call
from .entries import NoiseEntry
from .problem import Problem, scaled_run
from .records import padded
from .search import Search


def by_expectation(problem: Problem, bounds: tuple[float, float], iterations: int, tolerance: float = 1e-6) -> Search:
    """The factors of the largest likelihood by expectation and maximisation, which never makes it smaller.

    ```
    E  smooth:  w = m_k [-] f(m_k-1),  W = w w^T + P_k + A P_k-1 A^T - A C^T - C A^T,  C = cov(x_k, x_k-1);  likewise V of y
    M  factor^2 <- factor^2 mean tr(Q^-1 W) / dof, over each entry's rows and columns;  likewise R from V
    ```

    Exact for linear models where the noise of different entries is independent. Slow near its end, and slower the less of the
    innovations an entry explains: for comparison with the search by gradient, and where that fails.

    Raises:
        ConfigError: an estimator that cannot be smoothed.

    Source: Shumway and Stoffer (1982), J. Time Series Analysis 3(4):253-264.
    Differs: factors on noise that may vary along the record; smoothed linearisations for nonlinear models.
    """
    if not isinstance(problem.estimator, KalmanFilter):
        raise ConfigError(f'method: "em" smooths, and needs a single filter, got a {type(problem.estimator).__name__}')
    logs, path, converged = (
        np.zeros(len(problem.entries)),
        [problem.fitted_loss(np.zeros(len(problem.entries)))[0]],
        False,
    )
    for _ in range(iterations):
        sums = np.zeros((2, len(logs)))
        for record in problem.records:
            if record.fitted.any():
                samples = padded(record.samples, 0, before=1)
                rows = np.concatenate([[False], record.fitted])
                found, _ = compiled_call(
                    _statistics, problem.parts, jnp.asarray(logs), record.prior, samples, jnp.asarray(rows)
                )
                sums = sums + np.asarray(found)
        seen = sums[1] > 0
        step = np.where(seen, 0.5 * np.log(np.where(seen, sums[0], 1.0) / np.where(seen, sums[1], 1.0)), 0.0)
        logs = np.clip(logs + step, *bounds)
        path.append(problem.fitted_loss(logs)[0])
        if path[-2] - path[-1] < tolerance:
            converged = True
            break
    return Search(logs, len(path) - 1, converged, tuple(path))


def _statistics(
    parts: tuple[Any, ...], logs: Array, prior: AbstractEstimate, samples: Sample, rows: Array
) -> Float[Array, "2 entries"]:
    """Squares of each entry in units of its present variance, and how many there were."""
    _, model, entries = parts
    chosen, infos = scaled_run(parts, logs, prior, samples)
    estimator = cast(KalmanFilter, chosen)
    both, filtered = (estimator, model), (infos.estimate, infos.memory)
    counted = jnp.isin(infos.status, jnp.asarray([Status.ok, Status.rejected]))

    def backward(future: AbstractEstimate, row: tuple[Any, Any]) -> tuple[AbstractEstimate, Any]:
        now, after = row
        affine = backward_map(both, now, after)
        new = revised(now[0], affine, future)
        cross = product(affine.matrix, product(backward_gain(affine, now[0].cov), future.cov))
        moved = affine.outer.minus(future.mean, affine.predict(new.mean))
        square = jnp.outer(moved, moved) + future.cov + congruence(affine.matrix, new.cov) - cross - cross.T
        noise = estimator.process_noise(model, Carry(now[0], *now[1]), after[0])
        usable = (after[0].when.dt > 0) & jnp.all(jnp.isfinite(square))
        return new, (new, jnp.where(usable, square, 0.0), jnp.where(usable, noise, 0.0))

    last = jax.tree.map(lambda values: values[-1], infos.estimate)
    _, (body, squares, noises) = jax.lax.scan(backward, last, neighbours(filtered, counted, samples), reverse=True)
    smoothed = with_last(body, infos.estimate)

    def read(estimate: AbstractEstimate, memory: Any, sample: Sample) -> tuple[Array, Array]:
        when, seen = sample.when, sample.seen
        affine = estimator.linearization(lambda x: model.observe(x, when), estimate, model.output).masked(seen)
        residual = residual_of(affine, estimate.mean, sample.y, seen)
        # A covariance that is left of the linearisation belongs to the reading as the spread of the state does.
        left = affine.covariance() - jnp.diag(jnp.where(seen, 0.0, 1.0).astype(residual.dtype))
        square = jnp.outer(residual, residual) + congruence(affine.matrix, estimate.cov) + left
        noise = estimator.noise.measurement(memory[1], model.measurement_noise(estimate.mean, when))
        both = seen[:, None] & seen[None, :]
        return jnp.where(both, square, 0.0), jnp.where(both, noise, 0.0)

    memories = jax.tree.map(lambda values: jnp.concatenate([values[:1], values[:-1]]), infos.memory)
    readings = jax.vmap(read)(smoothed, memories, samples)
    told = {
        "process": (model.space.tangent_names, squares, noises, rows[1:]),
        "measurement": (model.output.tangent_names, *readings, rows),
    }
    return jnp.stack([_squares(entry, *told[entry.kind]) for entry in entries], axis=1)


def _squares(
    entry: NoiseEntry, names: tuple[str, ...], squares: Array, noises: Array, rows: Array
) -> Float[Array, "2"]:
    """Sum of `tr(Q^-1 W)` over the rows, and of the degrees of freedom it has."""
    at = jnp.array([names.index(name) for name in entry.names])

    def one(square: Array, noise: Array) -> tuple[Array, Array]:
        lower, inverse, _ = root_and_inverse(noise[at][:, at])
        trace = jnp.trace(congruence(inverse, square[at][:, at]))
        return trace, jnp.sum(jnp.diagonal(lower) > 0)

    traces, degrees = jax.vmap(one)(squares, noises)
    return jnp.stack([jnp.sum(jnp.where(rows, traces, 0.0)), jnp.sum(jnp.where(rows, degrees, 0))])
