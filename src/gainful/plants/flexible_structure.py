"""A rigid hub with elastic appendages: masses, modes, and what their motion keeps."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError
from ..spaces import rotate
from .rigid_spacecraft import inertia_matrix, inverse_3x3

INERTIA = ((3000.0, 35.0, 0.0), (35.0, 1500.0, 0.0), (0.0, 0.0, 2500.0))  # kg m^2
MODAL_MASS = (15.51, 19.92, 9.78)  # kg
MODAL_DAMPING = (0.01, 0.01, 0.01)  # N s/m
MODAL_STIFFNESS = (65.83, 708.94, 342.10)  # N/m
COUPLING = (145.00, 11.20, 84.00)  # kg m


class FlexibleState(eqx.Module):
    """The true state of a flexible spacecraft.

    Attributes:
        attitude: quaternion from body axes to inertial axes, scalar last.
        deflection: of the modes [m].
        rate: inertial rate of the hub in body axes [rad/s].
        deflection_rate: of the modes [m/s].
    """

    attitude: Float[Array, "4"]
    deflection: Float[Array, " m"]
    rate: Float[Array, "3"]
    deflection_rate: Float[Array, " m"]

    @property
    def coordinates(self) -> Float[Array, " size"]:
        """The state as one vector, in the order of the attributes."""
        return jnp.concatenate([self.attitude, self.deflection, self.rate, self.deflection_rate])

    @classmethod
    def at_rest(cls, modes: int) -> FlexibleState:
        """Body axes on inertial axes, and nothing moves."""
        return cls(jnp.array([0.0, 0.0, 0.0, 1.0]), jnp.zeros(modes), jnp.zeros(3), jnp.zeros(modes))

    @classmethod
    def of(cls, coordinates: Float[Array, " size"]) -> FlexibleState:
        """The state of a vector of coordinates."""
        modes = (coordinates.shape[0] - 7) // 2
        attitude, deflection, rate, deflection_rate = jnp.split(coordinates, [4, 4 + modes, 7 + modes])
        return cls(attitude, deflection, rate, deflection_rate)


class Modes(eqx.Module):
    """Natural modes, the slowest first.

    Attributes:
        frequencies: without damping [rad/s].
        damping_ratios: of each, by its own share of the damping.
    """

    frequencies: Float[np.ndarray, " m"]
    damping_ratios: Float[np.ndarray, " m"]


def _inertia(value: Any) -> Array:
    return inertia_matrix(value)


def _vector(value: Any) -> Array:
    return jnp.asarray(value, float)


def _coupling(value: Any) -> Array:
    given = jnp.asarray(value, float)
    return jnp.diag(given) if given.ndim == 1 else given


class FlexibleStructure(eqx.Module):
    """A hub that turns at `w` with appendages whose modes deflect by `q`, small against the size of the structure.

    ```
    J dw/dt + B^T d2q/dt2 + w x H = T,      H = J w + B^T dq/dt + h
    A d2q/dt2 + D dq/dt + E q + B dw/dt = 0
    ```

    `H` is the angular momentum in body axes. Without torque the motion keeps it in inertial axes, and the energy changes
    by what the torque does and the damping takes: `d energy/dt = w . T - dq/dt . D dq/dt`.

    Attributes:
        inertia: J of the whole, not deflected (3, 3) [kg m^2]; a vector is its diagonal.
        modal_mass: diagonal of A (m,) [kg].
        modal_damping: diagonal of D (m,) [N s/m].
        modal_stiffness: diagonal of E (m,) [N/m].
        coupling: B (m, 3) [kg m]; a vector is its diagonal, where each mode turns the hub about an axis of its own.
        wheel_momentum: h, stored in wheels that keep it in body axes (3,) [N m s].

    Raises:
        ShapeError: numbers of another shape.
        ModelError: numbers that are not finite, a mass or stiffness that is not positive, a negative damping, an inertia
            that is not symmetric, or a mass matrix `[[J, B^T], [B, A]]` that is not positive definite.

    Source: Likins (1970), Dynamics and Control of Flexible Space Vehicles, JPL TR 32-1329; the numbers are those of Liu,
        Shen and Hu, Attitude control of nonlinear flexible structure based on inversion algorithm of extended Kalman
        filter of high-order neural networks.
    Differs: the latter print the coupling with one derivative too many for the rate and one too few for the modes;
        accelerations on both sides are what units and the balance of energy ask for, and `H` holds the modes' share.
    Reduces to: the rigid body of `RigidSpacecraft` with `coupling` zero.

    Example:
        >>> FlexibleStructure().modes().frequencies.round(3).tolist()
        [2.783, 5.978, 7.012]
    """

    inertia: Array = eqx.field(converter=_inertia, default=INERTIA)
    modal_mass: Array = eqx.field(converter=_vector, default=MODAL_MASS)
    modal_damping: Array = eqx.field(converter=_vector, default=MODAL_DAMPING)
    modal_stiffness: Array = eqx.field(converter=_vector, default=MODAL_STIFFNESS)
    coupling: Array = eqx.field(converter=_coupling, default=COUPLING)
    wheel_momentum: Array = eqx.field(converter=_vector, default=(0.0, 0.0, 0.0))

    def __check_init__(self) -> None:
        if self.modal_mass.ndim != 1 or self.modal_mass.shape[0] < 1:
            raise ShapeError(f"modal_mass: expected one number per mode, got shape {self.modal_mass.shape}")
        m = self.count
        for name, shape in {
            "modal_damping": (m,),
            "modal_stiffness": (m,),
            "coupling": (m, 3),
            "wheel_momentum": (3,),
        }.items():
            if getattr(self, name).shape != shape:
                raise ShapeError(f"{name}: expected shape {shape}, got {getattr(self, name).shape}")
        if not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(self)):
            self._check_numbers()

    def _check_numbers(self) -> None:
        for name in ("inertia", "modal_mass", "modal_damping", "modal_stiffness", "coupling", "wheel_momentum"):
            if not np.isfinite(getattr(self, name)).all():
                raise ModelError(f"{name}: expected finite numbers, got {np.asarray(getattr(self, name)).tolist()}")
        for name in ("modal_mass", "modal_stiffness", "modal_damping"):
            value, may_vanish = np.asarray(getattr(self, name)), name == "modal_damping"
            k = int(value.argmin())
            if value[k] < 0 or (value[k] == 0 and not may_vanish):
                bound = "of at least 0" if may_vanish else "above 0"
                raise ModelError(f"{name}: expected numbers {bound}, got {value[k]:.6g} for mode {k + 1}")
        J = np.asarray(self.inertia)
        skew = np.abs(J - J.T)
        if skew.max() > 1e-9 * np.abs(J).max():
            i, j = (int(k) for k in np.unravel_index(int(skew.argmax()), skew.shape))
            raise ModelError(
                f"inertia: expected a symmetric matrix, got {J[i, j]:.6g} for {'xyz'[i]}{'xyz'[j]} "
                f"but {J[j, i]:.6g} for {'xyz'[j]}{'xyz'[i]}"
            )
        carried = np.diag(J - np.asarray(self.hub_inertia))
        short = np.diag(J) - carried
        if short.min() <= 0:
            k = int(short.argmin())
            raise ModelError(
                f"inertia: expected more than the modes carry, coupling^2 / modal_mass = {carried[k]:.6g} kg m^2 about "
                f"{'xyz'[k]}, got {J[k, k]:.6g} kg m^2"
            )
        least = float(np.linalg.eigvalsh(np.asarray(self.hub_inertia))[0])
        if least <= 1e-12 * np.trace(J):  # rounding
            raise ModelError(
                f"inertia: expected a positive definite matrix beyond what the modes carry, got the eigenvalue {least:.6g} "
                "kg m^2"
            )

    @property
    def count(self) -> int:
        """Number of modes."""
        return self.modal_mass.shape[0]

    @property
    def mass_matrix(self) -> Float[Array, "3+m 3+m"]:
        """`[[J, B^T], [B, A]]` [kg m^2, kg m, kg]."""
        return jnp.block([[self.inertia, self.coupling.T], [self.coupling, jnp.diag(self.modal_mass)]])

    @property
    def hub_inertia(self) -> Float[Array, "3 3"]:
        """`J - B^T A^-1 B`: what a torque meets at first, before the modes have moved [kg m^2]."""
        return self.inertia - (self.coupling.T / self.modal_mass) @ self.coupling

    def accelerations(self, torque: Float[Array, "3"], force: Float[Array, " m"]) -> Float[Array, " 3+m"]:
        """Of hub [rad/s^2] and modes [m/s^2] under a torque on the hub [N m] and forces on the modes [N]: `M^-1 [T; f]`."""
        turn = inverse_3x3(self.hub_inertia) @ (torque - self.coupling.T @ (force / self.modal_mass))
        return jnp.concatenate([turn, (force - self.coupling @ turn) / self.modal_mass])

    def rates(self, state: FlexibleState, torque: Float[Array, "3"]) -> Float[Array, " dof"]:
        """How fast attitude [rad/s], deflections, rate and their rates change under a torque on the hub [N m]."""
        gyroscopic = jnp.cross(state.rate, self.body_momentum(state))
        force = -self.modal_damping * state.deflection_rate - self.modal_stiffness * state.deflection
        return jnp.concatenate([state.rate, state.deflection_rate, self.accelerations(torque - gyroscopic, force)])

    def body_momentum(self, state: FlexibleState) -> Float[Array, "3"]:
        """Angular momentum H in body axes [N m s]."""
        return self.inertia @ state.rate + self.coupling.T @ state.deflection_rate + self.wheel_momentum

    def angular_momentum(self, state: FlexibleState) -> Float[Array, "3"]:
        """Angular momentum in inertial axes [N m s]."""
        return rotate(state.attitude, self.body_momentum(state))

    def energy(self, state: FlexibleState) -> Float[Array, ""]:
        """Of motion and of bending [J]; what the wheels hold is left out, for it stays."""
        w, q, v = state.rate, state.deflection, state.deflection_rate
        turning = 0.5 * w @ self.inertia @ w + w @ (self.coupling.T @ v)
        return turning + 0.5 * self.modal_mass @ v**2 + 0.5 * self.modal_stiffness @ q**2

    def modes(self, *, held: bool = False) -> Modes:
        """Modes about rest, of the free spacecraft or with its hub held (cantilever)."""
        B = np.asarray(self.coupling)
        moving = np.diag(np.asarray(self.modal_mass))
        if not held:
            moving = moving - B @ np.linalg.solve(np.asarray(self.inertia), B.T)
        squares, shapes = scipy.linalg.eigh(np.diag(np.asarray(self.modal_stiffness)), moving)
        frequencies = np.sqrt(squares)
        return Modes(frequencies, np.asarray(self.modal_damping) @ shapes**2 / (2.0 * frequencies))
