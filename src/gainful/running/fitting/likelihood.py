"""Maximum likelihood: the noise under which the record is least surprising."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy.optimize
from jaxtyping import Float

from .problem import Problem
from .search import Search, keeping

ONE_SIDED = 1.645
"""Standard errors to a limit that holds with 95 %, one-sided."""

ALLOWED = 0.5 * ONE_SIDED**2
"""How far the log likelihood falls at such a limit [nats]."""

ENOUGH = 1e-5
"""A search ends where a step gains less than this in the log likelihood of the whole record [nats]."""

ROUGHLY = 0.03
"""The same where the likelihood is wanted to tell a limit, not an estimate [nats]."""

FINE = 0.05
"""How closely such a limit is told, and jumps are looked for [logarithm of a standard deviation]."""

DIFFERENCE = 1e-3
"""Step in the logarithm of a standard deviation for second derivatives: errors of 1e-6 by curvature, less by rounding."""

WIDE = 0.2
"""The same where the likelihood jumps: so wide that jumps of a nat or two hardly count against what it falls by."""

JUMP = 0.2
"""A likelihood that jumps by less does not mislead a search [nats]."""

ASTRAY = 2
"""How the search by gradient says that the slope is not that of the likelihood."""


def by_likelihood(
    problem: Problem, bounds: tuple[float, float], iterations: int, starts: Sequence[Float[np.ndarray, " entries"]]
) -> Search:
    """The factors of the largest likelihood between bounds, the best of several starts.

    Quasi-Newton steps with bounds on the logarithms, gradients by differentiating the filter. The likelihood of a filter that
    takes a reading or leaves it, or clips it, jumps where a reading changes sides, and no slope tells of that: there the
    search is ended by one without slopes.

    Source: Byrd, Lu, Nocedal and Zhu (1995), SIAM J. Sci. Comput. 16(5):1190-1208; Nelder and Mead (1965), Computer J.
        7(4):308-313.
    """
    _, _, count = problem.loss(starts[0])
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
            options={"maxiter": iterations, "ftol": ENOUGH / count, "gtol": 1e-7},
        )
        rough = found.status == ASTRAY or _jumps(problem, found.x)
        if rough:
            found = _without_slope(problem, found.x, bounds, iterations, count, path)
        one = Search(found.x, len(path), bool(found.success), tuple(path), str(found.message), rough)
        if best is None or found.fun < problem.fitted_loss(best.logs)[0]:
            best = one
    assert best is not None
    return best


def _jumps(problem: Problem, logs: Float[np.ndarray, " entries"]) -> bool:
    """Whether the likelihood changes by something else than its slopes say."""
    _, _, count = problem.loss(logs)
    for i, unit in enumerate(np.eye(len(logs))):
        (ahead, slope), (behind, other) = (problem.fitted_loss(logs + sign * FINE * unit) for sign in (1, -1))
        told = FINE * (slope[i] + other[i])
        # The rule of trapezoids errs by less than a ten-thousandth nat a row where a row's likelihood bends as usual.
        if count * abs(ahead - behind - told) > JUMP + 2e-4 * count:
            return True
    return False


def _without_slope(
    problem: Problem,
    start: Float[np.ndarray, " entries"],
    bounds: tuple[float, float],
    iterations: int,
    count: int,
    path: list[float],
) -> scipy.optimize.OptimizeResult:
    """The same search from where the one by gradient stopped, by values alone."""
    corners = np.clip(np.vstack([start, start + WIDE * np.eye(len(start))]), *bounds)
    return scipy.optimize.minimize(
        lambda logs: problem.fitted_loss(logs)[0],
        start,
        method="Nelder-Mead",
        bounds=[bounds] * len(start),
        callback=keeping(path),
        options={
            "maxiter": iterations,
            "xatol": 0.01,
            "fatol": ROUGHLY / count,
            "initial_simplex": corners,
        },
    )


def curvature(
    problem: Problem, logs: Float[np.ndarray, " entries"], rough: bool = False
) -> Float[np.ndarray, "entries entries"]:
    """Second derivatives of the whole negative log likelihood in the logarithms.

    Args:
        problem: what is fitted to what.
        logs: where.
        rough: whether the likelihood jumps, so that its values tell more than its slopes.
    """
    _, _, count = problem.loss(logs)
    if rough:
        return count * _bend(lambda at: problem.fitted_loss(at)[0], logs)
    rows = []
    for unit in np.eye(len(logs)):
        ahead, behind = (problem.fitted_loss(logs + sign * DIFFERENCE * unit)[1] for sign in (1, -1))
        rows.append((ahead - behind) / (2 * DIFFERENCE))
    matrix = count * np.array(rows)
    return 0.5 * (matrix + matrix.T)


def _bend(loss: Callable[[np.ndarray], float], at: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n n"]:
    """Second derivatives of the parabola nearest to a function's values around a point."""
    units = np.eye(len(at))
    pairs = [(i, j) for i in range(len(at)) for j in range(i + 1)]
    moves = [reach * sign * unit for reach in (0.5, 1.0, 1.5) for sign in (1, -1) for unit in units]
    moves += [a * units[i] + b * units[j] for i, j in pairs if i != j for a in (1, -1) for b in (1, -1)]
    design = [[1.0, *move, *(move[i] * move[j] for i, j in pairs)] for move in moves]
    found = np.linalg.lstsq(np.array(design), np.array([loss(at + WIDE * move) for move in moves]), rcond=None)[0]
    out = np.zeros((len(at), len(at)))
    for (i, j), value in zip(pairs, found[1 + len(at) :], strict=True):
        out[i, j] = out[j, i] = (2.0 if i == j else 1.0) * value / WIDE**2
    return out


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
    options = {"maxiter": 10, "ftol": ROUGHLY / count}

    def beyond(value: float) -> bool:
        def loss(free: Float[np.ndarray, " others"]) -> tuple[float, Float[np.ndarray, " others"]]:
            at[index], at[others] = value, free
            found, slope = problem.fitted_loss(at)
            return found, slope[others]

        start = at[others].copy()  # where the last search ended
        found = loss(start)[0]
        if others and count * (found - best) > ALLOWED:
            found = scipy.optimize.minimize(loss, start, jac=True, method="L-BFGS-B", options=options).fun
        return bool(count * (found - best) > ALLOWED)

    low, high, step = float(logs[index]), math.inf, 0.7
    # By halving, which bears a likelihood that is known only roughly.
    while min(high, most) - low > FINE:
        middle = 0.5 * (low + high) if high < math.inf else min(low + step, most)
        if beyond(middle):
            high = middle
        else:
            low, step = middle, 1.5 * step
    return None if high == math.inf else 0.5 * (low + high)
