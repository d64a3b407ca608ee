"""An inversion finds the input that gives what is wanted, and its two readings, filter and least squares, agree."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import Inverse, Inversion

RELATIVE = 1e-12  # a few hundred roundings of a system of three unknowns


@pytest.fixture
def H(rng: np.random.Generator) -> jnp.ndarray:
    """Five outputs of three inputs, well conditioned."""
    return jnp.asarray(np.eye(5, 3) + 0.2 * rng.normal(size=(5, 3)))


def affine(H: jnp.ndarray) -> Callable[[jax.Array], jax.Array]:
    return lambda u: H @ u + 0.3


def bent(u: jax.Array) -> jax.Array:
    return jnp.stack([jnp.sinh(u[0]) + 0.1 * u[1], u[1] + 0.2 * u[0] * u[1]])


def on(H: jnp.ndarray, target: np.ndarray, start: float = 0.0, **options: object) -> Inverse:
    inversion = Inversion(jnp.array([1.0, 2.0, 0.5, 1.0, 0.0]), **options)  # type: ignore[arg-type]
    return jax.jit(lambda target: inversion(affine(H), target, jnp.full(3, start)))(jnp.asarray(target))


def test_many_measurements_with_constant_noise_are_one_with_its_share(H: jnp.ndarray, rng: np.random.Generator) -> None:
    target = rng.normal(size=5)
    many = on(H, target, method="joint-ekf", sweeps=8, damping=0.4)
    once = on(H, target, method="joint-ekf", sweeps=1, damping=0.4 / 8)
    np.testing.assert_allclose(many.u, once.u, rtol=RELATIVE, atol=RELATIVE)
    one, rest = jnp.eye(5, 1), jnp.zeros(1)
    for method in ("ekf", "joint-ekf"):
        found = [
            Inversion(jnp.ones(5), method, sweeps, damping)(lambda u: one @ u, jnp.ones(5), rest).u
            for sweeps, damping in ((8, 0.4), (1, 0.05))
        ]
        np.testing.assert_allclose(*found, rtol=RELATIVE)


@pytest.mark.parametrize("spread", [None, "diagonal", "full"])
def test_a_sweep_is_the_gain_of_the_kalman_filter_written_out(
    spread: str | None, H: jnp.ndarray, rng: np.random.Generator
) -> None:
    weights, P0, damping = np.array([1.0, 2.0, 0.5, 1.0, 3.0]), 0.7, 0.3
    target, root = rng.normal(size=5), 0.3 * rng.normal(size=(5, 5))
    S = {None: np.zeros((5, 5)), "diagonal": np.diag(np.diag(root @ root.T)), "full": root @ root.T}[spread]
    given = {None: None, "diagonal": jnp.asarray(np.diag(S)), "full": jnp.asarray(S)}[spread]
    R = damping * np.diag(1.0 / weights) + S
    u, jacobian = np.zeros(3), np.asarray(H)
    for i in range(3):  # the inputs one after the other, the others at their newest value
        h = jacobian[:, i : i + 1]
        gain = P0 * h.T @ np.linalg.inv(h * P0 @ h.T + R)
        u[i] += (gain @ (target - jacobian @ u - 0.3))[0]
    inversion = Inversion(jnp.asarray(weights), "ekf", 1, damping, prior_variance=P0)
    found = inversion(affine(H), jnp.asarray(target), jnp.zeros(3), variance=given)
    # Two inverses of a well-conditioned 5 x 5 matrix.
    np.testing.assert_allclose(found.u, u, rtol=1e-10, atol=1e-12)
    gain = P0 * jacobian.T @ np.linalg.inv(jacobian * P0 @ jacobian.T + R)
    joint = Inversion(jnp.asarray(weights), "joint-ekf", 1, damping, prior_variance=P0)
    found = joint(affine(H), jnp.asarray(target), jnp.zeros(3), variance=given)
    np.testing.assert_allclose(found.u, gain @ (target - 0.3), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("coupling", [0.0, 0.5])
@pytest.mark.parametrize("method", ["ekf", "joint-ekf"])
def test_the_error_of_the_filters_falls_with_the_square_of_the_sweeps(method: str, coupling: float) -> None:
    # The columns are unit vectors with this cosine between them. One at a time, an error along their difference is made
    # good with the share 1 - coupling only, and falls as sweeps^(-2 (1 - coupling)).
    apart = jnp.array([[1.0, coupling], [0.0, np.sqrt(1.0 - coupling**2)]])
    wanted = 0.1 * jnp.array([1.0, -1.0])
    errors = []
    for sweeps in (20, 80):
        inversion = Inversion(jnp.ones(2), method, sweeps)
        errors.append(float(jnp.linalg.norm(inversion(lambda u: apart @ u, apart @ wanted, jnp.zeros(2)).u - wanted)))
    slope = np.log(errors[1] / errors[0]) / np.log(80 / 20)
    assert slope == pytest.approx(-2.0 * (1.0 - coupling * (method == "ekf")), abs=0.3)


def test_gauss_newton_converges_faster_than_quadratically_on_an_affine_map(H: jnp.ndarray) -> None:
    wanted = jnp.array([0.6, -0.5, 0.7])
    found = on(H, affine(H)(wanted), sweeps=6)
    cost = np.asarray(found.cost)
    falling = cost[cost > 1e-20]
    # cost' = cost (damping / (damping + h^2))^2 with damping = cost: the third power once it is below the sensitivity.
    orders = np.log(falling[2:] / falling[1:-1]) / np.log(falling[1:-1] / falling[:-2])
    assert orders[-1] > 2.2
    np.testing.assert_allclose(found.u, wanted, rtol=1e-9)


def test_without_damping_an_affine_map_takes_one_sweep(H: jnp.ndarray) -> None:
    wanted = jnp.array([6.0, -5.0, 7.0])
    found = on(H, affine(H)(wanted), sweeps=1, damping=0.0)
    # What is left is the floor of the damping.
    np.testing.assert_allclose(found.u, wanted, rtol=1e-10)


def test_what_no_input_can_reach_does_not_keep_it_from_the_rest(H: jnp.ndarray, rng: np.random.Generator) -> None:
    target = 5.0 * rng.normal(size=5)
    W = np.diag([1.0, 2.0, 0.5, 1.0, 0.0])
    best = np.linalg.solve(H.T @ W @ H, H.T @ W @ (target - 0.3))
    found = on(H, target, sweeps=8)
    assert found.cost[-1] > 0.1
    np.testing.assert_allclose(found.u, best, rtol=1e-9)


def test_a_bent_map_is_inverted_and_its_sensitivity_told() -> None:
    wanted = jnp.array([0.9, -0.4])
    found = Inversion(jnp.ones(2), sweeps=8)(bent, bent(wanted), jnp.zeros(2))
    np.testing.assert_allclose(found.u, wanted, rtol=1e-9)
    np.testing.assert_allclose(found.sensitivity, jax.jacfwd(bent)(wanted), rtol=1e-9)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-9)
    assert not found.saturated.any()


def test_an_input_at_its_limit_leaves_the_rest_to_the_others() -> None:
    H = jnp.array([[1.0, 0.5], [0.5, 1.0]])
    target = jnp.array([2.0, 0.0])
    found = Inversion(jnp.ones(2), sweeps=6, damping=0.0, limit=jnp.array([1.0, 3.0]))(
        lambda u: H @ u, target, jnp.zeros(2)
    )
    best = H[:, 1] @ (target - H[:, 0]) / (H[:, 1] @ H[:, 1])
    np.testing.assert_allclose(found.u, [1.0, best], atol=1e-9)
    assert found.saturated.tolist() == [True, False]


@pytest.mark.parametrize("method", ["gauss-newton", "joint-ekf", "ekf"])
def test_no_input_leaves_its_limits_nor_its_trust_region(method: str, H: jnp.ndarray, rng: np.random.Generator) -> None:
    target = 20.0 * rng.normal(size=5)
    found = on(H, target, start=0.9, method=method, sweeps=3, limit=1.0, step_limit=0.3)
    assert np.all(np.asarray(found.u) <= 1.0)
    assert np.all(np.asarray(found.u) >= 0.6 - 1e-15)
    assert found.saturated.any()


def test_an_output_without_weight_is_not_looked_at(H: jnp.ndarray, rng: np.random.Generator) -> None:
    target = rng.normal(size=5)
    found, other = (on(H, target + shift * np.eye(5)[4], sweeps=3) for shift in (0.0, 100.0))
    np.testing.assert_array_equal(found.u, other.u)


@pytest.mark.parametrize("method", ["gauss-newton", "joint-ekf", "ekf"])
def test_units_of_inputs_and_a_factor_of_the_weights_change_nothing(
    method: str, H: jnp.ndarray, rng: np.random.Generator
) -> None:
    target, units = jnp.asarray(rng.normal(size=5)), jnp.array([1.0, 1e-3, 40.0])
    start, weights = jnp.zeros(3), jnp.array([1.0, 2.0, 0.5, 1.0, 0.0])
    plain = Inversion(weights, method, 3)(affine(H), target, start).u
    other = Inversion(7.0 * weights, method, 3, input_scale=units, limit=1e3 * units)
    found = other(lambda u: affine(H)(u / units), target, start).u / units
    np.testing.assert_allclose(found, plain, rtol=1e-9)


def test_effort_pulls_towards_the_start() -> None:
    weights, effort, start = jnp.array([2.0]), jnp.array([0.5]), jnp.array([0.2])
    inversion = Inversion(weights, sweeps=1, damping=1.0, prior_variance=jnp.inf, effort=effort)
    found = inversion(lambda u: 3.0 * u, jnp.array([1.0]), start)
    # The least of 2 (1 - 3 u)^2 + 0.5 (u - 0.2)^2.
    np.testing.assert_allclose(found.u, (2.0 * 3.0 * 1.0 + 0.5 * 0.2) / (2.0 * 9.0 + 0.5), rtol=1e-12)


def test_two_inputs_that_do_the_same_share_the_work() -> None:
    found = Inversion(jnp.ones(1), sweeps=4)(lambda u: u[:1] + u[1:], jnp.ones(1), jnp.zeros(2))
    np.testing.assert_allclose(found.u, 0.5, rtol=1e-6)


def test_many_inversions_at_once_are_the_inversions_one_by_one(rng: np.random.Generator) -> None:
    inversion, targets = Inversion(jnp.ones(2), sweeps=3), jnp.asarray(0.5 * rng.normal(size=(4, 2)))
    together = jax.vmap(lambda target: inversion(bent, target, jnp.zeros(2)).u)(targets)
    alone = [inversion(bent, target, jnp.zeros(2)).u for target in targets]
    np.testing.assert_allclose(together, alone, atol=1e-12)
