"""Everything that can be known to be wrong before a run, and what to say when one fails."""

from __future__ import annotations

import os
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import GainfulError, ModelError, NumericalError, PrecisionError, ShapeError, Status
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
    _check_prior(model, prior)
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


def _check_prior(model: AbstractModel, prior: AbstractEstimate) -> None:
    """What `make_prior` makes sure of, for an estimate made by hand or for another model."""
    space = model.space
    for kind in ("names", "tangent_names"):
        expected, given = getattr(space, kind), getattr(prior.space, kind)
        if given != expected:
            raise ShapeError(f"prior: expected the states {', '.join(expected)}, got {', '.join(given)}")
    for role, array, shape in (("mean", prior.mean, (space.size,)), ("cov", prior.cov, (space.dof, space.dof))):
        if array.shape != shape:
            raise ShapeError(f"prior {role}: expected shape {shape}, got {array.shape}; make it with make_prior")
        if not jnp.issubdtype(array.dtype, jnp.floating):
            raise ShapeError(f"prior {role}: expected floating-point numbers, got {array.dtype}; make it with make_prior")
    bad = np.flatnonzero(~np.isfinite(np.asarray(prior.mean)))
    if bad.size:
        k = int(bad[0])
        raise ShapeError(f"prior mean of {space.names[k]!r}: expected a finite number, got {prior.mean[k]}")
    check_covariance(np.asarray(prior.cov), "prior cov", space.tangent_names)


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
    """Trace the model's functions once, so that a wrong shape or a mistake is reported in their own terms."""
    x, when = _first_moment(model, prior, data)
    own = {"f": model.transition, "h": model.observe, "Q": model.process_noise, "R": model.measurement_noise}
    for role, fn in own.items():
        try:
            jax.eval_shape(lambda x, when, fn=fn: fn(x, when), x, when)
        except GainfulError:
            raise
        except Exception as problem:  # a user's function raises whatever it likes
            raise ModelError(f"{role}: failed{place_of(problem)}: {_explained(problem)}") from problem
    matrices = [leaf for leaf in jax.tree.leaves(model, is_leaf=_is_matrix) if _is_matrix(leaf)]
    if matrices and all(matrix.fn is None for matrix in matrices):
        return  # given as numbers, and checked when the model was made
    for role, names in (("Q", model.space.tangent_names), ("R", model.output.tangent_names)):
        value = np.asarray(jax.jit(lambda fn=own[role]: fn(x, when))())
        if np.isfinite(value).all():
            check_covariance(value, f"{role} at t = {float(when.t):.6g} s", names)


_LIBRARIES = tuple(os.path.dirname(module.__file__) for module in (jax, eqx, np)) + (str(Path(__file__).parents[1]),)


def place_of(problem: BaseException) -> str:
    """Where in a user's file an exception comes from, as " at file.py line 3"; nothing if it does not."""
    frames = traceback.extract_tb(problem.__traceback__)
    own = [f for f in frames if not f.filename.startswith(("<", *_LIBRARIES))]
    return f" at {Path(own[-1].filename).name} line {own[-1].lineno}" if own else ""


def _explained(problem: Exception) -> str:
    hints = {
        jax.errors.TracerArrayConversionError: "it needs jax.numpy in place of numpy",
        jax.errors.TracerBoolConversionError: "it needs jnp.where in place of if",
        jax.errors.ConcretizationTypeError: "it needs jax.numpy in place of float(), int() and Python's own math",
    }
    text = (str(problem).splitlines() or [""])[0]
    return next((hint for kind, hint in hints.items() if isinstance(problem, kind)), f"{type(problem).__name__}: {text}")


def _is_matrix(leaf: Any) -> bool:
    return isinstance(leaf, Matrix)


