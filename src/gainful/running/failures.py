"""What to say when a run has failed: where, and the likely cause."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..errors import NumericalError, Status
from ..models import AbstractModel, Instant
from .log import Log
from .result import Result


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
    if "cov" not in vars(result.estimates):
        return  # made from a root, and never negative
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
    advice = "check that P0, Q and R are covariances in matching units, or use square_root=True"
    return f"measured: {', '.join(signals)}; {advice}"


def _listed(names: tuple[str, ...], values: Any) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


def _bad(names: tuple[str, ...], values: np.ndarray) -> str:
    return ", ".join(f"{v} in {n!r}" for n, v in zip(names, values, strict=True) if not np.isfinite(v))
