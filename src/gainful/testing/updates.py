"""The laws of an update."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..estimates import AbstractEstimate, Gaussian, SquareRoot
from ..linearization import Taylor
from ..models import AbstractModel
from ..updates import AbstractUpdate, Exact, Likelihood
from .cart import cart_model, cart_prior, instant, reading
from .comparisons import (
    assert_close,
    assert_covariance,
    assert_identical,
    assert_same_estimate,
    assert_same_form,
    assert_true,
)

_OUTLIER = 30.0  # sigmas


def check_update(update: AbstractUpdate, *, limit: AbstractUpdate | None = None, tolerance: float = 1e-10) -> None:
    """Raise unless an update keeps the laws of every update.

    An unmeasured component changes nothing, whatever number stands in its place; with nothing measured the estimate
    and the memory stay; the covariance stays symmetric and positive semi-definite, for outliers too; weights are at
    least 0, and 0 where nothing was measured; the innovation is told against the prediction; and `limit`, the same
    update with its parameter in the limit, equals `Exact`.

    Args:
        update: the update.
        limit: the update in the limit where it equals `Exact`, such as `Gated(probability=1.0)`.
        tolerance: rounding allowed, in standard deviations.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.updates import Gated
        >>> check_update(Gated(), limit=Gated(probability=1.0))
    """
    model, start = cart_model(), cart_prior()
    keys = jax.random.split(jax.random.key(7), 6)
    sigmas = [0.5, 1.0, 1.0, 3.0, _OUTLIER, _OUTLIER]
    readings = [reading(model, start.mean, instant(model), k, sigmas=s) for k, s in zip(keys, sigmas, strict=True)]
    if limit is not None:
        _check_limit(limit, start, readings, f"{type(update).__name__}: in its limit", tolerance)
    for kind in (Gaussian, SquareRoot):
        prior = kind.start(start.mean, start.cov, start.space)
        label = f"{type(update).__name__} of a {kind.__name__}"
        act, memory = eqx.Partial(eqx.filter_jit(_act), update, model), update.init(model)
        _check_unmeasured(act, memory, prior, readings, label, tolerance)
        for y in readings:
            after, found = act(memory, prior, jnp.ones(3, bool), y)
            assert_same_form(after, memory, f"{label}: memory")
            _check_report(found, prior, y, label, tolerance)
            memory = after


def _act(
    update: AbstractUpdate, model: AbstractModel, memory: Any, prior: AbstractEstimate, seen: Array, y: Array
) -> tuple[Any, Any]:
    when = instant(model)
    noise = model.measurement_noise(prior.mean, when)
    process = model.process_noise(prior.mean, when)
    likelihood = Likelihood(
        lambda x: model.observe(x, when), model.output, noise, seen, process, model.sensors, Taylor(), when=when
    )
    return update(memory, prior, likelihood, y)


def _check_unmeasured(
    act: Any, memory: Any, prior: AbstractEstimate, readings: list[Array], label: str, tolerance: float
) -> None:
    after, found = act(memory, prior, jnp.zeros(3, bool), readings[0])
    what = f"{label}: with nothing measured"
    assert_identical(after, memory, f"{what}, the memory stays")
    assert_same_estimate(found.posterior, prior, what, tolerance=tolerance)
    assert_true(not np.any(found.weight), f"{what}: expected weights of 0, got {found.weight}")
    assert_true(float(found.innovation.log_likelihood) == 0.0, f"{what}: expected a log likelihood of 0")
    for i in range(3):
        seen = jnp.ones(3, bool).at[i].set(False)
        base = act(memory, prior, seen, readings[1])
        other = act(memory, prior, seen, readings[1].at[i].set(readings[4][i]))
        what = f"{label}: with component {i} unmeasured"
        assert_identical(other, base, f"{what}, its number does not matter")
        for part, value in (("weight", base[1].weight), ("residual", base[1].innovation.residual)):
            assert_true(float(value[i]) == 0.0, f"{what}: expected {part} 0 there, got {value}")


def _check_report(found: Any, prior: AbstractEstimate, y: Array, label: str, tolerance: float) -> None:
    posterior = found.posterior
    inside = np.all(np.isfinite(posterior.mean)) and not np.any(np.asarray(prior.space.defect(posterior.mean)))
    assert_true(inside, f"{label}: expected a point of the space, got {posterior.mean}")
    assert_covariance(posterior.cov, f"{label}: posterior covariance")
    weight = np.asarray(found.weight)
    assert_true(np.all(np.isfinite(weight) & (weight >= 0)), f"{label}: expected weights of at least 0, got {weight}")
    model = cart_model()
    residual = model.output.minus(y, model.observe(prior.mean, instant(model)))
    what = f"{label}: the innovation is measured minus predicted from the prior"
    assert_close(found.innovation.residual, residual, what, tolerance=tolerance)


def _check_limit(
    limit: AbstractUpdate, prior: AbstractEstimate, readings: list[Array], what: str, tolerance: float
) -> None:
    model, seen = cart_model(), jnp.ones(3, bool)
    memory = limit.init(model)

    @jax.jit
    def both(memory: Any, y: Array) -> tuple[Any, AbstractEstimate, AbstractEstimate]:
        after, found = _act(limit, model, memory, prior, seen, y)
        return after, found.posterior, _act(Exact(), model, None, prior, seen, y)[1].posterior

    for y in readings:
        memory, found, exact = both(memory, y)
        assert_same_estimate(found, exact, f"{what} it equals Exact", tolerance=tolerance)
