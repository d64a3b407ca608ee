"""Everything that can be known to be wrong before a run, and what to say when one fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from ..errors import ModelError, NumericalError, PrecisionError, ShapeError, Status
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..linalg import check_covariance
from ..models import AbstractModel, Instant
from ..models.functions import Matrix
from .log import Log

if TYPE_CHECKING:
    from .result import Result

_STEP_TOLERANCE = 0.01
"""Relative spread of the steps beyond which they are not equal."""


def check_problem(
    estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, data: Log
) -> tuple[str, ...]:
    """Raise if the parts do not fit each other; return what a reader of the results should know."""
    for value, kind, role in (
        (estimator, AbstractEstimator, "estimator"),
        (model, AbstractModel, "model"),
        (prior, AbstractEstimate, "prior"),
        (data, Log, "data"),
    ):
        if not isinstance(value, kind):
            hint = {"prior": "; make one with make_prior", "data": "; make one with make_log"}.get(role, "")
            raise ShapeError(f"{role}: expected {kind.__name__}, got {type(value).__name__}{hint}")
    if prior.space.names != model.space.names:
        raise ShapeError(f"prior: expected the states {model.space.names}, got {prior.space.names}")
    widths = {"y": (data.y, model.output.size), "seen": (data.seen, model.output.dof), "u": (data.u, len(model.inputs))}
    for name, (array, width) in widths.items():
        if array.shape != (len(data), width):
            raise ShapeError(f"data.{name}: expected shape ({len(data)}, {width}), got {array.shape}")
    _check_precision(prior, data)
    _check_functions(model, prior, data)
    warnings = _check_steps(model, data)
    if not data.seen.any():
        warnings.append("nothing was measured: the estimates are the prior carried forward")
    return tuple(warnings)


def _check_precision(prior: AbstractEstimate, data: Log) -> None:
    dtype = prior.mean.dtype
    if dtype != jnp.float32:
        return
    moving = data.dt[data.dt > 0]
    if moving.size and np.abs(data.t).max() * np.finfo(np.float32).eps > 0.01 * moving.min():
        raise PrecisionError(
            f"float32 cannot tell times near {np.abs(data.t).max():.9g} s apart at steps of {moving.min():.3g} s; "
            "use float64 (leave GAINFUL_X64 unset) or count time from the first row"
        )


def _check_steps(model: AbstractModel, data: Log) -> list[str]:
    steps = data.dt[data.dt > 0]
    if not steps.size:
        return []
    low, high = steps.min(), steps.max()
    if high - low <= _STEP_TOLERANCE * high:
        return []
    if not model.takes_dt:
        raise ModelError(
            f"f: expected to take dt, since the record's steps vary from {low:.6g} s to {high:.6g} s; "
            "write f(x, u, t, dt), or use continuous_model"
        )
    if not model.noise_takes_dt:
        return [f"Q is per step but the steps vary from {low:.6g} s to {high:.6g} s; consider Q(x, u, t, dt)"]
    return []


def _first_moment(model: AbstractModel, prior: AbstractEstimate, data: Log) -> tuple[jax.Array, Instant]:
    steps = data.dt[data.dt > 0]
    dtype = prior.mean.dtype
    dt = jnp.asarray(steps[0] if steps.size else 1.0, dtype)
    return prior.mean, Instant(jnp.asarray(data.t[0], dtype), dt, jnp.asarray(data.u[0], dtype))


def _check_functions(model: AbstractModel, prior: AbstractEstimate, data: Log) -> None:
    """Trace the model's functions once, so that a wrong shape is reported in their own terms."""
    x, when = _first_moment(model, prior, data)
    jax.eval_shape(lambda: (model.transition(x, when), model.observe(x, when)))
    jax.eval_shape(lambda: (model.process_noise(x, when), model.measurement_noise(x, when)))
    matrices = [leaf for leaf in jax.tree.leaves(model, is_leaf=_is_matrix) if _is_matrix(leaf)]
    if matrices and all(matrix.fn is None for matrix in matrices):
        return  # given as numbers, and checked when the model was made
    for role, fn, names in (
        ("Q", model.process_noise, model.space.tangent_names),
        ("R", model.measurement_noise, model.output.tangent_names),
    ):
        value = np.asarray(jax.jit(lambda fn=fn: fn(x, when))())
        if np.isfinite(value).all():
            check_covariance(value, f"{role} at t = {float(when.t):.6g} s", names)


def _is_matrix(leaf: Any) -> bool:
    return isinstance(leaf, Matrix)


def raise_failure(result: Result) -> None:
    """Raise for the first failed step, naming row, time, cause and what to try."""
    failed = np.flatnonzero(result.status >= Status.not_positive)
    if not failed.size:
        return
    k = int(failed[0])
    status = Status(int(result.status[k]))
    model, log = result.model, result.log
    row = int(np.count_nonzero(log.kept[:k]))
    before = result.prior.mean if k == 0 else jnp.asarray(result.mean[k - 1])
    head = f"row {row} at t = {log.t[k]:.9g} s: {status.sentence}"
    cause = _cause(model, log, k, before, status, result)
    more = f"; {failed.size - 1} later rows failed too" if failed.size > 1 else ""
    raise NumericalError(f"{head}. {cause}{more}")


def _cause(model: AbstractModel, log: Log, k: int, x: jax.Array, status: Status, result: Result) -> str:
    state = _listed(model.space.names, np.asarray(x))
    when = jax.tree.map(lambda v: jnp.asarray(v, x.dtype), Instant(log.t[k], log.dt[k], log.u[k]))  # type: ignore[arg-type]
    if status == Status.nonfinite:
        moved = np.asarray(model.transition(x, when))
        if not np.isfinite(moved).all():
            return f"f returned {_bad(model.space.names, moved)} from the state {state}"
        noise = np.asarray(model.process_noise(x, when))
        if not np.isfinite(noise).all():
            return f"Q is not finite at the state {state}"
        if not np.isfinite(np.asarray(result.cov[max(k - 1, 0)])).all() or not np.isfinite(moved).all():
            return f"the covariance overflowed near the state {state}; check the units and the size of Q and P0"
        y = np.asarray(model.observe(jnp.asarray(moved), when))
        if not np.isfinite(y).all():
            return f"h returned {_bad(model.output.names, y)} at the state {_listed(model.space.names, moved)}"
        if not np.isfinite(np.asarray(model.measurement_noise(jnp.asarray(moved), when))).all():
            return f"R is not finite at the state {_listed(model.space.names, moved)}"
        return f"a derivative of f or h is not finite near the state {state}; sqrt and norm have none at 0"
    signals = [name for name, seen in zip(model.output.tangent_names, log.seen[k], strict=True) if seen]
    variances = np.diag(np.asarray(model.measurement_noise(x, when)))
    zero = [name for name, v in zip(model.output.tangent_names, variances, strict=True) if v <= 0 and name in signals]
    if zero:
        return f"R is 0 for {zero[0]!r}, and its prediction is certain already; give it the sensor's variance"
    return f"measured: {', '.join(signals)}; check that P0, Q and R are covariances in matching units, or use square_root=True"


def _listed(names: tuple[str, ...], values: Any) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


def _bad(names: tuple[str, ...], values: np.ndarray) -> str:
    return ", ".join(f"{v} in {n!r}" for n, v in zip(names, values, strict=True) if not np.isfinite(v))
