"""The laws of a noise law."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..estimates import AbstractEstimate, Gaussian, SquareRoot
from ..linearization import Taylor
from ..models import AbstractModel
from ..noise import AbstractNoise
from ..updates import Exact, Likelihood, Update
from .cart import cart_model, cart_prior, instant, reading
from .comparisons import assert_close, assert_covariance, assert_identical, assert_same_form

_STEPS = 12


def check_noise(noise: AbstractNoise, *, tolerance: float = 1e-10) -> None:
    """Raise unless a noise law keeps the laws of every noise law.

    What it gives for Q and R is a covariance of the same size, before learning and after; learning keeps the form of
    the memory and does not depend on numbers that were not measured; and with nothing measured R stays what it was.

    Args:
        noise: the noise law.
        tolerance: rounding allowed.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.noise import Nominal
        >>> check_noise(Nominal())
    """
    model, start = cart_model(), cart_prior()
    when = instant(model)
    q, r = model.process_noise(start.mean, when), model.measurement_noise(start.mean, when)
    for kind in (Gaussian, SquareRoot):
        prior = kind.start(start.mean, start.cov, start.space)
        label = f"{type(noise).__name__} after a {kind.__name__}"
        learn, memory = eqx.filter_jit(_learn), noise.init(model)
        for key in jax.random.split(jax.random.key(11), _STEPS):
            y = reading(model, start.mean, when, key, sigmas=2.0)
            _check_noises(noise, memory, q, r, label)
            everything, nothing = jnp.ones(3, bool), jnp.zeros(3, bool)
            idle = learn(noise, model, memory, prior, r, nothing, y)
            assert_close(
                noise.measurement(idle, r),
                noise.measurement(memory, r),
                f"{label}: with nothing measured, R stays",
                tolerance=tolerance,
            )
            partly = everything.at[0].set(False)
            one = learn(noise, model, memory, prior, r, partly, y)
            other = learn(noise, model, memory, prior, r, partly, y.at[0].add(100.0))
            assert_identical(other, one, f"{label}: a number that was not measured does not matter")
            after = learn(noise, model, memory, prior, r, everything, y)
            assert_same_form(after, memory, f"{label}: memory")
            memory = after
        _check_noises(noise, memory, q, r, label)


def _check_noises(noise: AbstractNoise, memory: Any, q: Any, r: Any, label: str) -> None:
    for role, given, value in (("Q", q, noise.process(memory, q)), ("R", r, noise.measurement(memory, r))):
        assert_same_form(value, given, f"{label}: {role}")
        assert_covariance(value, f"{label}: {role}")


def _learn(
    noise: AbstractNoise, model: AbstractModel, memory: Any, prior: AbstractEstimate, r: Array, seen: Array, y: Array
) -> Any:
    when = instant(model)
    used = noise.measurement(memory, r)
    process = noise.process(memory, model.process_noise(prior.mean, when))
    likelihood = Likelihood(
        lambda x: model.observe(x, when), model.output, used, seen, process, model.sensors, Taylor()
    )
    update: Update = Exact()(None, prior, likelihood, y)[1]
    return noise.learn(memory, update)
