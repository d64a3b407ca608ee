"""Where a search for noise ended."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import scipy.optimize
from jaxtyping import Float


@dataclasses.dataclass(frozen=True)
class Search:
    """Where a search ended.

    Attributes:
        logs: logarithms of the factors on standard deviations.
        iterations: how many it took.
        converged: whether it ended by itself.
        path: what was made small, iteration by iteration.
        why: what it said at its end.
        rough: whether what it made small jumps.
    """

    logs: Float[np.ndarray, " entries"]
    iterations: int
    converged: bool
    path: tuple[float, ...]
    why: str = ""
    rough: bool = False


def keeping(path: list[float]) -> Callable[[scipy.optimize.OptimizeResult], None]:
    """What a search calls after each iteration, to keep what it has made small."""

    def keep(intermediate_result: scipy.optimize.OptimizeResult) -> None:
        path.append(float(intermediate_result.fun))

    return keep
