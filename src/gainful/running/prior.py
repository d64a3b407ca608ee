"""The estimate before the first sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..errors import CovarianceError, ShapeError, did_you_mean
from ..estimates import Gaussian
from ..linalg import check_covariance
from ..models import AbstractModel
from ..spaces import AbstractSpace, Interval


def make_prior(model: AbstractModel, mean: Any, std: Any = None, *, cov: Any = None) -> Gaussian:
    """The estimate before the first sample.

    Args:
        model: whose state it is.
        mean: one number per state coordinate, or a mapping from state name to number; a quaternion is named as a whole
            and given as four numbers, scalar last.
        std: standard deviations: one number per degree of freedom, or a mapping from state name to number, in the
            state's own unit (for a quaternion: rad, one number or three).
        cov: covariance in tangent coordinates (dof, dof), in place of `std`.

    Raises:
        ShapeError: a wrong number of entries, or a name that is not a state.
        CovarianceError: not symmetric, not positive semi-definite, or not finite.

    Example:
        >>> from gainful.models import linear_model
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"])
        >>> make_prior(model, {"x": 2.0}, {"x": 0.5}).cov.tolist()
        [[0.25]]
    """
    space = model.space
    point = _mean(space, mean)
    if (std is None) == (cov is None):
        raise CovarianceError("prior: expected either std or cov, got " + ("both" if std is not None else "neither"))
    if std is not None:
        sigma = _deviations(space, std) * tangent_scale(space, point)
        cov = np.diag(sigma**2)
    matrix = _numbers(cov, "prior cov")
    if matrix.shape != (space.dof, space.dof):
        raise ShapeError(f"prior cov: expected shape ({space.dof}, {space.dof}), got {matrix.shape}")
    check_covariance(matrix, "prior cov", space.tangent_names)
    return Gaussian.start(jnp.asarray(point), jnp.asarray(matrix), space)


def _numbers(values: Any, role: str) -> np.ndarray:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as problem:
        raise ShapeError(f"{role}: expected numbers, got {values!r}") from problem


def _mean(space: AbstractSpace, mean: Any) -> np.ndarray:
    if isinstance(mean, Mapping):
        _known(mean, "prior mean", space)
        out = []
        for part in space.parts:
            whole = _whole_name(part)
            for key in [whole] if whole else part.names:
                width = part.size if whole else 1
                value = np.atleast_1d(_entry(mean, key, "prior mean"))
                if value.shape != (width,):
                    raise ShapeError(f"prior mean of {key!r}: expected {_count(width)}, got {mean[key]!r}")
                out.append(value)
        point = np.concatenate(out)
    else:
        point = _numbers(mean, "prior mean")
    if point.shape != (space.size,):
        raise ShapeError(f"prior mean: expected shape ({space.size},) ({', '.join(space.names)}), got {point.shape}")
    if not np.all(np.isfinite(point)):
        k = int(np.flatnonzero(~np.isfinite(point))[0])
        raise ShapeError(f"prior mean of {space.names[k]!r}: expected a finite number, got {point[k]}")
    defect = np.asarray(space.defect(jnp.asarray(point)))
    if np.any(defect != 0):
        k = int(np.flatnonzero(defect)[0])
        raise ShapeError(f"prior mean of {space.names[k]!r}: expected {_rule(space, k)}, got {point[k]:.6g}")
    return np.asarray(space.plus(jnp.asarray(point), jnp.zeros(space.dof)))


def _rule(space: AbstractSpace, k: int) -> str:
    start = 0
    for part in space.parts:
        if start <= k < start + part.size:
            if isinstance(part, Interval):
                return f"a number between {part.lower:g} and {part.upper:g}"
            return {"Quaternion": "a unit quaternion", "Positive": "a number above 0"}.get(
                type(part).__name__, "a point of its space"
            )
        start += part.size
    return "a point of its space"


def _whole_name(part: AbstractSpace) -> str | None:
    """The name of a signal stored as several numbers."""
    return part.names[0].removesuffix("_x") if part.size != part.dof else None


def _deviations(space: AbstractSpace, std: Any) -> np.ndarray:
    if isinstance(std, Mapping):
        _known(std, "prior std", space)
        out = []
        for part in space.parts:
            whole = _whole_name(part)
            for key in [whole] if whole else part.names:
                value = np.atleast_1d(_entry(std, key, "prior std"))
                width = part.dof if whole else 1
                if value.shape not in ((1,), (width,)):
                    wanted = f"1 or {width} numbers" if width > 1 else "1 number"
                    raise ShapeError(f"prior std of {key!r}: expected {wanted}, got {std[key]!r}")
                out.append(np.broadcast_to(value, (width,)))
        sigma = np.concatenate(out)
    else:
        sigma = _numbers(std, "prior std")
    if sigma.shape != (space.dof,):
        raise ShapeError(
            f"prior std: expected shape ({space.dof},) ({', '.join(space.tangent_names)}), got {sigma.shape}"
        )
    bad = np.flatnonzero(~(np.isfinite(sigma) & (sigma >= 0)))
    if bad.size:
        k = int(bad[0])
        raise CovarianceError(f"prior std of {space.tangent_names[k]!r}: expected at least 0, got {sigma[k]:.6g}")
    return sigma


def _count(width: int) -> str:
    return "1 number" if width == 1 else f"{width} numbers"


def _entry(given: Mapping[str, Any], key: str, role: str) -> np.ndarray:
    if key not in given:
        raise ShapeError(f"{role}: expected a value for {key!r}, got only {', '.join(map(repr, given)) or 'none'}")
    return _numbers(given[key], f"{role} of {key!r}")


def _known(given: Mapping[str, Any], role: str, space: AbstractSpace) -> None:
    names = list(dict.fromkeys(_whole_name(part) or key for part in space.parts for key in part.names))
    for name in given:
        if name not in names:
            raise ShapeError(f"{role}: {name!r} is not a state of the model; {did_you_mean(str(name), names)}")


def tangent_scale(space: AbstractSpace, point: np.ndarray) -> np.ndarray:
    """Tangent units per own unit at a point: 1 but for bounded numbers."""
    scale, i = [], 0
    for part in space.parts:
        here = jnp.asarray(point[i : i + part.size])
        if part.size == part.dof:
            scale.append(np.diag(np.asarray(jax.jacfwd(part.minus)(here, here))))
        else:
            scale.append(np.ones(part.dof))
        i += part.size
    return np.concatenate(scale)
