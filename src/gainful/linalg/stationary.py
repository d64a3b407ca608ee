"""The gain that a filter of a constant linear model settles to."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_STEPS = 20_000
"""Steps in which a gain must have become stationary."""

_SETTLED = 1e-12
"""Relative change of the gain per step that counts as none."""


def stationary_gain(
    F: Float[np.ndarray, "n n"], H: Float[np.ndarray, "m n"], Q: Float[np.ndarray, "n n"], R: Float[np.ndarray, "m m"]
) -> Float[np.ndarray, "n m"] | None:
    """`K` such that `x <- F x + K (y - H F x)` is the Kalman filter once its start is forgotten; None if it never settles.

    By the filter's own recursion from a wide start, which needs no more of the model than the filter does.

    Example:
        >>> round(float(stationary_gain(np.eye(1), np.eye(1), np.eye(1), np.eye(1))[0, 0]), 4)
        0.618
    """
    F, H, Q, R = (np.asarray(each, float) for each in (F, H, Q, R))
    P, last = Q + (np.trace(Q) + np.trace(R)) * np.eye(len(F)), np.full((len(F), len(H)), np.inf)
    for _ in range(_STEPS):
        P = F @ P @ F.T + Q
        gain = np.linalg.solve(H @ P @ H.T + R, H @ P).T
        keep = np.eye(len(F)) - gain @ H
        P = keep @ P @ keep.T + gain @ R @ gain.T
        if np.abs(gain - last).max() <= _SETTLED * np.abs(gain).max():
            return gain
        last = gain
    return None
