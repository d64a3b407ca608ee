"""From continuous time to steps: Runge-Kutta 4 or Euler for the state, Van Loan's integral for the noise."""

from __future__ import annotations

import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..linalg import congruence, product

_ORDER = 8
_NODES, _WEIGHTS = (0.5 * (1.0 + np.polynomial.legendre.leggauss(4)[0]), 0.5 * np.polynomial.legendre.leggauss(4)[1])


def runge_kutta_4(
    rate: Callable[[Float[Array, " n"], Float[Array, ""]], Float[Array, " n"]],
    x: Float[Array, " n"],
    t: Float[Array, ""],
    dt: Float[Array, ""],
) -> Float[Array, " n"]:
    """One classical Runge-Kutta step of `dx/dt = rate(x, t)` from `t` to `t + dt`; fourth order in `dt`."""
    k1 = rate(x, t)
    k2 = rate(x + 0.5 * dt * k1, t + 0.5 * dt)
    k3 = rate(x + 0.5 * dt * k2, t + 0.5 * dt)
    k4 = rate(x + dt * k3, t + dt)
    return x + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


def forward_euler(
    rate: Callable[[Float[Array, " n"], Float[Array, ""]], Float[Array, " n"]],
    x: Float[Array, " n"],
    t: Float[Array, ""],
    dt: Float[Array, ""],
) -> Float[Array, " n"]:
    """One Euler step of `dx/dt = rate(x, t)` from `t` to `t + dt`; first order in `dt`.

    A quarter of the work of `runge_kutta_4`, for steps so short that `dt` times the acceleration of the state does not matter.
    """
    return x + dt * rate(x, t)


def van_loan(
    drift: Float[Array, "n n"], density: Float[Array, "n n"], dt: Float[Array, ""], *, halvings: int = 4
) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """`(Phi, Q)` of `dx = A x dt + dw` with `cov(dw) = W dt` over a step.

    `Phi = exp(A dt)` and `Q = integral_0^dt exp(A s) W exp(A s)^T ds`, which Van Loan reads off one exponential of twice
    the size. Here the integral is taken by Gauss-Legendre quadrature over `h = dt / 2^halvings`, exact for chains of up to
    four integrators, and then doubled: `Q <- Q + Phi Q Phi^T`, `Phi <- Phi Phi`. Every term added is a covariance, so Q is
    positive semi-definite, and the cost does not depend on the data.

    Args:
        drift: `A` [1/s].
        density: spectral density `W` of the noise, in state units squared per second.
        dt: step [s].
        halvings: how often the step is halved.

    With `a = norm(A) h` the series leaves out about `a^9 / 9!` in each of the `2^halvings` pieces: 3e-6 for `a = 1`, below
    rounding for `a = 0.06`. Sub-step longer intervals (`max_step` of a log).

    Source: Van Loan (1978), IEEE Trans. Autom. Control 23(3):395-404.
    Differs: quadrature and doubling in place of the Pade exponential.
    """
    n = drift.shape[0]
    h = dt / 2**halvings
    step = drift * h
    identity = jnp.eye(n, dtype=drift.dtype)
    powers = [identity, step]
    for k in range(2, _ORDER + 1):
        powers.append(product(powers[k // 2], powers[k - k // 2]))
    table = jnp.stack(powers).reshape(_ORDER + 1, -1)
    factorials = np.array([math.factorial(k) for k in range(_ORDER + 1)], dtype=float)
    # exp(A s) at the end of the step and at the four nodes, all from the same powers.
    ends = np.concatenate([[1.0], _NODES])
    series = jnp.asarray(ends[:, None] ** np.arange(_ORDER + 1) / factorials, drift.dtype)
    exponentials = product(series, table).reshape(-1, n, n)
    phi, nodes = exponentials[0], exponentials[1:]
    left = jnp.concatenate(
        [w * product(node, density) for w, node in zip(_WEIGHTS.tolist(), nodes, strict=True)], axis=1
    )
    noise = h * product(left, jnp.concatenate(list(nodes), axis=1).T)
    for _ in range(halvings):
        noise = noise + congruence(phi, noise)
        phi = product(phi, phi)
    return phi, noise


def zero_order_hold(
    drift: Float[Array, "n n"], input_matrix: Float[Array, "n r"], dt: Float[Array, ""]
) -> tuple[Float[Array, "n n"], Float[Array, "n r"]]:
    """`(Phi, Gamma)` of `dx/dt = A x + B u` with `u` held over the step [s]."""
    n, r = input_matrix.shape
    big = jnp.zeros((n + r, n + r), drift.dtype).at[:n, :n].set(drift).at[:n, n:].set(input_matrix)
    phi, _ = van_loan(big, jnp.zeros_like(big), dt)
    return phi[:n, :n], phi[:n, n:]
