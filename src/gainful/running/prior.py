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
from ..spaces import AbstractSpace


def make_prior(model: AbstractModel, mean: Any, std: Any = None, *, cov: Any = None) -> Gaussian:
    """The estimate before the first sample.

    Args:
        model: whose state it is.
        mean: one number per state coordinate, or a mapping from state name to number; a quaternion is named as a whole
            and given as four numbers, scalar last.
        std: standard deviations: one number per degree of freedom, or a mapping from state name to number, in the state's
            own unit (for a quaternion: rad, one number or three).
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
        sigma = _deviations(space, std) * _tangent_scale(space, point)
        cov = np.diag(sigma**2)
    matrix = np.asarray(cov, dtype=float)
    if matrix.shape != (space.dof, space.dof):
        raise ShapeError(f"prior cov: expected shape ({space.dof}, {space.dof}), got {matrix.shape}")
    check_covariance(matrix, "prior cov", space.tangent_names)
    return Gaussian.start(jnp.asarray(point), jnp.asarray(matrix), space)


def _mean(space: AbstractSpace, mean: Any) -> np.ndarray:
    if isinstance(mean, Mapping):
        out, left = [], dict(mean)
        for part in space.parts:
            whole = _whole_name(part)
            keys = [whole] if whole else list(part.names)
            for key in keys:
                if key not in left:
                    raise ShapeError(f"prior mean: expected a value for {key!r}, got {sorted(mean)}")
                value = np.atleast_1d(np.asarray(left.pop(key), dtype=float))
                if value.shape != ((part.size,) if whole else (1,)):
                    raise ShapeError(f"prior mean of {key!r}: expected {part.size if whole else 1} numbers, got {value}")
                out.append(value)
        _no_more(left, "prior mean", space)
        point = np.concatenate(out)
    else:
        point = np.asarray(mean, dtype=float)
    if point.shape != (space.size,):
        raise ShapeError(f"prior mean: expected shape ({space.size},) ({', '.join(space.names)}), got {point.shape}")
    if not np.all(np.isfinite(point)):
        k = int(np.flatnonzero(~np.isfinite(point))[0])
        raise ShapeError(f"prior mean of {space.names[k]!r}: expected a finite number, got {point[k]}")
    defect = np.asarray(space.defect(jnp.asarray(point)))
    if np.any(defect != 0):
        k = int(np.flatnonzero(defect)[0])
        raise ShapeError(f"prior mean of {space.names[k]!r}: {point[k]:.6g} is outside the state's space ({_rule(space, k)})")
    return np.asarray(space.plus(jnp.asarray(point), jnp.zeros(space.dof)))


def _rule(space: AbstractSpace, k: int) -> str:
    start = 0
    for part in space.parts:
        if start <= k < start + part.size:
            return {"Quaternion": "a unit quaternion", "Positive": "above zero"}.get(type(part).__name__, "inside its bounds")
        start += part.size
    return "its space"


def _whole_name(part: AbstractSpace) -> str | None:
    """The name of a signal stored as several numbers."""
    return part.names[0].removesuffix("_x") if part.size != part.dof else None


def _deviations(space: AbstractSpace, std: Any) -> np.ndarray:
    if isinstance(std, Mapping):
        out, left = [], dict(std)
        for part in space.parts:
            whole = _whole_name(part)
            for key in [whole] if whole else part.names:
                if key not in left:
                    raise ShapeError(f"prior std: expected a value for {key!r}, got {sorted(std)}")
                value = np.atleast_1d(np.asarray(left.pop(key), dtype=float))
                width = part.dof if whole else 1
                if value.shape not in ((1,), (width,)):
                    raise ShapeError(f"prior std of {key!r}: expected 1 or {width} numbers, got {value}")
                out.append(np.broadcast_to(value, (width,)))
        _no_more(left, "prior std", space)
        sigma = np.concatenate(out)
    else:
        sigma = np.asarray(std, dtype=float)
    if sigma.shape != (space.dof,):
        raise ShapeError(f"prior std: expected shape ({space.dof},) ({', '.join(space.tangent_names)}), got {sigma.shape}")
    bad = np.flatnonzero(~(np.isfinite(sigma) & (sigma >= 0)))
    if bad.size:
        k = int(bad[0])
        raise CovarianceError(f"prior std of {space.tangent_names[k]!r}: expected at least 0, got {sigma[k]:.6g}")
    return sigma


def _no_more(left: dict[str, Any], role: str, space: AbstractSpace) -> None:
    if left:
        name = next(iter(left))
        known = [_whole_name(part) or key for part in space.parts for key in part.names]
        raise ShapeError(f"{role}: {name!r} is not a state of the model; {did_you_mean(name, known)}")


def _tangent_scale(space: AbstractSpace, point: np.ndarray) -> np.ndarray:
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