def raise_failure(result: Result) -> None:
    """Raise for the first failed step, naming row, time, cause and what to try."""
    failed = np.flatnonzero(result.status >= Status.not_positive)
    if not failed.size:
        _raise_negative(result)
        return
    k = int(failed[0])
    # A covariance of NaN is not positive either, but that is not what went wrong.
    status = Status(int(result.status[k])) if np.isfinite(result.residual_cov[k]).all() else Status.nonfinite
    log = result.log
    before = result.prior.mean if k == 0 else jnp.asarray(result.mean[k - 1])
    cause = _cause(result.model, log, k, before, status, result)
    more = f"; {failed.size - 1} later rows failed too" if failed.size > 1 else ""
    raise NumericalError(f"{_row(log, k)}: {status.sentence}. {cause}{more}")


def _row(log: Log, k: int) -> str:
    return f"row {int(np.count_nonzero(log.kept[:k]))} at t = {log.t[k]:.9g} s"


def _raise_negative(result: Result) -> None:
    """A covariance that went negative without any step noticing: Q or R are no covariances further along."""
    variances = np.diagonal(result.cov, axis1=1, axis2=2)
    negative = np.argwhere(variances < -1e-8 * np.abs(variances).max(axis=0, initial=0.0))
    if negative.size:
        k, j = (int(i) for i in negative[0])
        name = result.model.space.tangent_names[j]
        raise NumericalError(
            f"{_row(result.log, k)}: the variance of {name!r} came out as {variances[k, j]:.6g}; "
            "check that Q and R are covariances at all times"
        )


def _cause(model: AbstractModel, log: Log, k: int, x: jax.Array, status: Status, result: Result) -> str:
    state = _listed(model.space.names, np.asarray(x))
    when = jax.tree.map(lambda v: jnp.asarray(v, x.dtype), Instant(log.t[k], log.dt[k], log.u[k]))  # type: ignore[arg-type]
    moved = model.transition(x, when)
    if not np.isfinite(np.asarray(moved)).all():
        return f"f returned {_bad(model.space.names, np.asarray(moved))} from the state {state}"
    there = _listed(model.space.names, np.asarray(moved))
    noises = {"Q": (model.process_noise(x, when), state), "R": (model.measurement_noise(moved, when), there)}
    for role, (noise, where) in noises.items():
        if not np.isfinite(np.asarray(noise)).all():
            return f"{role} is not finite at the state {where}"
    y = np.asarray(model.observe(moved, when))
    if not np.isfinite(y).all():
        return f"h returned {_bad(model.output.names, y)} at the state {there}"
    slope = np.asarray(jax.jacfwd(lambda x: model.transition(x, when))(x))
    for role, derivative, where in (
        ("f", slope, state),
        ("h", np.asarray(jax.jacfwd(lambda x: model.observe(x, when))(moved)), there),
    ):
        if not np.isfinite(derivative).all():
            return f"the derivative of {role} is not finite at the state {where}; sqrt and norm have none at 0"
    if status == Status.nonfinite:
        reach = np.abs(result.std[max(k - 1, 0)]).max() * max(1.0, float(np.abs(slope).max()))
        if reach > 1e100:
            return f"the covariance overflowed near the state {state}; check the units and the size of Q and P0"
        return f"f or h is not finite within a sigma or so of the state {state}"
    signals = [name for name, seen in zip(model.output.tangent_names, log.seen[k], strict=True) if seen]
    for role, names in (("Q", model.space.tangent_names), ("R", model.output.tangent_names)):
        for name, variance in zip(names, np.diag(np.asarray(noises[role][0])), strict=True):
            if variance < 0:
                return f"{role}: expected variances of at least 0, got {variance:.6g} for {name!r}"
            if role == "R" and variance == 0 and name in signals:
                return f"R is 0 for {name!r}, and its prediction is certain already; give it the sensor's variance"
    return f"measured: {', '.join(signals)}; check that P0, Q and R are covariances in matching units, or use square_root=True"


def _listed(names: tuple[str, ...], values: Any) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


def _bad(names: tuple[str, ...], values: np.ndarray) -> str:
    return ", ".join(f"{v} in {n!r}" for n, v in zip(names, values, strict=True) if not np.isfinite(v))
