"""Which parameters a marine vehicle is said to have, and the regressors that belong to them."""

from __future__ import annotations

import dataclasses
import functools
from typing import Literal, get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError, did_you_mean
from ..regression import quadratic_rate
from .vehicle_numbers import DOFS, VehicleNumbers, coriolis_wrench, gravity_direction

MassForm = Literal["diagonal", "lever", "symmetric", "full"]
"""Which entries of the mass matrix are parameters."""
DragForm = Literal["diagonal", "symmetric", "full"]
"""Which entries of the matrices of drag are parameters."""

_AXES = "xyz"
_FORCE, _SPEED = ("N", "N*m"), ("m/s", "rad/s")
_MASS = (("kg", "kg*m"), ("kg*m", "kg*m^2"))
_LINEAR = (("N*s/m", "N*s"), ("N*s", "N*m*s"))
_QUADRATIC = (("N*s^2/m^2", "N*s^2"), ("N*s^2/m", "N*m*s^2"))


@dataclasses.dataclass(frozen=True)
class VehicleStructure:
    """The parameters of a marine vehicle in six degrees of freedom, and the regressors they are multiplied by.

    `M nudot + C(nu) nu + D(nu) nu + g = tau` is linear in the entries of the mass matrix, which is in `C` too, in those of
    the drag, in weight less buoyancy and in the moments of both. Rigid body and added mass enter through their sum only, and
    cannot be told apart.

    Attributes:
        mass: "diagonal"; "lever", which adds the entries of a centre of gravity on the z axis, `M_15 = M_51 = -M_24 = -M_42`,
            as one parameter; "symmetric", all entries of a vehicle whose port is the mirror of its starboard; or "full".
        drag: "diagonal"; "symmetric", where port mirrors starboard; or "full"; for linear and quadratic drag alike.
        levers: axes along which weight and buoyancy have a lever, `W r_G - B r_B`, of "xyz".
        offsets: degrees of freedom whose recorded wrench has an offset.

    Raises:
        ConfigError: a form, axis or degree of freedom of another name.

    Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapters 3, 4, 6 and 7; Martin and
        Whitcomb (2014), IEEE J. Ocean. Eng. 39(4):671-684.

    Example:
        >>> len(VehicleStructure().names), len(VehicleStructure(mass="full", drag="full", levers=("x", "y", "z")).names)
        (21, 97)
    """

    mass: MassForm = "lever"
    drag: DragForm = "diagonal"
    levers: tuple[str, ...] = ("z",)
    offsets: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, known in (("mass", get_args(MassForm)), ("drag", get_args(DragForm))):
            if getattr(self, name) not in known:
                raise ConfigError(
                    f"{name}: {getattr(self, name)!r} is not known; {did_you_mean(getattr(self, name), known)}"
                )
        for name, known in (("levers", _AXES), ("offsets", DOFS)):
            given = tuple(getattr(self, name))
            for each in given:
                if each not in known or given.count(each) > 1:
                    raise ConfigError(f"{name}: expected any of {', '.join(known)}, each once, got {given!r}")
            object.__setattr__(self, name, given)

    @property
    def units(self) -> dict[str, str]:
        """Units of the parameters by name, in their order, as `regression_model` takes them."""
        found = {}
        for i, j in self.mass_entries:
            found[_mass_name(i, j)] = _MASS[i > 2][j > 2]
        if self.mass == "lever":
            found["mass_lever_z"] = "kg*m"
        for kind, units in (("linear", _LINEAR), ("quadratic", _QUADRATIC)):
            found |= {_entry(f"{kind}_drag", i, j): units[i > 2][j > 2] for i, j in self.drag_entries}
        found["excess_weight"] = "N"
        found |= {f"weight_lever_{axis}": "N*m" for axis in self.levers}
        return found | {f"offset_{dof}": _FORCE[DOFS.index(dof) > 2] for dof in self.offsets}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.units)

    @property
    def mass_entries(self) -> tuple[tuple[int, int], ...]:
        """Entries of the mass matrix that are parameters of their own, those on and above the diagonal."""
        form = "diagonal" if self.mass == "lever" else self.mass
        return tuple((i, j) for i, j in sorted(_entries(form), key=lambda pair: pair[0] != pair[1]) if i <= j)

    @property
    def drag_entries(self) -> tuple[tuple[int, int], ...]:
        """Entries of either matrix of drag that are parameters: the force in one degree of freedom by the speed in another."""
        return tuple(sorted(_entries(self.drag), key=lambda pair: pair[0] != pair[1]))

    def numbers(self, parameters: Float[Array, " n"]) -> VehicleNumbers:
        """Parameters as the matrices they stand in, zero where there is none.

        Raises:
            ShapeError: not as many as the structure has.
        """
        theta = jnp.asarray(parameters, float)
        if theta.shape != (len(self.names),):
            raise ShapeError(f"parameters: expected {len(self.names)}, got shape {theta.shape}")
        masses, drags = len(_mass_matrices(self)), len(self.drag_entries)
        ends = np.cumsum([masses, drags, drags, 1, len(self.levers)])
        mass, linear, quadratic, excess, levers, offsets = jnp.split(theta, ends)
        drag = jnp.asarray(_drag_matrices(self))
        return VehicleNumbers(
            jnp.tensordot(mass, jnp.asarray(_mass_matrices(self)), 1),
            jnp.tensordot(linear, drag, 1),
            jnp.tensordot(quadratic, drag, 1),
            excess[0],
            jnp.zeros(3).at[self._lever_rows].set(levers),
            jnp.zeros(6).at[self._offset_rows].set(offsets),
        )

    def parameters(self, numbers: VehicleNumbers) -> Float[Array, " n"]:
        """The parameters in the matrices of a vehicle; what has no parameter is left out."""
        rows, columns = np.array([*self.mass_entries, *([(0, 4)] if self.mass == "lever" else [])]).T
        drag = tuple(np.array(self.drag_entries).T)
        return jnp.concatenate(
            [
                numbers.mass_matrix[rows, columns],
                numbers.linear_drag[drag],
                numbers.quadratic_drag[drag],
                numbers.excess_weight[None],
                numbers.lever[self._lever_rows],
                numbers.offset[self._offset_rows],
            ]
        )

    @property
    def _lever_rows(self) -> np.ndarray:
        return np.array([_AXES.index(axis) for axis in self.levers], dtype=int)

    @property
    def _offset_rows(self) -> np.ndarray:
        return np.array([DOFS.index(dof) for dof in self.offsets], dtype=int)

    def inertial(self, nudot: Float[Array, "*batch 6"]) -> Float[Array, "*batch 6 n"]:
        """The regressors' part that is linear in the acceleration, `M nudot`.

        Args:
            nudot: acceleration in body axes [m/s^2, rad/s^2].
        """
        columns = jnp.einsum("kij,...j->...ik", _mass_matrices(self), jnp.asarray(nudot, float))
        return jnp.pad(columns, [(0, 0)] * (columns.ndim - 1) + [(0, len(self.names) - columns.shape[-1])])

    def remaining(
        self,
        nu: Float[Array, "*batch 6"],
        attitude: Float[Array, "*batch angles"],
        std: Float[Array, "6"] | None = None,
    ) -> Float[Array, "*batch 6 n"]:
        """The regressors' other part, which has no acceleration in it: `C(nu) nu + D(nu) nu + g`.

        Args:
            nu: velocity and turn rate in body axes [m/s, rad/s].
            attitude: roll and pitch [rad] or a quaternion, see `gravity_direction`.
            std: standard deviation of the noise in `nu`, to take its mean out of the squares of drag.
        """
        nu, down = jnp.asarray(nu, float), gravity_direction(attitude)
        momentum = jnp.einsum("kij,...j->...ki", _mass_matrices(self), nu)
        columns = [jnp.swapaxes(coriolis_wrench(momentum, nu[..., None, :]), -1, -2)]
        drag = _drag_matrices(self)
        columns += [jnp.einsum("kij,...j->...ik", drag, speed) for speed in (nu, quadratic_rate(nu, std))]
        nothing = jnp.zeros_like(down)
        columns.append(jnp.concatenate([-down, nothing], axis=-1)[..., None])
        for row in self._lever_rows:
            moment = jnp.cross(down, jnp.broadcast_to(jnp.eye(3)[row], down.shape))
            columns.append(jnp.concatenate([nothing, moment], axis=-1)[..., None])
        columns.append(jnp.eye(6)[:, self._offset_rows])
        lead = jnp.broadcast_shapes(nu.shape[:-1], down.shape[:-1])
        return jnp.concatenate([jnp.broadcast_to(each, (*lead, *each.shape[-2:])) for each in columns], axis=-1)

    def regressor(
        self,
        nudot: Float[Array, "*batch 6"],
        nu: Float[Array, "*batch 6"],
        attitude: Float[Array, "*batch angles"],
    ) -> Float[Array, "*batch 6 n"]:
        """What the parameters are multiplied by to give the wrench [N, N m].

        Args:
            nudot: acceleration in body axes [m/s^2, rad/s^2].
            nu: velocity and turn rate in body axes [m/s, rad/s].
            attitude: roll and pitch [rad] or a quaternion, see `gravity_direction`.
        """
        return self.inertial(nudot) + self.remaining(nu, attitude)


