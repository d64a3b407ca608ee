"""The problems every package filters: plain functions, so that each package wraps the same ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np


@dataclasses.dataclass(frozen=True)
class Problem:
    """A model as plain functions and numbers, and measurements to filter."""

    name: str
    f: Callable
    h: Callable
    Q: np.ndarray
    R: np.ndarray
    mean: np.ndarray
    cov: np.ndarray
    dt: float
    y: np.ndarray

    def numpy_functions(self) -> tuple[Callable, Callable, Callable, Callable]:
        """f, h and their Jacobians with NumPy in and out, compiled, for packages that are not built on JAX."""
        compiled = [jax.jit(fn) for fn in (self.f, self.h, jax.jacfwd(self.f), jax.jacfwd(self.h))]
        return tuple(lambda x, fn=fn: np.asarray(fn(np.asarray(x, float))) for fn in compiled)


def _simulate(f: Callable, h: Callable, Q: np.ndarray, R: np.ndarray, mean: np.ndarray, rows: int) -> np.ndarray:
    key = jax.random.key(0)

    def step(x, keys):
        x = f(x) + jnp.sqrt(jnp.diag(Q)) * jax.random.normal(keys[0], x.shape)
        y = h(x)
        return x, y + jnp.sqrt(jnp.diag(R)) * jax.random.normal(keys[1], y.shape)

    return np.asarray(jax.lax.scan(step, jnp.asarray(mean), jax.random.split(key, (rows, 2)))[1])


def pendulum(rows: int = 2000) -> Problem:
    """Two states, one measurement, Euler steps."""
    dt = 0.02

    def f(x):
        return jnp.array([x[0] + dt * x[1], x[1] - dt * 9.81 * jnp.sin(x[0])])

    def h(x):
        return jnp.sin(x[:1])

    Q, R = np.diag([1e-6, 1e-4]), np.diag([1e-2])
    mean, cov = np.array([1.0, 0.0]), 0.01 * np.eye(2)
    return Problem("pendulum, 2 states, 1 measurement", f, h, Q, R, mean, cov, dt, _simulate(f, h, Q, R, mean, rows))


def attitude(rows: int = 2000) -> Problem:
    """Six states, six measurements, one Runge-Kutta step of a rigid body's rates and angles."""
    dt, inertia = 0.05, jnp.array([17.0, 12.0, 10.0])

    def rate(x):
        w, (roll, pitch, _) = x[:3], x[3:]
        sr, cr, sp, cp = jnp.sin(roll), jnp.cos(roll), jnp.sin(pitch), jnp.cos(pitch)
        turn = -jnp.cross(w, inertia * w) / inertia
        across = cp * w[2] - sp * w[0]
        angles = jnp.array([cp * w[0] + sp * w[2], w[1] - sr / cr * across, across / cr])
        return jnp.concatenate([turn, angles])

    def f(x):
        k1 = rate(x)
        k2 = rate(x + 0.5 * dt * k1)
        k3 = rate(x + 0.5 * dt * k2)
        k4 = rate(x + dt * k3)
        return x + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)

    def h(x):
        return x

    Q, R = np.diag([1e-12] * 3 + [1e-14] * 3), np.diag([1e-6] * 3 + [1e-8] * 3)
    mean, cov = np.array([0.01, 0.02, -0.01, 0.1, 0.1, 0.1]), 1e-4 * np.eye(6)
    return Problem("rigid body, 6 states, 6 measurements", f, h, Q, R, mean, cov, dt, _simulate(f, h, Q, R, mean, rows))
