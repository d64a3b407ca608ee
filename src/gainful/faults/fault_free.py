"""What a statistic does when nothing is wrong, by simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import ConfigError, ShapeError
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..models import AbstractModel, Instant, Sample
from ..running import scan
from ..running.compiled import compiled_call
from ..running.drawing import draw
from .modelling import FaultModel, base_prior


def fault_free_statistics(
    statistic: Callable[[Info], Any],
    estimator: AbstractEstimator,
    model: AbstractModel,
    prior: AbstractEstimate,
    t: Any,
    u: Any = None,
    *,
    runs: int,
    key: Array,
    at_once: int = 8,
) -> Any:
    """A statistic along runs that are drawn from the model, a `FaultModel`'s faults being 0 throughout.

    Args:
        statistic: of the stacked reports of one run, a pure function such as `lambda info: info.nis`; more than one may
            be returned in a dictionary.
        estimator: the filter.
        model: what it believes.
        prior: where it starts; the true state without faults is drawn from it too.
        t: times [s] (T,).
        u: inputs (T, inputs), the same in all runs.
        runs: how many.
        key: random key.
        at_once: runs in memory at the same time.

    Returns:
        What `statistic` returns, one row per run.

    Raises:
        ConfigError: fewer than one run.
        ShapeError: inputs that do not fit the times.
    """
    if runs < 1:
        raise ConfigError(f"runs: expected at least 1, got {runs!r}")
    moments = moments_of(model, t, u)
    faulty = isinstance(model, FaultModel)
    plant, start = (model.base, base_prior(model, prior)) if faulty else (model, prior)
    fixed = (statistic, estimator, model, plant, min(at_once, runs))
    found, _ = compiled_call(_simulate, fixed, prior, start, moments, jax.random.split(key, runs))
    return jax.tree.map(np.asarray, found)


def moments_of(model: AbstractModel, t: Any, u: Any = None) -> Instant:
    """Stacked moments at some times, with inputs (T, inputs) or none at all.

    Raises:
        ShapeError: times that are no vector, or inputs that do not fit them.
    """
    times = np.asarray(t, float)
    if times.ndim != 1 or not times.size:
        raise ShapeError(f"t: expected a vector of times, got shape {times.shape}")
    inputs = np.zeros((len(times), len(model.inputs))) if u is None else np.asarray(u, float)
    if inputs.shape != (len(times), len(model.inputs)):
        raise ShapeError(f"u: expected shape ({len(times)}, {len(model.inputs)}), got {inputs.shape}")
    return Instant(jnp.asarray(times), jnp.asarray(np.diff(times, prepend=times[0])), jnp.asarray(inputs))


def _simulate(
    fixed: tuple[Callable[[Info], Any], AbstractEstimator, AbstractModel, AbstractModel, int],
    prior: AbstractEstimate,
    start: AbstractEstimate,
    moments: Instant,
    keys: Array,
) -> Any:
    statistic, estimator, model, plant, at_once = fixed

    def one(key: Array) -> Any:
        _, y = draw(plant, start, moments, key)
        seen = jnp.ones((y.shape[0], model.output.dof), bool)
        return statistic(scan(estimator, model, prior, Sample(moments, y, seen))[1])

    return jax.lax.map(one, keys, batch_size=at_once)
