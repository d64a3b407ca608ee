"""An underwater vehicle that moves along or about one of its axes only."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError, did_you_mean
from ..models import Model, continuous_model, runge_kutta_4

PARAMETERS = ("inertia", "linear_drag", "quadratic_drag")
"""Names of the parameters, in the order of the regressors."""


def _number(value: float | Array) -> Array:
    return jnp.asarray(value, float)


class SingleDofVehicle(eqx.Module):
    """A vehicle in one degree of freedom: `tau = m rdot + d r + d2 r|r|`, linear in its parameters.

    Only for manoeuvres in which the vehicle moves in this degree of freedom alone: in coupled motion the forces of the others
    are taken for its own, see `MarineVehicle`.

    Attributes:
        inertia: with added mass, `m` [kg m^2], or [kg] along an axis.
        linear_drag: `d` [N m s] or [N s/m].
        quadratic_drag: `d2` [N m s^2] or [N s^2/m^2].
        turning: whether it turns about the axis [rad/s, N m] or moves along it [m/s, N].

    Raises:
        ModelError: an inertia that is not above 0.

    Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapters 6 and 7.

    Example:
        >>> float(SingleDofVehicle(80.0, 50.0, 100.0).wrench(0.5, -1.0))
        -110.0
    """

    inertia: Array = eqx.field(converter=_number)
    linear_drag: Array = eqx.field(converter=_number)
    quadratic_drag: Array = eqx.field(converter=_number)
    turning: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        if not isinstance(self.inertia, Tracer) and not (self.inertia > 0).all():
            raise ModelError(f"inertia: expected a number above 0, got {self.inertia}")

    @property
    def parameters(self) -> Float[Array, "3"]:
        """Inertia, linear and quadratic drag."""
        return jnp.stack([self.inertia, self.linear_drag, self.quadratic_drag])

    @property
    def units(self) -> dict[str, str]:
        """Units of rate, wrench and parameters, by name."""
        if self.turning:
            return dict(zip(("rate", "wrench", *PARAMETERS), _TURNING, strict=True))
        return dict(zip(("rate", "wrench", *PARAMETERS), _MOVING, strict=True))

    @staticmethod
    def regressor(acceleration: Float[Array, "*batch"], rate: Float[Array, "*batch"]) -> Float[Array, "*batch 3"]:
        """`[rdot, r, r|r|]`, which times the parameters is the wrench."""
        acceleration, rate = jnp.broadcast_arrays(acceleration, rate)
        return jnp.stack([acceleration, rate, rate * jnp.abs(rate)], axis=-1)

    def wrench(
        self, acceleration: float | Float[Array, "*batch"], rate: float | Float[Array, "*batch"]
    ) -> Float[Array, "*batch"]:
        """Force or moment that a motion needs [N or N m]."""
        return self.regressor(jnp.asarray(acceleration), jnp.asarray(rate)) @ self.parameters

    def acceleration(
        self, rate: float | Float[Array, "*batch"], wrench: float | Float[Array, "*batch"]
    ) -> Float[Array, "*batch"]:
        """Rate of change of the rate under a force or moment [m/s^2 or rad/s^2]."""
        rate = jnp.asarray(rate)
        return (wrench - self.linear_drag * rate - self.quadratic_drag * rate * jnp.abs(rate)) / self.inertia

    def simulate(
        self, t: Float[Array, " T"], wrench: Float[Array, " T"], rate: float | Array = 0.0
    ) -> Float[Array, " T"]:
        """The rate at some times, by one Runge-Kutta step from each to the next.

        Args:
            t: times, rising [s].
            wrench: held over the interval that ends at each time; the first is not used [N or N m].
            rate: at the first time.

        Raises:
            ShapeError: not one wrench per time.

        Example:
            >>> float(SingleDofVehicle(2.0, 0.0, 0.0).simulate(jnp.arange(3.0), jnp.array([9.0, 1.0, 1.0]))[-1])
            1.0
        """
        t, wrench = jnp.asarray(t, float), jnp.asarray(wrench, float)
        if t.ndim != 1 or wrench.shape != t.shape:
            raise ShapeError(f"wrench: expected one number per time, shape {t.shape}, got {wrench.shape}")
        start = jnp.asarray(rate, float)

        def step(r: Array, given: tuple[Array, Array, Array]) -> tuple[Array, Array]:
            before, dt, tau = given
            r = runge_kutta_4(lambda own, _: self.acceleration(own, tau), r, before, dt)
            return r, r

        _, rates = jax.lax.scan(step, start, (t[:-1], jnp.diff(t), wrench[1:]))
        return jnp.concatenate([start[None], rates])

    @property
    def cautions(self) -> tuple[str, ...]:
        """What is not physical of the parameters, such as drag that pushes; nothing is clipped."""
        return tuple(
            f"{name} is {float(value):.4g} {self.units[name]}: drag that pushes"
            for name, value in zip(PARAMETERS[1:], self.parameters[1:], strict=True)
            if not value >= 0
        )


_TURNING = ("rad/s", "N*m", "kg*m^2", "N*m*s", "N*m*s^2")
_MOVING = ("m/s", "N", "kg", "N*s/m", "N*s^2/m^2")

PUBLISHED: dict[str, tuple[tuple[float, float, float], bool]] = {
    "benchmark_yaw": ((80.0, 50.0, 100.0), True),  # kg m^2, N m s, N m s^2
    "benchmark_surge": ((215.0, 70.0, 100.0), False),  # kg, N s/m, N s^2/m^2
    "bluerov2_yaw": ((0.16 + 0.12, 0.07, 1.55), True),  # kg m^2 of body and added, N m s, N m s^2
    "bluerov2_surge": ((11.5 + 5.5, 4.03, 18.18), False),  # kg of body and added, N s/m, N s^2/m^2
}
"""Parameters of vehicles of the literature by name, and whether they turn: a planar benchmark (Repoulias and Papadopoulos 2007,
Ocean Eng. 34(11-12):1650-1667) and the BlueROV2 (Wu 2018, 6-DoF Modelling and Control of a Remotely Operated Vehicle,
Flinders University)."""


def published_vehicle(name: str) -> SingleDofVehicle:
    """A vehicle of the literature by its name: "benchmark_yaw", "benchmark_surge", "bluerov2_yaw" or "bluerov2_surge".

    Raises:
        ModelError: another name.
    """
    if name not in PUBLISHED:
        raise ModelError(f"vehicle: {name!r} is not known; {did_you_mean(str(name), PUBLISHED)}")
    parameters, turning = PUBLISHED[name]
    return SingleDofVehicle(*parameters, turning=turning)


class _Rate(eqx.Module):
    turning: bool = eqx.field(static=True)

    def __call__(self, x: Array, u: Array, t: Array, p: dict[str, Array]) -> Array:
        vehicle = SingleDofVehicle(*(p[name] for name in PARAMETERS), turning=self.turning)
        return vehicle.acceleration(x, u)


def _rate(x: Array) -> Array:
    return x


def single_dof_vehicle(
    vehicle: SingleDofVehicle | str = "benchmark_yaw",
    wrench_density: float = 0.01,
    rate_sigma: float = 0.01,
) -> Model:
    """The model of a vehicle in one degree of freedom: a wrench moves it, its rate is measured.

    `augment(model, parameters={"inertia": walk, "linear_drag": walk, "quadratic_drag": walk})` estimates its parameters,
    in their own units.

    Args:
        vehicle: the vehicle, or the name of one of the literature: "benchmark_yaw", "benchmark_surge", "bluerov2_yaw" or
            "bluerov2_surge".
        wrench_density: spectral density of white wrench besides the one told [(N m)^2 s] or [N^2 s].
        rate_sigma: standard deviation of a reading of the rate [rad/s] or [m/s].

    Raises:
        ModelError: a vehicle that is not known.

    Source: Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, chapters 6 and 7.

    Example:
        >>> single_dof_vehicle("bluerov2_surge").space.units
        ('m/s',)
    """
    own = published_vehicle(vehicle) if isinstance(vehicle, str) else vehicle
    units = own.units
    return continuous_model(
        _Rate(own.turning),
        _rate,
        states={"rate": units["rate"]},
        inputs={"wrench": units["wrench"]},
        outputs={"measured_rate": units["rate"]},
        Q=wrench_density / own.inertia**2,
        R=rate_sigma**2,
        parameters=dict(zip(PARAMETERS, own.parameters, strict=True)),
    )
