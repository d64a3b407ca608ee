"""From continuous time to steps: Runge-Kutta 4 for the state, Van Loan's integral for the noise."""

from __future__ import annotations

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..linalg import symmetrize

_ORDER = 10
_HALVINGS = 6


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


def van_loan(
    drift: Float[Array, "n n"], density: Float[Array, "n n"], dt: Float[Array, ""]
) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """`(Phi, Q)` of `dx = A x dt + dw` with `cov(dw) = W dt` over a step.

    `Phi = exp(A dt)` and `Q = integral_0^dt exp(A s) W exp(A s)^T ds`, which Van Loan reads off one exponential of twice
    the size. Here both series are summed over `dt / 64` and doubled: `Q <- Q + Phi Q Phi^T`, `Phi <- Phi Phi`. Every term
    added is a covariance, and the cost does not depend on the data.

    Args:
        drift: `A` [1/s].
        density: spectral density `W` of the noise, in state units squared per second.
        dt: step [s].

    The remainder is below rounding for `norm(A) dt <= 16`; sub-step longer intervals (`max_step` of a log).

    Source: Van Loan (1978), IEEE Trans. Autom. Control 23(3):395-404.
    Differs: a scaled series in place of the Pade exponential.
    """
    n = drift.shape[0]
    h = dt / 2**_HALVINGS
    step = drift * h
    phi = jnp.eye(n, dtype=drift.dtype)
    power = phi
    noise_term = density * h
    noise = noise_term
    for k in range(1, _ORDER + 1):
        power = power @ step / k
        phi = phi + power
        moved = step @ noise_term
        noise_term = (moved + moved.T) / (k + 1)
        noise = noise + noise_term
    for _ in range(_HALVINGS):
        noise = noise + phi @ noise @ phi.T
        phi = phi @ phi
    return phi, symmetrize(noise)


def zero_order_hold(
    drift: Float[Array, "n n"], input_matrix: Float[Array, "n r"], dt: Float[Array, ""]
) -> tuple[Float[Array, "n n"], Float[Array, "n r"]]:
    """`(Phi, Gamma)` of `dx/dt = A x + B u` with `u` held over the step [s]."""
    n, r = input_matrix.shape
    big = jnp.zeros((n + r, n + r), drift.dtype).at[:n, :n].set(drift).at[:n, n:].set(input_matrix)
    phi, _ = van_loan(big, jnp.zeros_like(big), dt)
    return phi[:n, :n], phi[:n, n:]
