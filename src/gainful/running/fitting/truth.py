"""Truth: the noise under which a filter's estimates are nearest to reference values."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
from jaxtyping import Array, Bool, Float

from ...errors import ConfigError
from ...estimates import AbstractEstimate
from ...models import Sample
from ...spaces import AbstractSpace
from ..compiled import compiled_call
from .problem import FAILED, Problem, scaled_run
from .records import Record
from .search import Search, keeping


def by_truth(problem: Problem, bounds: tuple[float, float], iterations: int) -> Search:
    """The factors with the least mean logarithm of the squared error over the states that have a truth.

    The logarithm makes states of all units count alike. Such noise makes estimates accurate, not consistent: the
    covariance that goes with it need not be that of the errors.

    Raises:
        ConfigError: records without truth.

    Source: Abbeel, Coates, Montemerlo, Ng and Thrun (2005), Robotics: Science and Systems; Nelder and Mead (1965), Computer
        J. 7(4):308-313.
    """
    space = problem.model.space
    given = [(record, *_truth(record, space)) for record in problem.records if record.fitted.any()]
    known = sum(valid.sum(axis=0) for _, _, valid in given)
    if not np.any(known):
        raise ConfigError('method: "truth" needs records with truth, got none')
    judged = np.flatnonzero(known)
    path: list[float] = []

    def cost(logs: Float[np.ndarray, " entries"]) -> float:
        squares = np.zeros(space.dof)
        for record, truth, valid in given:
            found, _ = compiled_call(
                _squares, problem.parts, jnp.asarray(logs), record.prior, record.samples, jnp.asarray(truth)
            )
            squares += np.where(valid, np.asarray(found), 0.0).sum(axis=0)
        means = squares[judged] / np.asarray(known)[judged]
        return float(np.mean(np.log(means))) if (np.isfinite(means) & (means > 0)).all() else FAILED

    found = scipy.optimize.minimize(
        cost,
        np.zeros(len(problem.entries)),
        method="Nelder-Mead",
        bounds=[bounds] * len(problem.entries),
        callback=keeping(path),
        options={
            "maxiter": iterations,
            "xatol": 1e-3,
            "fatol": 1e-6,
            "initial_simplex": _simplex(len(problem.entries)),
        },
    )
    return Search(found.x, int(found.nit), bool(found.success), tuple(path), str(found.message))


def _simplex(n: int) -> Float[np.ndarray, "corners n"]:
    """The start, and each entry made half as large again."""
    return np.vstack([np.zeros(n), 0.5 * np.eye(n)])


def _truth(record: Record, space: AbstractSpace) -> tuple[np.ndarray, Bool[np.ndarray, "T dof"]]:
    """Reference values, NaN where there are none, and which degrees of freedom can be judged in the fitted rows."""
    length, log = len(record.fitted), record.log
    table = np.full((length, space.size), np.nan)
    for i, name in enumerate(space.names):
        if name in log.truth:
            table[: len(log), i] = log.truth[name]
    valid, i = [], 0
    for part in space.parts:
        known = np.isfinite(table[:, i : i + part.size])
        own = known if part.size == part.dof else np.repeat(known.all(axis=1, keepdims=True), part.dof, axis=1)
        valid.append(own & record.fitted[:, None])
        i += part.size
    return table, np.concatenate(valid, axis=1)


def _squares(
    parts: tuple[Any, ...], logs: Array, prior: AbstractEstimate, samples: Sample, truth: Array
) -> Float[Array, "T dof"]:
    mean = scaled_run(parts, logs, prior, samples)[1].estimate.mean
    space = parts[1].space

    def square(true: Array, estimate: Array) -> Array:
        return space.minus(jnp.where(jnp.isfinite(true), true, estimate), estimate) ** 2

    return jax.vmap(square)(truth, mean)
