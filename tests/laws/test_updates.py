"""Every update treats missing data as missing, stays a covariance, and equals Bayes' rule in its limit."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.models import Sample
from gainful.testing import check_noise, check_update
from gainful.testing.cart import cart_model, cart_prior, instant, reading
from gainful.testing.comparisons import assert_identical, assert_same_estimate
from gainful.updates import AbstractUpdate

from .parts import NOISES, UPDATES, flat, name_of


@pytest.mark.parametrize(("update", "limit"), flat(UPDATES), ids=name_of)
def test_every_update_keeps_its_laws(update: AbstractUpdate, limit: AbstractUpdate) -> None:
    # The cart's covariances have condition numbers of a few, so rounding is a few dozen eps.
    check_update(update, limit=limit, tolerance=1e-11)


@pytest.mark.parametrize("noise", flat(NOISES), ids=name_of)
def test_every_noise_law_keeps_its_laws(noise: gf.noise.AbstractNoise) -> None:
    check_noise(noise)


def _step(update: AbstractUpdate, y: jax.Array, seen: list[bool], dt: float, **parts: object) -> tuple[object, object]:
    model, prior = cart_model(), cart_prior()
    estimator = gf.KalmanFilter(update=update, **parts)
    carry = estimator.init(model, prior)
    return carry, estimator.step(model, carry, Sample(instant(model, dt=dt), y, jnp.array(seen)))


@pytest.fixture(scope="module")
def y() -> jax.Array:
    model, prior = cart_model(), cart_prior()
    return reading(model, prior.mean, instant(model), jax.random.key(5), sigmas=2.0)


def test_a_gate_that_lets_everything_pass_is_the_exact_update_bit_for_bit(y: jax.Array) -> None:
    # 40 sigmas: any gate below probability 1 would refuse.
    far = y.at[0].add(8.0)
    _, (_, gated) = _step(gf.Gated(probability=1.0), far, [True] * 3, 0.1)
    _, (_, exact) = _step(gf.Exact(), far, [True] * 3, 0.1)
    assert_identical(_numbers(gated), _numbers(exact), "step")


def _numbers(info: gf.filters.Info) -> dict[str, object]:
    """All that a step reports but the memory of its parts."""
    return {name: value for name, value in vars(info).items() if name != "memory"}


def test_one_iteration_is_the_inner_update_bit_for_bit(y: jax.Array) -> None:
    for inner in (gf.Exact(), gf.Gated(probability=0.5)):
        _, (_, once) = _step(gf.Iterated(inner, iterations=1), y, [True] * 3, 0.1)
        _, (_, plain) = _step(inner, y, [True] * 3, 0.1)
        assert_identical(_numbers(once), _numbers(plain), "step")


def test_a_gate_refuses_the_bad_sensor_alone_and_believes_it_after_its_patience(y: jax.Array) -> None:
    model, prior = cart_model(), cart_prior()
    bad = y.at[0].add(50.0)
    estimator = gf.KalmanFilter(update=gf.Gated(probability=0.999, reacquire=2))
    carry, weights = estimator.init(model, prior), []
    step = jax.jit(lambda carry: estimator.step(model, carry, Sample(instant(model, dt=0.0), bad, jnp.ones(3, bool))))
    for _ in range(3):
        carry, info = step(carry)
        weights.append(np.asarray(info.weight).tolist())
    # The beacon has two outputs, refused together; the compass stays.
    assert weights == [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]]


@pytest.mark.parametrize("probability", [0.5, 0.9])
def test_a_gate_passes_its_share_of_good_measurements(probability: float, rng: np.random.Generator) -> None:
    # One state, one sensor: the innovation is drawn from its own distribution.
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.0, R=1.0)
    estimator = gf.KalmanFilter(update=gf.Gated(probability=probability, reacquire=0))
    carry = estimator.init(model, gf.make_prior(model, [0.0], [2.0]))
    draws = 20_000

    def weight(y: jax.Array) -> jax.Array:
        return estimator.step(model, carry, Sample(instant(model), y, jnp.ones(1, bool)))[1].weight[0]

    passed = jax.jit(jax.vmap(weight))(jnp.asarray(rng.normal(scale=np.sqrt(5.0), size=(draws, 1)))).mean()
    # Five standard deviations of a binomial share.
    assert abs(passed - probability) < 5 * np.sqrt(probability * (1 - probability) / draws)


def test_iterating_a_linear_measurement_changes_nothing() -> None:
    model = gf.linear_model([[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.5]], Q=[0.01, 0.1], R=0.2)
    sample = Sample(instant(model), jnp.array([3.0]), jnp.ones(1, bool))
    for lin in (gf.Taylor(), gf.SigmaPoints()):
        posteriors = []
        for update in (gf.Exact(), gf.Iterated(iterations=4)):
            estimator = gf.KalmanFilter(lin, update)
            carry = estimator.init(model, gf.make_prior(model, [0.0, 1.0], [1.0, 2.0]))
            posteriors.append(estimator.step(model, carry, sample)[1].estimate)
        assert_same_estimate(posteriors[1], posteriors[0], "iterated", tolerance=1e-12)


def test_iterating_finds_the_mode_of_the_posterior() -> None:
    # Bell and Cathey (1993): the iterated filter is Gauss-Newton on the log posterior, so its gradient vanishes there.
    model = gf.discrete_model(lambda x: x, lambda x: jnp.hypot(x[:1], x[1:]), states=2, outputs=1, Q=0.0, R=0.01)
    prior = gf.make_prior(model, [3.0, 1.0], [0.5, 0.4])
    estimator = gf.KalmanFilter(update=gf.Iterated(iterations=12))
    sample = Sample(instant(model), jnp.array([4.5]), jnp.ones(1, bool))
    mode = estimator.step(model, estimator.init(model, prior), sample)[1].estimate.mean

    def log_posterior(x: jax.Array) -> jax.Array:
        off = x - prior.mean
        return -0.5 * (off @ jnp.linalg.solve(prior.cov, off) + (4.5 - jnp.hypot(x[0], x[1])) ** 2 / 0.01)

    assert np.abs(jax.grad(log_posterior)(mode)).max() < 1e-8