def _entries(form: str) -> list[tuple[int, int]]:
    """Entries of a matrix that a form leaves."""
    pairs = [(i, j) for i in range(6) for j in range(6)]
    if form == "diagonal":
        return [(i, j) for i, j in pairs if i == j]
    # A mirrored vehicle couples surge, heave and pitch, and sway, roll and yaw, but not one with the other.
    return pairs if form == "full" else [(i, j) for i, j in pairs if i % 2 == j % 2]


def _entry(kind: str, i: int, j: int) -> str:
    return f"{kind}_{DOFS[i]}" if i == j else f"{kind}_{DOFS[i]}_{DOFS[j]}"


def _mass_name(i: int, j: int) -> str:
    return _entry("inertia" if min(i, j) > 2 else "mass", i, j)


@functools.cache
def _mass_matrices(structure: VehicleStructure) -> np.ndarray:
    matrices = []
    for i, j in structure.mass_entries:
        matrix = np.zeros((6, 6))
        matrix[i, j] = matrix[j, i] = 1.0
        matrices.append(matrix)
    if structure.mass == "lever":
        lever = np.zeros((6, 6))
        lever[0, 4] = lever[4, 0] = 1.0
        lever[1, 3] = lever[3, 1] = -1.0
        matrices.append(lever)
    return np.stack(matrices)


@functools.cache
def _drag_matrices(structure: VehicleStructure) -> np.ndarray:
    matrices = np.zeros((len(structure.drag_entries), 6, 6))
    for k, entry in enumerate(structure.drag_entries):
        matrices[(k, *entry)] = 1.0
    return matrices
