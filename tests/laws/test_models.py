"""Every model stands still for dt = 0, and continuous time turned into steps is what calculus says."""

import dataclasses
import decimal
import functools
import itertools
import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import gainful as gf
from gainful.models import AbstractModel, Instant, forward_euler, runge_kutta_4, van_loan, zero_order_hold
from gainful.testing import check_model

from .parts import DYNAMICS, MODELS, flat, spring_model

EPS = np.finfo(float).eps


def _chain(x: jax.Array, u: jax.Array) -> jax.Array:
    """A triple integrator: nilpotent, so that a Runge-Kutta step is exact."""
    return jnp.stack([x[1], x[2] + u[0], jnp.zeros_like(x[0])])


def chain_model(**given: int) -> AbstractModel:
    states = {"p": "m", "v": "m/s", "a": "m/s^2"}
    return gf.continuous_model(
        _chain, lambda x: x[:1], states=states, outputs=1, inputs=1, Q=[0.0, 0.01, 0.3], R=0.5, **given
    )


@pytest.mark.parametrize("model", flat(MODELS) + flat(DYNAMICS), ids=lambda model: "-".join(model.space.names))
def test_every_model_keeps_its_laws(model: AbstractModel) -> None:
    check_model(model)


# Van Loan's integral --------------------------------------------------------------------------------------------------


