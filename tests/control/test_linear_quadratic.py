"""Regulators are optimal, their loops have the poles they should, and a one-step inverse is one of them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from gainful.control import (
    Inversion,
    LinearPlant,
    closed_loop_poles,
    error_dynamics,
    gain_margin,
    linearised,
    lqi,
    lqr,
    one_step_gain,
)
from gainful.plants import FlexibleSpacecraft, FlexibleStructure
from gainful.plants.flexible_spacecraft_model import flexible_spacecraft_model


def double_integrator(T: float = 0.1) -> LinearPlant:
    return LinearPlant([[1.0, T], [0.0, 1.0]], [[0.5 * T**2], [T]])


def hub(T: float) -> LinearPlant:
    """The flexible spacecraft about rest, angles, deflections, rates and rates of deflection, by the matrix exponential."""
    structure = FlexibleStructure()
    B = np.asarray(structure.coupling)
    mass = np.block([[np.asarray(structure.inertia), B.T], [B, np.diag(np.asarray(structure.modal_mass))]])
    stiffness = np.diag(np.r_[np.zeros(3), np.asarray(structure.modal_stiffness)])
    damping = np.diag(np.r_[np.zeros(3), np.asarray(structure.modal_damping)])
    F = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    G = np.vstack([np.zeros((6, 3)), np.linalg.solve(mass, np.eye(6, 3))])
    both = scipy.linalg.expm(T * np.block([[F, G], [np.zeros((3, 15))]]))
    return LinearPlant(both[:12, :12], both[:12, 12:])


def rate_command(T: float, gain: float = 1.0, panel: tuple[float, ...] = (0.03, 0.25, 0.07)) -> np.ndarray:
    """What the wanted next state is of the state: rates from the angles one step ahead and from the deflections."""
    D = np.zeros((12, 12))
    D[6:9, :3], D[6:9, 6:9] = -gain * np.eye(3), -gain * T * np.eye(3)
    D[6:9, 3:6] = np.diag(panel)
    return D


def test_a_model_is_linearised_where_it_is_linear_about_rest() -> None:
    craft = FlexibleSpacecraft()
    found = linearised(flexible_spacecraft_model(craft), craft.init().coordinates, np.zeros(3), 0.1)
    exact = hub(0.1)
    # Runge-Kutta with substeps of 25 ms turns the fastest mode, 7 rad/s, by 0.18 rad: 0.18^5 / 120 a step, four of them,
    # and rates of deflection are as fast again.
    np.testing.assert_allclose(found.A, exact.A, atol=1e-4)
    np.testing.assert_allclose(found.B, exact.B, atol=1e-8)


def test_the_regulator_of_a_double_integrator_is_optimal(rng: np.random.Generator) -> None:
    plant = double_integrator()
    Q, R = np.array([1.0, 0.2]), np.array([0.5])
    K, P = lqr(plant, Q, R)
    start = rng.normal(size=2)

    def cost(gain: np.ndarray) -> float:
        x, total = start, 0.0
        for _ in range(3000):
            u = -gain @ x
            total += x @ np.diag(Q) @ x + u @ np.diag(R) @ u
            x = plant.A @ x + plant.B @ u
        return total

    least = cost(K)
    assert least == pytest.approx(start @ P @ start, rel=1e-10)
    assert all(
        cost(K + step) > least for step in 0.01 * np.array([[[1.0, 0.0]], [[-1.0, 0.0]], [[0.0, 1.0]], [[0.0, -1.0]]])
    )


def test_an_integral_leaves_no_lasting_error() -> None:
    plant, T = double_integrator(), 0.1
    K, K_i = lqi(plant, [[1.0, 0.0]], [1.0, 0.1], [0.1], [1.0], T)
    x, s = np.array([1.0, 0.0]), np.zeros(1)
    for _ in range(2000):
        u = -K @ x - K_i @ s
        s = s + T * x[:1]
        x = plant.A @ x + plant.B @ (u + 0.7)  # a disturbance that nobody knows
    assert abs(x[0]) < 1e-9
    np.testing.assert_allclose(u, -0.7, atol=1e-9)


def test_a_one_step_inverse_with_riccati_weights_is_the_regulator(rng: np.random.Generator) -> None:
    plant = hub(0.1)
    Q, R = np.r_[np.full(3, 10.0), np.full(3, 1.0), np.full(3, 100.0), np.full(3, 0.1)], np.full(3, 1e-4)
    K, P = lqr(plant, Q, R)
    scale = np.r_[np.full(3, 1e-3), 0.04, 5e-4, 5e-3, np.full(3, 1e-3), 0.1, 3e-3, 0.03]  # of the outputs
    x = scale * rng.normal(size=12)

    def output(u: jax.Array) -> jax.Array:
        return (plant.A @ x + plant.B @ u - x) / scale

    inversion = Inversion(np.outer(scale, scale) * P, sweeps=1, damping=1.0, prior_variance=jnp.inf, effort=R)
    found = inversion(output, -x / scale, jnp.zeros(3))
    np.testing.assert_allclose(found.u, -K @ x, rtol=1e-9, atol=1e-9 * np.abs(K @ x).max())
    # The same in the filter's reading: the cost of the input is the prior's information.
    joint = Inversion(np.outer(scale, scale) * P, "joint-ekf", 1, 1.0, prior_variance=1.0 / R)
    np.testing.assert_allclose(joint(output, -x / scale, jnp.zeros(3)).u, found.u, rtol=1e-9)


def radius(plant: LinearPlant, weights: np.ndarray, desired: np.ndarray) -> float:
    return float(np.abs(closed_loop_poles(plant, one_step_gain(plant, weights, desired)))[0])


def blocks(angle: float, deflection: float, rate: float, deflection_rate: float) -> np.ndarray:
    return np.repeat([angle, deflection, rate, deflection_rate], 3)


def test_perfect_tracking_of_the_hub_leaves_the_modes_to_swing() -> None:
    # Their own damping alone: exp(-D T / 2 A) = 0.99997 for the slowest.
    assert 0.9999 < radius(hub(0.1), blocks(1.0, 0.0, 1.0, 0.0), np.zeros((12, 12))) < 1.0


@pytest.mark.parametrize(("T", "published"), [(0.05, 0.9966), (0.1, 0.9937), (0.2, 0.9924), (0.3, 1.011), (0.4, 1.106)])
def test_a_rate_command_damps_the_modes_while_samples_are_short(T: float, published: float) -> None:
    found = radius(hub(T), blocks(0.0, 0.0, 1.0, 0.0), rate_command(T))
    assert found == pytest.approx(published, abs=5e-4 if published > 1 else 1e-4)


def test_weight_on_rates_of_deflection_makes_the_loop_unstable() -> None:
    assert radius(hub(0.1), blocks(8.0, 0.0, 1.0, 0.1), np.zeros((12, 12))) > 1.01


@pytest.mark.parametrize("alpha", [0.0, 0.02, 0.5, 1.0])
@pytest.mark.parametrize("beta", [0.25, 0.5, 1.0])
def test_the_gain_margin_is_where_the_error_dynamics_turn_unstable(alpha: float, beta: float) -> None:
    margin = gain_margin(alpha, beta)

    def largest(ratio: float) -> float:
        M = error_dynamics(ratio, alpha, beta)
        # Without compensation the mean of the error stays what it is, and is no part of the loop.
        return float(np.abs(np.linalg.eigvals(M if alpha else M[:1, :1])).max())

    assert largest(margin - 2e-3) < 1.0
    assert largest(margin + 2e-3) > 1.0
    inside = np.linspace(0.01, margin - 2e-3, 50)
    assert max(largest(float(ratio)) for ratio in inside) < 1.0


def test_error_dynamics_are_those_of_a_rate_loop_step_by_step() -> None:
    ratio, alpha, beta = 1.3, 0.4, 0.7
    # A rate that moves by ratio u; the model says u; the mean m of what it misses is taken off the target.
    w, m, wanted = 0.5, 0.1, 0.0
    errors = [w - wanted]
    means = [m]
    for _ in range(6):
        u = wanted + (1.0 - beta) * (w - wanted) - w - m
        moved = w + ratio * u
        m = m + alpha * ((moved - w) - u - m)
        w = moved
        errors.append(w - wanted)
        means.append(m)
    M = error_dynamics(ratio, alpha, beta)
    for k in range(6):
        np.testing.assert_allclose(M @ [errors[k], means[k]], [errors[k + 1], means[k + 1]], atol=1e-14)
