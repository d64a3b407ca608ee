"""The numbers of a marine vehicle, and what of its equations needs no choice of parameters."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ShapeError
from .euler312 import quaternion_to_dcm

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Degrees of freedom in body axes: x forward, y to starboard, z down."""


class VehicleNumbers(eqx.Module):
    """The numbers of a marine vehicle as its equations have them.

    Attributes:
        mass_matrix: of rigid body and added mass together [kg, kg m, kg m^2] (6, 6).
        linear_drag: [N s/m, N s, N m s] (6, 6).
        quadratic_drag: [N s^2/m^2, N s^2, N m s^2] (6, 6).
        excess_weight: weight less buoyancy [N].
        lever: moments of weight and buoyancy, `W r_G - B r_B` [N m] (3,).
        offset: by which the recorded wrench is too large [N, N m] (6,).
    """

    mass_matrix: Float[Array, "6 6"]
    linear_drag: Float[Array, "6 6"]
    quadratic_drag: Float[Array, "6 6"]
    excess_weight: Float[Array, ""]
    lever: Float[Array, "3"]
    offset: Float[Array, "6"]

    @property
    def cautions(self) -> tuple[str, ...]:
        """What is not physical, such as drag that pushes; nothing is clipped."""
        M = np.asarray(self.mass_matrix)
        found = [
            f"mass_matrix is {mass:.4g} in {dof}: not positive definite"
            for dof, mass in zip(DOFS, np.diagonal(M), strict=True)
            if not mass > 0
        ]
        if not found:
            size = np.sqrt(np.diagonal(M))
            least = float(np.linalg.eigvalsh(M / np.outer(size, size))[0])
            if not least > 0:
                found.append(f"mass_matrix is not positive definite: smallest eigenvalue {least:.4g} at unit diagonal")
        for name in ("linear_drag", "quadratic_drag"):
            drag = np.diagonal(np.asarray(getattr(self, name)))
            found += [
                f"{name} is {value:.4g} in {dof}: drag that pushes"
                for dof, value in zip(DOFS, drag, strict=True)
                if not value >= 0
            ]
        if not self.lever[2] >= 0:
            found.append(f"lever is {float(self.lever[2]):.4g} N m along z: the vehicle turns over")
        return tuple(found)


def gravity_direction(attitude: Float[Array, "*batch angles"]) -> Float[Array, "*batch 3"]:
    """Unit vector down in body axes.

    Args:
        attitude: roll and pitch [rad], with or without a yaw after them, or a quaternion from body axes to north, east, down,
            scalar last.

    Raises:
        ShapeError: neither 2, 3 nor 4 numbers.

    Example:
        >>> (gravity_direction(jnp.array([0.0, 0.5 * jnp.pi])) + 0.0).round(9).tolist()
        [-1.0, 0.0, 0.0]
    """
    given = jnp.asarray(attitude, float)
    count = given.shape[-1] if given.ndim else 0
    if count == 4:
        return jnp.vectorize(_down, signature="(4)->(3)")(given)
    if count not in (2, 3):
        raise ShapeError(
            f"attitude: expected roll and pitch, with or without yaw, or a quaternion, got {count} numbers"
        )
    roll, pitch = given[..., 0], given[..., 1]
    across = jnp.cos(pitch)
    return jnp.stack([-jnp.sin(pitch), across * jnp.sin(roll), across * jnp.cos(roll)], axis=-1)


def _down(q: Array) -> Array:
    return quaternion_to_dcm(q)[:, 2]


def coriolis_wrench(momentum: Float[Array, "*batch 6"], nu: Float[Array, "*batch 6"]) -> Float[Array, "*batch 6"]:
    """`C(nu) nu` after Kirchhoff: `[w x l; w x h + v x l]` of the momentum `[l; h] = M nu` and `nu = [v; w]`."""
    l, h = jnp.split(momentum, 2, axis=-1)
    v, w = jnp.split(jnp.broadcast_to(nu, momentum.shape), 2, axis=-1)
    return jnp.concatenate([jnp.cross(w, l), jnp.cross(w, h) + jnp.cross(v, l)], axis=-1)
