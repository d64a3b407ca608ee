"""Everything that can be known to be wrong before a run."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import GainfulError, ModelError, PrecisionError, ShapeError
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..linalg import check_covariance
from ..models import AbstractModel, Instant
from ..models.functions import Matrix
from .compiled import compiled_call, split
from .log import Log

_STEP_TOLERANCE = 0.01
"""Relative spread of the steps beyond which they are not equal."""

_NOISE_ROWS = 64
"""Noise given as functions of time is looked at in so many places along the record."""

_traced: set[Any] = set()
"""Kinds of models whose functions have been traced; another record of the same is not traced again."""


def check_problem(
    estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, data: Log
) -> tuple[str, ...]:
    """Raise if the parts do not fit each other; return what a reader of the results should know."""
    _check_kinds(estimator, model, prior)
    if not isinstance(data, Log):
        raise ShapeError(f"data: expected Log, got {type(data).__name__}; make one with make_log")
    _check_prior(model, prior)
    widths = {"y": (data.y, model.output.size), "seen": (data.seen, model.output.dof), "u": (data.u, len(model.inputs))}
    for name, (array, width) in widths.items():
        if array.shape != (len(data), width):
            raise ShapeError(f"data.{name}: expected shape ({len(data)}, {width}), got {array.shape}")
    _check_precision(prior, data)
    _check_functions(model, prior, _moments(data, prior.mean.dtype))
    warnings = _check_steps(model, data)
    if not data.seen.any():
        warnings.append("nothing was measured: the estimates are the prior carried forward")
    return tuple(warnings)


def check_parts(estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, start: float) -> None:
    """Raise if the parts do not fit each other, before there is any data: noise and functions are tried at `start` [s]."""
    _check_kinds(estimator, model, prior)
    _check_prior(model, prior)
    one = jnp.ones(1, prior.mean.dtype)
    _check_functions(model, prior, Instant(start * one, one, jnp.zeros((1, len(model.inputs)), one.dtype)))


def _check_kinds(estimator: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate) -> None:
    for value, kind, role in (
        (estimator, AbstractEstimator, "estimator"),
        (model, AbstractModel, "model"),
        (prior, AbstractEstimate, "prior"),
    ):
        if not isinstance(value, kind):
            hint = "; make one with make_prior" if role == "prior" else ""
            raise ShapeError(f"{role}: expected {kind.__name__}, got {type(value).__name__}{hint}")


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
            raise ShapeError(
                f"prior {role}: expected floating-point numbers, got {array.dtype}; make it with make_prior"
            )
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


def _moments(data: Log, dtype: Any) -> Instant:
    """Moments spread over the record, stacked."""
    rows = np.linspace(0, len(data) - 1, _NOISE_ROWS).astype(int)
    steps = data.dt[data.dt > 0]
    dt = np.where(data.dt > 0, data.dt, steps[0] if steps.size else 1.0)
    return Instant(*(jnp.asarray(values[rows], dtype) for values in (data.t, dt, data.u)))


def _check_functions(model: AbstractModel, prior: AbstractEstimate, moments: Instant) -> None:
    """Trace the model's functions once, so that a wrong shape or a mistake is reported in their own terms."""
    for leaf in jax.tree.leaves(model):
        try:
            hash(0 if eqx.is_array(leaf) else leaf)
        except TypeError as problem:
            kind = type(leaf).__name__
            raise ModelError(
                f"model: expected functions that can be hashed, got a {kind}; equinox.Module can"
            ) from problem
    x, when = prior.mean, jax.tree.map(lambda values: values[0], moments)
    *_, kind = split((model, x, when))
    if kind not in _traced:
        own = {"f": model.transition, "h": model.observe, "Q": model.process_noise, "R": model.measurement_noise}
        for role, fn in own.items():
            try:
                jax.eval_shape(lambda x, when, fn=fn: fn(x, when), x, when)
            except GainfulError:
                raise
            except Exception as problem:  # a user's function raises whatever it likes
                raise ModelError(f"{role}: failed{place_of(problem)}: {_explained(problem)}") from problem
        _traced.add(kind)
    matrices = [leaf for leaf in jax.tree.leaves(model, is_leaf=_is_matrix) if _is_matrix(leaf)]
    if matrices and all(matrix.fn is None for matrix in matrices):
        return  # given as numbers, and checked when the model was made
    found, _ = compiled_call(_noises, (model,), x, moments)
    for k, t in enumerate(np.asarray(moments.t)):
        for role, noise, names in zip(
            ("Q", "R"), found, (model.space.tangent_names, model.output.tangent_names), strict=True
        ):
            value = np.asarray(noise[k])
            if np.isfinite(value).all():  # if not, the step that uses it says so
                check_covariance(value, f"{role} at t = {t:.6g} s", names)


def _noises(parts: tuple[AbstractModel], x: jax.Array, moments: Instant) -> tuple[jax.Array, jax.Array]:
    """Q and R at some moments, at one state."""
    return jax.vmap(lambda when: (parts[0].process_noise(x, when), parts[0].measurement_noise(x, when)))(moments)


_LIBRARIES = (*(module.__path__[0] for module in (jax, eqx, np)), str(Path(__file__).parents[1]))


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
    return next(
        (hint for kind, hint in hints.items() if isinstance(problem, kind)), f"{type(problem).__name__}: {text}"
    )


def _is_matrix(leaf: Any) -> bool:
    return isinstance(leaf, Matrix)
