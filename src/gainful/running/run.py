"""Running an estimator along a record."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..models import AbstractModel, Instant, Sample
from .checks import check_problem
from .compiled import compiled_call
from .failures import raise_failure
from .log import Log
from .result import Result, Timing

CHUNK = 16_384
"""Rows between two reports of progress."""


def samples_of(log: Log, dtype: Any) -> Sample:
    """All samples of a record, stacked along time."""
    t, dt, u, y = (np.asarray(values, dtype) for values in (log.t, log.dt, log.u, log.y))
    return Sample(Instant(t, dt, u), y, np.asarray(log.seen, bool))  # type: ignore[arg-type]  # numpy is taken as is


def scan(
    estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, samples: Sample
) -> tuple[Any, Info]:
    """Steps through stacked samples: pure, so `jit`, `vmap` over runs and `grad` apply.

    Args:
        estimator: what steps.
        model: of the plant.
        prior: the estimate before the first sample.
        samples: stacked along time, from `samples_of`.

    Returns:
        The memory after the last sample, and the reports stacked along time.
    """
    return jax.lax.scan(
        lambda carry, sample: estimator.step(model, carry, sample), estimator.init(model, prior), samples
    )


def _start(parts: tuple[AbstractEstimator, AbstractModel], prior: AbstractEstimate) -> Any:
    estimator, model = parts
    return estimator.init(model, prior)


def _advance(parts: tuple[AbstractEstimator, AbstractModel], carry: Any, samples: Sample) -> tuple[Any, Info]:
    estimator, model = parts
    return jax.lax.scan(lambda memory, sample: estimator.step(model, memory, sample), carry, samples)


def _scan(parts: tuple[AbstractEstimator, AbstractModel], prior: AbstractEstimate, samples: Sample) -> tuple[Any, Info]:
    return scan(*parts, prior, samples)


def run(
    estimator: AbstractEstimator,
    model: AbstractModel,
    prior: AbstractEstimate,
    data: Log,
    *,
    throw: bool = True,
    progress: Callable[[int], None] | None = None,
) -> Result:
    """Estimates along a whole record.

    Args:
        estimator: a filter, such as `unscented_kalman_filter()`.
        model: of the plant.
        prior: the estimate before the first row, from `make_prior`.
        data: the record, from `make_log` or `read_log`.
        throw: raise if a step fails; otherwise failed steps keep the last good estimate and say so in their status.
        progress: called with the number of rows done, every so often.

    Raises:
        ShapeError, CovarianceError, ModelError, DataError: parts that do not fit each other, before anything runs.
        NumericalError: a step failed; the message says which row, when, what and why.
    """
    warnings = check_problem(estimator, model, prior, data)
    samples = samples_of(data, prior.mean.dtype)
    parts = (estimator, model)
    begin = time.perf_counter()
    if progress is None or len(data) <= CHUNK:
        (_, infos), compile_seconds = compiled_call(_scan, parts, prior, samples)
        infos = jax.block_until_ready(infos)
    else:
        infos, compile_seconds = _in_chunks(parts, prior, samples, progress)
    seconds = time.perf_counter() - begin
    if progress is not None:
        progress(len(data))
    trees = ("estimate", "memory")
    arrays: dict[str, Any] = {
        f.name: np.asarray(getattr(infos, f.name)) for f in dataclasses.fields(Info) if f.name not in trees
    }
    timing = Timing(compile_seconds, seconds - compile_seconds)
    warnings += model.cautions(np.asarray(infos.estimate.mean))
    result = Result(
        estimator, model, prior, data, infos.estimate, infos.memory, **arrays, timing=timing, warnings=warnings
    )
    if throw:
        raise_failure(result)
    return result


def _in_chunks(
    parts: tuple[AbstractEstimator, AbstractModel],
    prior: AbstractEstimate,
    samples: Sample,
    report: Callable[[int], None],
) -> tuple[Info, float]:
    """The same scan in equal pieces, the last one padded with rows in which nothing happens."""
    rows = len(samples.when.t)
    missing = -rows % CHUNK

    def pad(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])

    padded = jax.tree.map(pad, samples)
    padded.when.dt[rows:] = 0
    padded.seen[rows:] = False
    carry, total = compiled_call(_start, parts, prior)
    pieces = []
    for start in range(0, rows, CHUNK):
        piece = jax.tree.map(lambda values, at=start: values[at : at + CHUNK], padded)
        (carry, info), seconds = compiled_call(_advance, parts, carry, piece)
        total += seconds
        pieces.append(jax.tree.map(np.asarray, info))
        report(min(start + CHUNK, rows))
    joined = jax.tree.map(lambda *values: jnp.asarray(np.concatenate(values)[:rows]), *pieces)
    return joined, total


def log_likelihood(
    estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, samples: Sample
) -> jax.Array:
    """Log likelihood of a record, differentiable in every array of estimator, model and prior."""
    return jnp.sum(scan(estimator, model, prior, samples)[1].log_likelihood)


@eqx.filter_jit
def run_many(
    estimator: AbstractEstimator, model: AbstractModel, priors: AbstractEstimate, samples: Sample
) -> tuple[Any, Info]:
    """Many records of equal length: `scan` over a leading axis of `priors` and `samples`, fastest way for the device."""

    def one(problem: tuple[AbstractEstimate, Sample]) -> tuple[Any, Info]:
        return scan(estimator, model, *problem)

    # A CPU runs one compiled loop after the other faster than it steps all records together; other devices do not.
    along = jax.lax.map if jax.default_backend() == "cpu" else lambda fn, problems: jax.vmap(fn)(problems)
    return along(one, (priors, samples))
