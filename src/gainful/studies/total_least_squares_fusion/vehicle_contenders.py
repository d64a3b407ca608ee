"""Estimators of all parameters of a vehicle in six degrees of freedom, and one that takes these one by one."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...plants import bluerov2, vehicle_rows, weak_vehicle_rows
from ...regression import information, instrumental_variables, least_squares, total_least_squares
from .vehicle_records import STEP, CleanRecord, VehicleRecord, own_columns

SETTLED = 3
"""How often the equations are weighed anew."""
STENCIL = (-0.5, 0.0, 0.5)
"""Of central differences: of all that are exact for ramps the one with the least noise on three samples."""

PLAIN, ISOTROPIC, SINGLE = "LS", "isotropic TLS", "one DOF at a time"
WEAK, WEAK_CROSS, WEAK_WIDE, WEAK_CROSS_WIDE = "weak LS", "weak IV", "weak LS, W = 31", "weak IV, W = 31"

Solve = Callable[[Array], Array]
"""From weights of the six equations to parameters."""


def settled(solve: Solve, residual: Callable[[Array], Array]) -> Array:
    """Parameters with each equation weighed by the inverse of the mean square of what it leaves.

    Args:
        solve: from weights to parameters.
        residual: from parameters to what the equations leave (..., 6).
    """
    theta = solve(jnp.ones(6))
    for _ in range(SETTLED):
        left = residual(theta)
        theta = solve(1.0 / jnp.mean(left**2, axis=tuple(range(left.ndim - 1))))
    return theta


def _left(rows: Float[Array, "... 6 p"]) -> Callable[[Array], Array]:
    return lambda theta: rows[..., -1] - rows[..., :-1] @ theta


class Averaged(eqx.Module):
    """A contender: least squares of the mean of both sensors.

    Attributes:
        window: of the weak form; 0 for central differences.
    """

    window: int = eqx.field(static=True)

    def __call__(self, record: VehicleRecord) -> Array:
        rows = mean_rows(record, self.window)
        return settled(lambda weights: least_squares(information(rows, weights)).theta, _left(rows))


def isotropic(record: VehicleRecord) -> Array:
    """A contender: equal noise in all columns of all equations, differentiated velocities of the mean of both sensors."""
    return total_least_squares(information(mean_rows(record, 0))).theta


class Across(eqx.Module):
    """A contender: instrumental variables in weak form, each sensor the instrument of the other.

    Attributes:
        window: of the weak form.
    """

    window: int = eqx.field(static=True)

    def __call__(self, record: VehicleRecord) -> Array:
        structure = bluerov2().structure
        std = jnp.broadcast_to(record.std, (6,))
        first, second = (
            weak_vehicle_rows(structure, nu, attitude, record.wrench, STEP, std=std, window=self.window)
            for nu, attitude in zip(record.nu, record.attitude, strict=True)
        )

        def solve(weights: Array) -> Array:
            scale = jnp.sqrt(weights)[:, None]
            flat = ((scale * each).reshape(-1, each.shape[-1]) for each in (first, second))
            return instrumental_variables(*flat).theta

        return settled(solve, _left(jnp.stack([first, second])))


class Single(eqx.Module):
    """A contender: each degree of freedom by itself, as if it were not coupled with the others.

    Attributes:
        window: of the weak form.
    """

    window: int = eqx.field(static=True)

    def __call__(self, record: VehicleRecord) -> Array:
        return one_by_one(mean_rows(record, self.window))[0]


def mean_rows(record: VehicleRecord, window: int) -> Float[Array, "T 6 p"]:
    """Rows of the mean of both sensors, in weak form or, for a window of 0, by central differences."""
    structure = bluerov2().structure
    signals = (jnp.mean(record.nu, axis=0), jnp.mean(record.attitude, axis=0), record.wrench, STEP)
    if not window:
        return vehicle_rows(structure, *signals, stencil=STENCIL)
    std = jnp.broadcast_to(record.std / jnp.sqrt(2.0), (6,))
    return weak_vehicle_rows(structure, *signals, std=std, window=window)


def one_by_one(rows: Float[Array, "T 6 p"]) -> tuple[Float[Array, "n"], Float[Array, "T 6"]]:
    """Inertia and drag of each degree of freedom from its own equation alone, and what that leaves.

    Parameters that couple them are NaN.
    """
    theta = jnp.full(rows.shape[-1] - 1, jnp.nan)
    left = []
    for dof in range(6):
        columns = own_columns(dof)
        own = rows[:, dof, np.append(columns, -1)]
        fit = least_squares(information(own[:, None]))
        theta = theta.at[columns].set(fit.theta)
        left.append(own[:, -1] - own[:, :-1] @ fit.theta)
    return theta, jnp.stack(left, axis=1)


def coupled_fit(record: CleanRecord) -> tuple[Array, Array]:
    """All six equations together: parameters, and what the equations leave."""
    theta = least_squares(information(record.rows)).theta
    return theta, _left(record.rows)(theta)


def single_fit(record: CleanRecord) -> tuple[Array, Array]:
    """Each equation by itself, likewise."""
    return one_by_one(record.rows)


def contenders() -> dict[str, Callable[[VehicleRecord], Array]]:
    """From the simplest to those that ask for no derivative, and one that leaves out the coupling."""
    return {
        PLAIN: Averaged(0),
        ISOTROPIC: isotropic,
        WEAK: Averaged(15),
        WEAK_CROSS: Across(15),
        WEAK_WIDE: Averaged(31),
        WEAK_CROSS_WIDE: Across(31),
        SINGLE: Single(15),
    }
