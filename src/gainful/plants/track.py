"""A body on a straight track with position fixes: displacement and speed, each disturbed by white noise."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from ..errors import ModelError
from ..models import Model, linear_model

STEP = 10.0  # s
"""Interval to which the standard deviations of the noise belong."""
POSITION_SIGMA, SPEED_SIGMA, FIX_SIGMA = 1.4, 0.005, 0.4  # m, m/s, m
"""Noise that a designer assumes who trusts the speed and not the fixes."""


def track_transition(dt: Any) -> Float[Array, "2 2"]:
    """Displacement and speed after `dt` [s]."""
    return jnp.array([[1.0, 0.0], [0.0, 1.0]]) + jnp.asarray(dt) * jnp.array([[0.0, 1.0], [0.0, 0.0]])


def _transition(x: Array, u: Array, t: Array, dt: Array) -> Array:
    return track_transition(dt)


class _White(eqx.Module):
    """Covariance of white noise in displacement and speed, in proportion to the interval."""

    variances: Float[Array, "2"]

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        return jnp.diag(self.variances) * dt / STEP


def track(
    position_sigma: float | Array = POSITION_SIGMA,
    speed_sigma: float | Array = SPEED_SIGMA,
    fix_sigma: float | Array = FIX_SIGMA,
) -> Model:
    """A body on a track: `x <- x + v dt + w1`, `v <- v + w2`, `y = x + noise`, as a ship between fixes every 10 s.

    Noise in displacement stands for what carries the body without its log knowing, such as a current.

    Args:
        position_sigma: standard deviation of `w1` over 10 s [m]; its variance grows with the interval.
        speed_sigma: of `w2` over 10 s [m/s], likewise.
        fix_sigma: of a fix [m].

    Raises:
        ModelError: a standard deviation below 0.

    Source: Zhang, Yang and Sun (2010), Modern Electronics Technique 33(21):51-53.

    Example:
        >>> track().space.names
        ('displacement', 'speed')
    """
    sigmas = {"position_sigma": position_sigma, "speed_sigma": speed_sigma, "fix_sigma": fix_sigma}
    for name, value in sigmas.items():
        if isinstance(value, (int, float)) and not value >= 0:
            raise ModelError(f"{name}: expected a standard deviation of at least 0, got {value!r}")
    position, speed, fix = (jnp.asarray(value, float) for value in sigmas.values())
    return linear_model(
        _transition,
        jnp.eye(1, 2),
        states={"displacement": "m", "speed": "m/s"},
        outputs={"fix": "m"},
        Q=_White(jnp.stack([position, speed]) ** 2),
        R=(fix**2)[None, None],
    )


def settled_track_covariance(
    position_sigma: float = POSITION_SIGMA, speed_sigma: float = SPEED_SIGMA, fix_sigma: float = FIX_SIGMA
) -> Float[np.ndarray, "2 2"]:
    """Covariance after a fix, once fixes every 10 s have come for long, if noise is as these say.

    Args:
        position_sigma: as in `track` [m].
        speed_sigma: likewise [m/s].
        fix_sigma: likewise [m].

    Example:
        >>> settled_track_covariance().round(4).tolist()
        [[0.1491, 0.0005], [0.0005, 0.0007]]
    """
    F, H = np.array([[1.0, STEP], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    before = scipy.linalg.solve_discrete_are(
        F.T, H.T, np.diag([position_sigma**2, speed_sigma**2]), np.array([[fix_sigma**2]])
    )
    gain = before[:, :1] / (before[0, 0] + fix_sigma**2)
    return before - gain @ before[:1]
