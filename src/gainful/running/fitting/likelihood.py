"""Maximum likelihood: the noise under which the record is least surprising."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.optimize
from jaxtyping import Float

from .problem import Problem
from .search import Search, keeping

ALLOWED = 1.353
"""Half the square of 1.645: how far the log likelihood falls at a limit that holds with 95 %, one-sided."""

DIFFERENCE = 1e-3
"""Step in the logarithm of a standard deviation for second derivatives: errors of 1e-6 by curvature, less by rounding."""


def by_likelihood(
    problem: Problem, bounds: tuple[float, float], iterations: int, starts: Sequence[Float[np.ndarray, " entries"]]
) -> Search:
    """The factors of the largest likelihood between bounds, the best of several starts.

    Quasi-Newton steps with bounds on the logarithms, gradients by differentiating the filter.

    Source: Byrd, Lu, Nocedal and Zhu (1995), SIAM J. Sci. Comput. 16(5):1190-1208.
    """
    best: Search | None = None
    for start in starts:
        path: list[float] = []
        found = scipy.optimize.minimize(
            problem.fitted_loss,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[bounds] * len(start),
            callback=keeping(path),
            options={"maxiter": iterations, "ftol": 1e-11, "gtol": 1e-6},
        )
        one = Search(found.x, int(found.nit), bool(found.success), tuple(path), str(found.message))
        if best is None or found.fun < problem.fitted_loss(best.logs)[0]:
            best = one
    assert best is not None
    return best


def curvature(problem: Problem, logs: Float[np.ndarray, " entries"]) -> Float[np.ndarray, "entries entries"]:
    """Second derivatives of the whole negative log likelihood in the logarithms."""
    _, _, count = problem.loss(logs)
    rows = []
    for unit in np.eye(len(logs)):
        ahead, behind = (problem.fitted_loss(logs + sign * DIFFERENCE * unit)[1] for sign in (1, -1))
        rows.append((ahead - behind) / (2 * DIFFERENCE))
    matrix = count * np.array(rows)
    return 0.5 * (matrix + matrix.T)


def upper_limit(problem: Problem, logs: Float[np.ndarray, " entries"], index: int, most: float) -> float | None:
    """The largest logarithm of one factor that the record allows with 95 %, all others at their best for it.

    Args:
        problem: what is fitted to what.
        logs: those of the largest likelihood.
        index: of the entry.
        most: where the search ends.

    Returns:
        Where the log likelihood has fallen by `ALLOWED`, or None if it has not at `most`.
    """
    best, _, count = problem.loss(logs)
    others = [i for i in range(len(logs)) if i != index]
    at = logs.copy()

    def beyond(value: float) -> float:
        def loss(free: Float[np.ndarray, " others"]) -> tuple[float, Float[np.ndarray, " others"]]:
            at[index], at[others] = value, free
            found, slope = problem.fitted_loss(at)
            return found, slope[others]

        start = logs[others]
        if others:
            found = scipy.optimize.minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": 20}).fun
        else:
            found = loss(start)[0]
        return count * (float(found) - best) - ALLOWED

    low, step = float(logs[index]), 0.7
    while low < most:
        high = min(low + step, most)
        if beyond(high) > 0:
            return float(scipy.optimize.root_scalar(beyond, bracket=(low, high), xtol=0.02).root)
        low, step = high, 1.5 * step
    return None