def exact_van_loan(drift: np.ndarray, density: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Van Loan's exponential summed in 120 digits: of [[A, W], [0, -A^T]] dt, with Q = G Phi^T."""
    n = len(drift)
    with decimal.localcontext() as context:
        context.prec = 120
        number = np.vectorize(decimal.Decimal, otypes=[object])
        A, W = number(drift), number(density)
        zero = np.full((n, n), decimal.Decimal(0), dtype=object)
        big = np.block([[A, W], [zero, -A.T]]) * decimal.Decimal(dt)
        total = power = number(np.eye(2 * n))
        for k in range(1, 160):  # 16^160 / 160! < 1e-90
            power = power @ big / decimal.Decimal(k)
            total = total + power
        phi = total[:n, :n]
        return phi.astype(float), (total[:n, n:] @ phi.T).astype(float)


def _drifts(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Matrices of spectral norm 1 of several kinds."""
    random = rng.normal(size=(4, 4))
    drifts = {
        "random": random,
        "stable": -random @ random.T,
        "rotating": random - random.T,
        "nilpotent": np.triu(random, 1),
        "damped": random - random.T - 0.3 * np.eye(4),
        "stiff": np.diag([-1.0, -1e-3, 0.0, 0.3]),
    }
    return {name: A / np.linalg.norm(A, 2) for name, A in drifts.items()}


@functools.cache
def compiled_van_loan(halvings: int) -> Callable[..., tuple[jax.Array, jax.Array]]:
    return jax.jit(functools.partial(van_loan, halvings=halvings))


@pytest.mark.parametrize("halvings", [4, 9])
@pytest.mark.parametrize("length", [1e-6, 0.01, 1.0, 4.0, 16.0])
@pytest.mark.parametrize("name", ["random", "stable", "rotating", "nilpotent", "damped", "stiff"])
def test_van_loan_equals_the_matrix_exponential(
    name: str, length: float, halvings: int, generator: Callable[[str], np.random.Generator]
) -> None:
    rng = generator("van loan")
    drift = _drifts(rng)[name]
    root = rng.normal(size=(4, 2))
    density = root @ root.T
    phi, Q = compiled_van_loan(halvings)(drift, density, length)
    expected_phi, expected_Q = exact_van_loan(drift, density, length)
    # Over one of 2^halvings pieces the series of exp leaves a^9 / 9! e^a, and four nodes leave (2 a)^8 4!^4 / (9 8!^3) of
    # the integral, where a = norm(A) h; the pieces add up, and each doubling rounds by a few eps that double with it.
    pieces = 2**halvings
    a = length / pieces
    series = a**9 / math.factorial(9) * np.exp(a)
    quadrature = (2 * a) ** 8 * math.factorial(4) ** 4 / (9 * math.factorial(8) ** 3)
    bound = pieces * (2 * series + 4 * EPS) + 4 * quadrature + 64 * EPS
    for actual, expected in ((phi, expected_phi), (Q, expected_Q)):
        assert np.abs(actual - expected).max() <= bound * np.abs(expected).max()
    assert np.linalg.eigvalsh(np.asarray(Q)).min() >= -64 * EPS * np.abs(expected_Q).max()


def test_van_loan_with_enough_halvings_is_exact_to_rounding() -> None:
    # So that the bound above is not loose by orders of magnitude: norm(A) dt = 16 in pieces of 1 / 32.
    drift = np.array([[0.0, 16.0], [-16.0, 0.0]])
    phi, _ = compiled_van_loan(9)(drift, np.eye(2), 1.0)
    c, s = np.cos(16.0), np.sin(16.0)
    np.testing.assert_allclose(phi, [[c, s], [-s, c]], atol=512 * 4 * EPS)


def test_the_reference_exponential_is_scipys_where_that_is_accurate(rng: np.random.Generator) -> None:
    drift, density = rng.normal(size=(3, 3)), np.diag([1.0, 2.0, 0.5])
    big = scipy.linalg.expm(np.block([[-drift, density], [np.zeros((3, 3)), drift.T]]) * 0.2)
    phi, Q = exact_van_loan(drift, density, 0.2)
    np.testing.assert_allclose(phi, big[3:, 3:].T, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(Q, big[3:, 3:].T @ big[:3, 3:], rtol=1e-12, atol=1e-14)


def test_zero_order_hold_holds_the_input(rng: np.random.Generator) -> None:
    drift, gain = rng.normal(size=(3, 3)), rng.normal(size=(3, 2))
    phi, gamma = zero_order_hold(jnp.asarray(drift), jnp.asarray(gain), jnp.asarray(0.7))
    np.testing.assert_allclose(phi, scipy.linalg.expm(drift * 0.7), rtol=1e-12, atol=1e-13)
    # A gamma = (exp(A dt) - 1) B.
    np.testing.assert_allclose(drift @ gamma, (phi - np.eye(3)) @ gain, rtol=1e-11, atol=1e-12)


# Steps ----------------------------------------------------------------------------------------------------------------


def _moment(model: AbstractModel, t: float, dt: float) -> Instant:
    return Instant(jnp.asarray(t), jnp.asarray(dt), jnp.full(len(model.inputs), 0.3))


def test_substeps_are_shorter_steps() -> None:
    model = spring_model()
    single, four = (
        eqx.tree_at(lambda model: model.dynamics, model, dataclasses.replace(model.dynamics, substeps=substeps))
        for substeps in (1, 4)
    )
    x = jnp.array([0.5, -1.0])
    expected = x
    for k in range(4):
        expected = single.transition(expected, _moment(model, 1.0 + 0.1 * (k + 1), 0.1))
    np.testing.assert_allclose(four.transition(x, _moment(model, 1.4, 0.4)), expected, rtol=64 * EPS)


def test_noise_of_two_steps_is_the_noise_of_one() -> None:
    model = chain_model()
    x = jnp.array([1.0, 2.0, 3.0])
    phi = jax.jacfwd(lambda x: model.transition(x, _moment(model, 0.4, 0.4)))(x)
    half, whole = (model.process_noise(x, _moment(model, 1.0, dt)) for dt in (0.4, 0.8))
    np.testing.assert_allclose(whole, phi @ half @ phi.T + half, rtol=1e-13)


def test_noise_of_an_integrator_chain_is_the_textbook_polynomial() -> None:
    # Bar-Shalom, Li and Kirubarajan (2001), section 6.2: white noise jerk of density q.
    model = gf.continuous_model(
        lambda x: jnp.stack([x[1], x[2], 0.0 * x[0]]), lambda x: x[:1], states=3, outputs=1, Q=[0.0, 0.0, 0.7], R=1.0
    )
    T, q = 1.7, 0.7
    expected = q * np.array([[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]])
    np.testing.assert_allclose(model.process_noise(jnp.zeros(3), _moment(model, T, T)), expected, rtol=1e-13)


def test_runge_kutta_is_of_fourth_order() -> None:
    model = spring_model()
    x = jnp.array([1.0, 0.0])

    def end(steps: int) -> np.ndarray:
        y, dt = x, 1.0 / steps
        for k in range(steps):
            y = step(y, _moment(model, (k + 1) * dt, dt))
        return np.asarray(y)

    step = jax.jit(lambda x, when: model.transition(x, when))
    exact = end(256)
    errors = [np.abs(end(steps) - exact).max() for steps in (2, 4, 8)]
    for coarse, fine in itertools.pairwise(errors):
        assert 12 < coarse / fine < 22  # 2^4 to leading order


def test_euler_is_of_first_order_and_runge_kutta_its_limit() -> None:
    # dx/dt = -x from 1: the factor of an Euler step is 1 - dt, that of the exact solution exp(-dt).
    def end(method: object, steps: int) -> float:
        x, dt = jnp.ones(1), jnp.asarray(1.0 / steps)
        for _ in range(steps):
            x = method(lambda z, t: -z, x, jnp.zeros(()), dt)  # type: ignore[operator]
        return float(x[0])

    assert end(forward_euler, 8) == pytest.approx((1 - 1 / 8) ** 8, rel=1e-14)
    errors = [abs(end(forward_euler, steps) - math.exp(-1)) for steps in (16, 32, 64)]
    for coarse, fine in itertools.pairwise(errors):
        assert 1.9 < coarse / fine < 2.1  # 2^1 to leading order
    assert end(runge_kutta_4, 64) == pytest.approx(math.exp(-1), rel=1e-9)  # dt^4 / 120


# Records --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def gappy(generator: object) -> tuple[AbstractModel, object, np.ndarray, np.ndarray, np.ndarray]:
    rng = generator("gappy")  # type: ignore[operator]
    model = chain_model()
    t = np.cumsum([0.0, 0.1, 0.35, 0.1, 1.0, 0.0, 0.2, 0.77])
    y, u = rng.normal(size=(8, 1)), rng.normal(size=(8, 1))
    y[3] = np.nan
    return model, gf.make_prior(model, [0.0, 1.0, 0.0], [1.0, 0.5, 0.2]), t, y, u


def test_splitting_long_steps_leaves_a_linear_models_estimates_unchanged(gappy: tuple) -> None:
    model, prior, t, y, u = gappy
    estimator = gf.kalman_filter()
    whole = gf.run(estimator, model, prior, gf.make_log(model, t, y, u))
    split = gf.run(estimator, model, prior, gf.make_log(model, t, y, u, max_step=0.1))
    kept = split.log.kept
    assert len(split.log) > len(whole.log)
    assert kept.sum() == len(whole.log)
    np.testing.assert_array_equal(split.t[kept], whole.t)
    # A dozen steps in place of one: rounding alone, since Runge-Kutta is exact for a chain of integrators.
    np.testing.assert_allclose(split.mean[kept], whole.mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(split.cov[kept], whole.cov, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(split.log_likelihood[kept], whole.log_likelihood, rtol=1e-11, atol=1e-12)
    smooth_split, smooth_whole = gf.smooth(split), gf.smooth(whole)
    np.testing.assert_allclose(smooth_split.mean[kept], smooth_whole.mean, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(smooth_split.cov[kept], smooth_whole.cov, rtol=1e-10, atol=1e-11)


def test_splitting_long_steps_of_a_damped_model_costs_the_runge_kutta_error_only() -> None:
    model = gf.continuous_model(
        lambda x: jnp.stack([x[1], -2.0 * x[0] - 0.4 * x[1]]), lambda x: x[:1], states=2, outputs=1, Q=[0.0, 0.1], R=0.2
    )
    prior = gf.make_prior(model, [1.0, 0.0], [0.3, 0.3])
    t, y = np.arange(6) * 0.2, np.cos(np.arange(6) * 0.28)
    whole = gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, t, y))
    split = gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, t, y, max_step=0.05))
    # norm(A) = 2.1: each step of 0.2 is off by (0.42)^5 / 120 = 1.1e-4 of the state, which measurements then correct.
    np.testing.assert_allclose(split.mean[split.log.kept], whole.mean, atol=5e-4)
    assert np.abs(split.mean[split.log.kept] - whole.mean).max() > 1e-9


# Augmenting -----------------------------------------------------------------------------------------------------------


def test_augmenting_with_biases_equals_the_model_written_by_hand() -> None:
    estimator = gf.unscented_kalman_filter()
    F, H, B = np.array([[1.0, 0.1], [0.0, 0.9]]), np.array([[1.0, 0.0], [0.3, 1.0]]), np.array([[0.0], [0.5]])
    Q, R = np.diag([0.01, 0.04]), np.diag([0.1, 0.2])
    base = gf.linear_model(F, H, Q=Q, R=R, B=B, states=["p", "v"], outputs=["y", "z"], inputs=["u"])
    model = gf.augment(base, biases={"z": 0.3, "u": 0.0})
    # The output reads its true value plus the bias; the input is the true one plus the bias, so the bias is taken off.
    by_hand = gf.linear_model(
        np.block([[F, np.zeros((2, 1)), -B], [np.zeros((2, 2)), np.eye(2)]]),
        np.hstack([H, [[0.0, 0.0], [1.0, 0.0]]]),
        Q=lambda x, u, t, dt: (
            jnp.asarray(scipy.linalg.block_diag(Q, np.zeros((2, 2)))) + 0.09 * dt * jnp.diag(jnp.eye(4)[2])
        ),
        R=R,
        B=np.vstack([B, np.zeros((2, 1))]),
        states=model.space.names,
    )
    rng = np.random.default_rng(4)
    t, y, u = np.arange(12) * 0.5, rng.normal(size=(12, 2)), rng.normal(size=(12, 1))
    y[4, 0] = np.nan
    deviations = [1.0, 0.5, 0.7, 0.4]
    ours, theirs = (
        gf.run(estimator, m, gf.make_prior(m, np.zeros(4), deviations), gf.make_log(m, t, y, u))
        for m in (model, by_hand)
    )
    assert model.space.names == ("p", "v", "bias_z", "bias_u")
    np.testing.assert_allclose(ours.mean, theirs.mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ours.cov, theirs.cov, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(ours.log_likelihood, theirs.log_likelihood, rtol=1e-12)


def test_an_augmented_parameter_moves_the_model_like_the_model_with_that_value() -> None:
    base = spring_model()
    model = gf.augment(base, parameters={"stiffness": 0.1}, bounds={"stiffness": (0, None)})
    when = _moment(base, 0.5, 0.1)
    moved = model.transition(jnp.array([1.0, -0.5, 3.5]), when)
    expected = base.with_parameters({"stiffness": jnp.array(3.5)}).transition(jnp.array([1.0, -0.5]), when)
    np.testing.assert_array_equal(moved, jnp.append(expected, 3.5))
    # The walk is in the unbounded coordinate, here relative: 0.1^2 per second over 0.1 s.
    assert float(model.process_noise(jnp.array([1.0, -0.5, 3.5]), when)[2, 2]) == pytest.approx(0.1**2 * 0.1, rel=1e-15)
