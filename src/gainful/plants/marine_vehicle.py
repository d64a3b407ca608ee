"""A submerged vehicle in six degrees of freedom: the truth behind a record, and what a record says of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError
from ..models import runge_kutta_4
from ..spaces import Quaternion
from .marine_motion import MarineMotion, attitude_quaternion
from .vehicle_numbers import VehicleNumbers, coriolis_wrench, gravity_direction
from .vehicle_structure import VehicleStructure


def _vector(value: Any) -> Array:
    return jnp.asarray(value, float)


def _matrix(value: Any) -> Array:
    given = jnp.asarray(value, float)
    return jnp.diag(given) if given.ndim == 1 else given


class MarineVehicle(eqx.Module):
    """A rigid body in a fluid: `M nudot + C(nu) nu + D nu + D2 nu|nu| + g(attitude) = tau`.

    ```
    [l; h] = M nu,  nu = [v; w]:   C(nu) nu = [w x l; w x h + v x l],   nu^T C(nu) nu = 0
    g = -[(W - B) d; (W r_G - B r_B) x d]   with d the unit vector down
    ```

    The attitude enters through the direction of gravity alone, so that no pitch is singular.

    Attributes:
        mass_matrix: of rigid body and added mass together, symmetric (6, 6), or its diagonal [kg, kg m, kg m^2].
        linear_drag: `D` (6, 6) or its diagonal [N s/m, N s, N m s].
        quadratic_drag: `D2` (6, 6) or its diagonal [N s^2/m^2, N s^2, N m s^2].
        weight: W [N].
        buoyancy: B [N].
        r_g: centre of gravity in body axes [m].
        r_b: centre of buoyancy likewise [m].
        structure: which of its numbers are parameters of a regression; those left out must be zero.
        offset: by which the recorded wrench is too large [N, N m].

    Raises:
        ShapeError: numbers of another shape.
        ModelError: a mass matrix that is not symmetric, or numbers that the structure has no parameter for.

    Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapters 3, 4, 6 and 7.
    Reduces to: `SingleDofVehicle` for a motion in one degree of freedom of a neutral vehicle with diagonal matrices.

    Example:
        >>> vehicle = bluerov2()
        >>> [round(force, 4) for force in vehicle.wrench(jnp.zeros(6), jnp.zeros(6), jnp.array([0.0, 0.1])).tolist()]
        [-0.1997, 0.0, 1.99, 0.0, 0.2252, 0.0]
    """

    mass_matrix: Array = eqx.field(converter=_matrix)
    linear_drag: Array = eqx.field(converter=_matrix)
    quadratic_drag: Array = eqx.field(converter=_matrix)
    weight: Array = eqx.field(converter=_vector)
    buoyancy: Array = eqx.field(converter=_vector)
    r_g: Array = eqx.field(converter=_vector)
    r_b: Array = eqx.field(converter=_vector, default=(0.0, 0.0, 0.0))
    structure: VehicleStructure = eqx.field(static=True, default=VehicleStructure())
    offset: Array = eqx.field(converter=_vector, default=(0.0,) * 6)

    def __check_init__(self) -> None:
        shapes = {"mass_matrix": (6, 6), "linear_drag": (6, 6), "quadratic_drag": (6, 6), "weight": (), "buoyancy": ()}
        for name, shape in {**shapes, "r_g": (3,), "r_b": (3,), "offset": (6,)}.items():
            if getattr(self, name).shape != shape:
                raise ShapeError(f"{name}: expected shape {shape}, got {getattr(self, name).shape}")
        if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(self)):
            return
        M = np.asarray(self.mass_matrix)
        if np.abs(M - M.T).max() > 1e-9 * np.abs(M).max():
            raise ModelError("mass_matrix: expected a symmetric matrix")
        own, told = self.numbers, self.structure.numbers(self.parameters)
        for name in ("mass_matrix", "linear_drag", "quadratic_drag", "lever", "offset"):
            whole, kept = np.asarray(getattr(own, name)), np.asarray(getattr(told, name))
            left = np.abs(whole - kept)
            if left.max() > 1e-9 * max(np.abs(whole).max(), 1.0):
                place = tuple(int(k) for k in np.unravel_index(int(left.argmax()), left.shape))
                raise ModelError(
                    f"structure: has no parameter for {name}[{', '.join(map(str, place))}] = {whole[place]:.4g}, "
                    f"got {self.structure}"
                )

    @property
    def numbers(self) -> VehicleNumbers:
        """The vehicle as its equations have it."""
        return VehicleNumbers(
            self.mass_matrix,
            self.linear_drag,
            self.quadratic_drag,
            self.weight - self.buoyancy,
            self.weight * self.r_g - self.buoyancy * self.r_b,
            self.offset,
        )

    @property
    def parameters(self) -> Float[Array, " n"]:
        """The parameters of the structure, with names and units in `structure.units`."""
        return self.structure.parameters(self.numbers)

    def with_parameters(self, parameters: Float[Array, " n"]) -> MarineVehicle:
        """This vehicle with other parameters, such as those of a regression; see `cautions` of it.

        Weight and centre of gravity are such that buoyancy and its centre stay.

        Raises:
            ShapeError: not as many as the structure has.
        """
        new = self.structure.numbers(parameters)
        weight = self.buoyancy + new.excess_weight
        r_g = (new.lever + self.buoyancy * self.r_b) / weight
        return MarineVehicle(
            new.mass_matrix,
            new.linear_drag,
            new.quadratic_drag,
            weight,
            self.buoyancy,
            r_g,
            self.r_b,
            structure=self.structure,
            offset=new.offset,
        )

    @property
    def cautions(self) -> tuple[str, ...]:
        """What is not physical of the vehicle, such as drag that pushes; nothing is clipped."""
        return self.numbers.cautions

    def coriolis(self, nu: Float[Array, "6"]) -> Float[Array, "6 6"]:
        """`C(nu)`, skew-symmetric."""
        l, h = jnp.split(self.mass_matrix @ jnp.asarray(nu, float), 2)
        return jnp.block([[jnp.zeros((3, 3)), -_cross_matrix(l)], [-_cross_matrix(l), -_cross_matrix(h)]])

    def remaining(
        self, nu: Float[Array, "*batch 6"], attitude: Float[Array, "*batch angles"]
    ) -> Float[Array, "*batch 6"]:
        """The wrench that the motion needs besides `M nudot` [N, N m]."""
        nu, down, own = jnp.asarray(nu, float), gravity_direction(attitude), self.numbers
        force = -own.excess_weight * down
        moment = jnp.cross(down, jnp.broadcast_to(own.lever, down.shape))
        drag = nu @ own.linear_drag.T + (nu * jnp.abs(nu)) @ own.quadratic_drag.T
        gravity = jnp.concatenate([force, moment], axis=-1)
        return coriolis_wrench(nu @ own.mass_matrix.T, nu) + drag + gravity + own.offset

    def wrench(
        self,
        nudot: Float[Array, "*batch 6"],
        nu: Float[Array, "*batch 6"],
        attitude: Float[Array, "*batch angles"],
    ) -> Float[Array, "*batch 6"]:
        """Forces and moments that a motion needs [N, N m].

        Args:
            nudot: acceleration in body axes [m/s^2, rad/s^2].
            nu: velocity and turn rate in body axes [m/s, rad/s].
            attitude: roll and pitch [rad] or a quaternion, see `gravity_direction`.
        """
        return jnp.asarray(nudot, float) @ self.mass_matrix.T + self.remaining(nu, attitude)

    def acceleration(
        self,
        nu: Float[Array, "*batch 6"],
        attitude: Float[Array, "*batch angles"],
        wrench: Float[Array, "*batch 6"],
    ) -> Float[Array, "*batch 6"]:
        """Rate of change of the velocity in body axes under forces and moments [m/s^2, rad/s^2]."""
        excess = jnp.asarray(wrench, float) - self.remaining(nu, attitude)
        return excess @ jnp.linalg.inv(self.mass_matrix).T

    def regressor(
        self,
        nudot: Float[Array, "*batch 6"],
        nu: Float[Array, "*batch 6"],
        attitude: Float[Array, "*batch angles"],
    ) -> Float[Array, "*batch 6 n"]:
        """What the parameters are multiplied by to give the wrench, see `VehicleStructure.regressor`."""
        return self.structure.regressor(nudot, nu, attitude)

    def simulate(
        self,
        t: Float[Array, " T"],
        wrench: Float[Array, "T 6"] | Callable[[Array], Array],
        nu: Float[Array, "6"] | None = None,
        attitude: Float[Array, " angles"] | None = None,
    ) -> MarineMotion:
        """The motion at some times, by one Runge-Kutta step from each to the next.

        Args:
            t: times, rising [s].
            wrench: forces and moments [N, N m]: a function of time, or numbers, each held over the interval that ends at its
                time.
            nu: at the first time; at rest by default [m/s, rad/s].
            attitude: roll, pitch and yaw [rad] or a quaternion at the first time; level by default.

        Raises:
            ShapeError: not one wrench per time, or a start of another shape.

        Example:
            >>> bluerov2().simulate(jnp.arange(3.0), jnp.zeros((3, 6))).nu.shape
            (3, 6)
        """
        t = jnp.asarray(t, float)
        start = jnp.zeros(6) if nu is None else jnp.asarray(nu, float)
        if start.shape != (6,):
            raise ShapeError(f"nu: expected shape (6,), got {start.shape}")
        if not callable(wrench):
            wrench = jnp.asarray(wrench, float)
            if wrench.shape != (*t.shape, 6):
                raise ShapeError(f"wrench: expected shape {(*t.shape, 6)}, one row per time, got {wrench.shape}")
        return _simulated(self, t, wrench, jnp.concatenate([start, attitude_quaternion(attitude)]))


@eqx.filter_jit
def _simulated(vehicle: MarineVehicle, t: Array, wrench: Any, start: Array) -> MarineMotion:
    space = Quaternion("attitude")
    given: Callable[[Array], Any] | None = wrench if callable(wrench) else None
    held = jnp.asarray(wrench) if given is None else jax.vmap(given)(t)

    def step(z: Array, interval: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        before, dt, tau = interval

        def rate(own: Array, now: Array) -> Array:
            force = tau if given is None else given(now)
            nudot = vehicle.acceleration(own[:6], own[6:], force)
            return jnp.concatenate([nudot, space.velocity(own[6:], own[3:6])])

        z = runge_kutta_4(rate, z, before, dt)
        z = jnp.concatenate([z[:6], space.plus(z[6:], jnp.zeros(3))])
        return z, z

    _, moved = jax.lax.scan(step, start, (t[:-1], jnp.diff(t), held[1:]))
    z = jnp.concatenate([start[None], moved])
    return MarineMotion(t, z[:, :6], vehicle.acceleration(z[:, :6], z[:, 6:], held), z[:, 6:], held)


def _cross_matrix(v: Array) -> Array:
    """`S` with `S u = v x u`."""
    return jnp.cross(v, jnp.eye(3)).T


def bluerov2() -> MarineVehicle:
    """The BlueROV2, nearly neutral, with its centre of gravity 2 cm below that of buoyancy.

    Source: Wu (2018), 6-DoF Modelling and Control of a Remotely Operated Vehicle, Flinders University.
    Differs: yaw has the added inertia and drag of roll and pitch.
    """
    mass_lever = 0.23  # kg m
    M = np.diag([17.0, 24.2, 26.07, 0.28, 0.28, 0.28])  # kg, kg m^2
    M[0, 4] = M[4, 0] = mass_lever
    M[1, 3] = M[3, 1] = -mass_lever
    return MarineVehicle(
        M,
        linear_drag=(4.03, 6.22, 5.18, 0.07, 0.07, 0.07),  # N s/m, N m s
        quadratic_drag=(18.18, 21.66, 36.99, 1.55, 1.55, 1.55),  # N s^2/m^2, N m s^2
        weight=112.8,  # N
        buoyancy=114.8,  # N
        r_g=(0.0, 0.0, 0.02),  # m
    )
