"""Rows of a regression on the motion of a marine vehicle, from what was recorded of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ShapeError
from ..regression import CENTRAL_DIFFERENCE, differentiate, weak_form
from ..regression.weak_form import WINDOW
from .vehicle_structure import VehicleStructure


def vehicle_rows(
    structure: VehicleStructure,
    nu: Float[Array, "T 6"],
    attitude: Float[Array, "T angles"],
    wrench: Float[Array, "T 6"],
    dt: float,
    *,
    std: Float[Array, "6"] | None = None,
    stencil: Sequence[float] = CENTRAL_DIFFERENCE,
) -> Float[Array, "T_inner 6 p"]:
    """Rows `[h, tau]` of six equations at each moment, the acceleration by a stencil.

    `information(rows, weights)` takes the six equations as it takes sensors, with a weight each.

    Args:
        structure: of the parameters.
        nu: velocity and turn rate in body axes, measured [m/s, rad/s].
        attitude: roll and pitch [rad] or quaternions, measured, see `gravity_direction`.
        wrench: forces and moments at the same times [N, N m].
        dt: time between samples [s].
        std: standard deviation of the noise in `nu`, to take its mean out of the squares of drag.
        stencil: of the derivative.

    Raises:
        ShapeError: velocities, attitudes and wrenches of unlike lengths, or fewer than the stencil has.

    Example:
        >>> still = jnp.zeros((9, 6))
        >>> vehicle_rows(VehicleStructure(), still, still[:, :2], still, 0.05).shape
        (5, 6, 22)
    """
    nu, attitude, wrench = _checked(nu, attitude, wrench)
    half = len(stencil) // 2
    inner = slice(half, len(nu) - half)
    nudot = differentiate(nu.T, dt, stencil).T
    columns = structure.inertial(nudot) + structure.remaining(nu[inner], attitude[inner], std)
    return jnp.concatenate([columns, wrench[inner, :, None]], axis=-1)


def weak_vehicle_rows(
    structure: VehicleStructure,
    nu: Float[Array, "T 6"],
    attitude: Float[Array, "T angles"],
    wrench: Float[Array, "T 6"],
    dt: float,
    *,
    std: Float[Array, "6"] | None = None,
    window: int = WINDOW,
) -> Float[Array, "T_inner 6 p"]:
    """Rows `[h, tau]` of six equations at each moment in weak form: a test function over all terms, nothing differentiated.

    Args:
        structure: of the parameters.
        nu: velocity and turn rate in body axes, measured [m/s, rad/s].
        attitude: roll and pitch [rad] or quaternions, measured, see `gravity_direction`.
        wrench: forces and moments at the same times [N, N m].
        dt: time between samples [s].
        std: standard deviation of the noise in `nu`, to take its mean out of the squares of drag.
        window: samples of the test function, odd.

    Raises:
        ConfigError: a window that is even or shorter than 3, or a step that is not above 0.
        ShapeError: velocities, attitudes and wrenches of unlike lengths, or fewer than the window has.

    Source: Messenger and Bortz (2021), Multiscale Model. Simul. 19(3):1474-1497.
    """
    nu, attitude, wrench = _checked(nu, attitude, wrench)
    slope = weak_form(nu.T, dt, window)[1].T
    still = jnp.concatenate([structure.remaining(nu, attitude, std), wrench[:, :, None]], axis=-1)
    smooth = jnp.moveaxis(weak_form(jnp.moveaxis(still, 0, -1), dt, window)[0], -1, 0)
    return smooth.at[..., :-1].add(structure.inertial(slope))


def _checked(nu: Any, attitude: Any, wrench: Any) -> tuple[Array, Array, Array]:
    nu, attitude, wrench = (jnp.asarray(each, float) for each in (nu, attitude, wrench))
    if nu.ndim != 2 or nu.shape[1] != 6:
        raise ShapeError(f"nu: expected shape (times, 6), got {nu.shape}")
    if wrench.shape != nu.shape:
        raise ShapeError(f"wrench: expected shape {nu.shape}, as the velocities, got {wrench.shape}")
    if attitude.ndim != 2 or len(attitude) != len(nu):
        raise ShapeError(f"attitude: expected {len(nu)} rows, as the velocities have, got shape {attitude.shape}")
    return nu, attitude, wrench
