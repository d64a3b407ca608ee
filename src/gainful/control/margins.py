"""How wrong a model may be before a one-step inverse of it loses the plant."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..errors import ConfigError


def gain_margin(alpha: float, beta: float) -> float:
    """Largest ratio of a plant's true effectiveness to its model's at which the one-step inverse is stable.

        0 < ratio < 4 / (2 alpha + 2 beta - alpha beta)

    Compensation takes from the margin: a mean error that follows at once, `alpha = 1`, is incremental inversion, with 4/3 in
    place of 2. A smaller `beta` gives it back.

    Args:
        alpha: gain of the running mean of the error, 0 for no compensation, at most 1.
        beta: share of the error that the command asks to be gone after a step, above 0 and at most 1.

    Raises:
        ConfigError: numbers out of their range.

    Example:
        >>> gain_margin(0.0, 1.0), round(gain_margin(1.0, 1.0), 4), gain_margin(1.0, 0.5)
        (2.0, 1.3333, 1.6)
    """
    _check(alpha, beta)
    return 4.0 / (2.0 * alpha + 2.0 * beta - alpha * beta)


def error_dynamics(ratio: float, alpha: float, beta: float) -> Float[np.ndarray, "2 2"]:
    """What takes the error of a rate loop and the running mean of the model's error one step on.

    With `r`, the ratio of true to modelled effectiveness, it is

        [[1 - r beta, -r], [alpha beta (1 - r), 1 - alpha r]]

    Raises:
        ConfigError: numbers out of their range.
    """
    _check(alpha, beta)
    return np.array([[1.0 - ratio * beta, -ratio], [alpha * beta * (1.0 - ratio), 1.0 - alpha * ratio]])


def _check(alpha: float, beta: float) -> None:
    if not 0 <= alpha <= 1:
        raise ConfigError(f"alpha: expected a number of at least 0 and at most 1, got {alpha!r}")
    if not 0 < beta <= 1:
        raise ConfigError(f"beta: expected a number above 0 and at most 1, got {beta!r}")
