"""The public checks refuse parts that are broken, and say which law is."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful import testing
from gainful.linearization import Cubature
from gainful.testing.cart import cart_model, cart_prior
from gainful.testing.comparisons import assert_close, assert_covariance, assert_identical


class SlantedCubature(Cubature):
    def points(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points, mean, cov = super().points(n)
        return points * 1.01, mean, cov


class LooseTaylor(gf.Taylor):
    def __call__(self, fn: Any, estimate: Any, out_space: Any) -> Any:
        return eqx.tree_at(
            lambda affine: affine.matrix, super().__call__(fn, estimate, out_space), replace_fn=_enlarged
        )


def _enlarged(matrix: jax.Array) -> jax.Array:
    return 1.001 * matrix


class Peeking(gf.Exact):
    """Lets a measurement through that was never made."""

    def __call__(self, carry: Any, prior: Any, likelihood: Any, y: Any) -> Any:
        carry, update = super().__call__(carry, prior, likelihood, y)
        return carry, eqx.tree_at(lambda u: u.posterior.mean, update, update.posterior.mean + 1e-6 * y[0])


class Overconfident(gf.Exact):
    """Believes a measurement more than it should."""

    def __call__(self, carry: Any, prior: Any, likelihood: Any, y: Any) -> Any:
        sharper = eqx.tree_at(lambda part: part.noise, likelihood, 0.99 * likelihood.noise)
        return super().__call__(carry, prior, sharper, y)


class Drifting(gf.Nominal):
    """Lets R grow while nothing is measured."""

    def init(self, model: Any) -> Any:
        return jnp.array(1.0)

    def measurement(self, carry: Any, R: Any) -> Any:
        return carry * R

    def learn(self, carry: Any, update: Any) -> Any:
        return 1.01 * carry


class Blinking(gf.KalmanFilter):
    """Forgets a little at each step, also at one that takes no time."""

    def step(self, model: Any, carry: Any, sample: Any) -> Any:
        carry, info = super().step(model, carry, sample)
        return carry, eqx.tree_at(lambda part: part.estimate.cov, info, 1.001 * info.estimate.cov)


class Transposing(gf.Gaussian):
    """Smooths with the gain of the wrong covariance."""

    def revise(self, affine: Any, future: Any) -> Any:
        return super().revise(affine, dataclasses.replace(future, cov=2.0 * future.cov))


def _creep(x: Any, u: Any, t: Any, dt: Any) -> Any:
    return x + dt


class Creeping(eqx.Module):
    """A model that moves although no time passes."""

    inner: Any

    def __getattr__(self, name: str) -> Any:
        return getattr(object.__getattribute__(self, "inner"), name)

    def transition(self, x: Any, when: Any) -> Any:
        return self.inner.transition(x, when) + 1e-9


def test_a_rule_with_too_much_spread_is_refused() -> None:
    with pytest.raises(AssertionError, match=r"SlantedCubature for 1 states: moment of powers \(2,\)"):
        testing.check_rule(SlantedCubature())


def test_a_slope_that_is_off_is_refused() -> None:
    with pytest.raises(AssertionError, match="LooseTaylor of an affine function: A L = F L"):
        testing.check_linearization(LooseTaylor())


def test_an_update_that_reads_what_was_not_measured_is_refused() -> None:
    with pytest.raises(AssertionError, match="Peeking of a Gaussian: with nothing measured: mean"):
        testing.check_update(Peeking())


def test_an_update_that_is_not_exact_in_its_limit_is_refused() -> None:
    with pytest.raises(AssertionError, match="Exact: in its limit it equals Exact: mean"):
        testing.check_update(gf.Exact(), limit=Overconfident())


def test_a_noise_law_that_learns_from_nothing_is_refused() -> None:
    with pytest.raises(AssertionError, match="Drifting after a Gaussian: with nothing measured, R stays"):
        testing.check_noise(Drifting())


def test_an_estimator_that_changes_at_no_time_is_refused() -> None:
    with pytest.raises(AssertionError, match="Blinking: without a measurement"):
        testing.check_estimator(Blinking())


def test_an_estimate_with_a_wrong_smoother_is_refused() -> None:
    with pytest.raises(AssertionError, match="Transposing with 2 of 2 seen: revise: covariance"):
        testing.check_estimate(Transposing)


def test_a_model_that_moves_in_no_time_is_refused() -> None:
    with pytest.raises(AssertionError, match="Creeping: dt = 0 leaves the state alone"):
        testing.check_model(Creeping(cart_model()), point=cart_prior().mean)


def test_comparisons_say_where_and_by_how_much() -> None:
    with pytest.raises(AssertionError, match=r"law: expected 2 at \(1,\), got 2.5; off by 0.25, more than 0.1"):
        assert_close([1.0, 2.5], [1.0, 2.0], "law", tolerance=0.1)
    with pytest.raises(AssertionError, match="off by nan"):
        assert_close([np.nan], [1.0], "law", tolerance=1e9)
    with pytest.raises(AssertionError, match="expected shape"):
        assert_close([1.0], [1.0, 1.0], "law", tolerance=1.0)
    with pytest.raises(AssertionError, match="law: expected"):
        assert_identical(jnp.array([1.0]), jnp.array([1.0 + 2**-52]), "law")
    with pytest.raises(AssertionError, match="positive semi-definite"):
        assert_covariance([[1.0, 1.1], [1.1, 1.0]], "law")
    with pytest.raises(AssertionError, match="symmetric"):
        assert_covariance([[1.0, 0.1], [0.2, 1.0]], "law")
