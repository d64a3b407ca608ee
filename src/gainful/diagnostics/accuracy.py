"""How far the estimates are from the truth, and how often inside their bands."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtri

from ..running import Result
from .consistency import without_rounding
from .rows import judged_rows
from .squares import check_level


def rmse(result: Result) -> dict[str, float]:
    """Root mean square error of each state that has a truth, by tangent name and in tangent units.

    Differences are those of the state's space: angles wrap, a quaternion has one error per body axis [rad], a positive
    number a relative one. Failed rows and rows that only split a long interval do not count.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> list(rmse(gf.run(gf.kalman_filter(), model, prior, log)))
        ['x0']
    """
    errors, known = _errors(result)
    squares = np.where(known, errors, 0.0) ** 2
    names, counts = result.model.space.tangent_names, known.sum(axis=0)
    return {name: float(np.sqrt(squares[:, j].sum() / counts[j])) for j, name in enumerate(names) if counts[j]}


def coverage(result: Result, level: float = 0.95) -> dict[str, float]:
    """Share of rows in which the truth lies inside the central interval at `level`, by tangent name.

    Args:
        result: of a run along a record with truth; states without truth are left out.
        level: probability that the interval claims.

    Raises:
        ConfigError: a level outside (0, 1).

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> 0.9 < coverage(gf.run(gf.kalman_filter(), model, prior, log))["x0"] < 1.0
        True
    """
    check_level(level)
    errors, known = _errors(result)
    inside = known & (np.abs(errors) <= ndtri(0.5 + 0.5 * level) * result.std)
    names, counts = result.model.space.tangent_names, known.sum(axis=0)
    return {name: float(inside[:, j].sum() / counts[j]) for j, name in enumerate(names) if counts[j]}


def _errors(result: Result) -> tuple[Float[np.ndarray, "T dof"], Bool[np.ndarray, "T dof"]]:
    """The errors, and where there is one that counts."""
    errors = without_rounding(result, result.error())
    return errors, np.isfinite(errors) & judged_rows(result)[:, None]
