"""A carriage on a rail, small enough to simulate by hand: pushed by a motor with a limit, measured in place and speed."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

import gainful as gf
from gainful.running import AbstractController, AbstractPlant, Reading
from gainful.spaces import AbstractSpace, make_space

LIMIT = 0.5  # m/s^2
STEP = 0.01  # s
SIGMA = 0.02  # m, m/s


class Carriage(AbstractPlant):
    """Place and speed; the motor's temperature is told."""

    output: AbstractSpace
    sigma: Any = SIGMA

    def init(self) -> dict[str, jax.Array]:
        return {"x": jnp.array([1.0, 0.0]), "heat": jnp.zeros(1)}

    def limit(self, state: Any, command: jax.Array, dt: float) -> jax.Array:
        return jnp.clip(command, -LIMIT, LIMIT)

    def advance(self, state: Any, actuation: jax.Array, t: jax.Array, dt: float, key: jax.Array) -> Any:
        place, speed = state["x"]
        push = actuation[0]
        moved = jnp.stack([place + dt * speed + 0.5 * dt**2 * push, speed + dt * push])
        return {"x": moved, "heat": state["heat"] + dt * jnp.abs(actuation)}

    def read(self, state: Any, t: jax.Array, key: jax.Array) -> jax.Array:
        return state["x"] + self.sigma * jax.random.normal(key, (2,))

    def monitor(self, state: Any) -> jax.Array:
        return state["heat"]

    def inputs(self, monitored: jax.Array, applied: jax.Array) -> jax.Array:
        return jnp.concatenate([applied, monitored])

    def truth(self, state: Any, t: jax.Array) -> jax.Array:
        return state["x"]


def carriage(sigma: float = SIGMA) -> Carriage:
    return Carriage(make_space({"place": "m", "speed": "m/s"}), sigma)


def carriage_model(**changes: Any) -> gf.models.AbstractModel:
    """What a filter believes of it; the temperature plays no part."""

    def move(x: jax.Array, u: jax.Array, t: jax.Array, dt: jax.Array) -> jax.Array:
        return jnp.stack([x[0] + dt * x[1] + 0.5 * dt**2 * u[0], x[1] + dt * u[0]])

    given = {"outputs": {"place": "m", "speed": "m/s"}, "inputs": {"push": "m/s^2", "heat": "K"}} | changes
    return gf.discrete_model(
        move, lambda x: x, states={"p": "m", "v": "m/s"}, Q=[1e-8, 1e-8], R=[SIGMA**2, SIGMA**2], **given
    )


class Spring(AbstractController):
    """Pulls the carriage home, on readings or on the estimate; counts how often it has acted."""

    stiffness: float = 4.0
    damping: float = 2.0
    estimated: bool = eqx.field(static=True, default=False)

    def init(self) -> jax.Array:
        return jnp.zeros((), int)

    def act(self, carry: jax.Array, t: jax.Array, reading: Reading) -> tuple[jax.Array, jax.Array]:
        if self.estimated:
            assert reading.info is not None
            x = reading.info.estimate.mean
        else:
            x = reading.y
        return carry + 1, -(self.stiffness * x[:1] + self.damping * x[1:2])
