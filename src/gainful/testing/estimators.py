"""The laws of an estimator."""

from __future__ import annotations

from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import Status
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..models import AbstractModel, Sample
from ..running import scan
from .cart import any_prior, cart_model, cart_prior, record
from .comparisons import (
    assert_close,
    assert_covariance,
    assert_identical,
    assert_same_estimate,
    assert_same_form,
    assert_true,
)

_PARTLY, _NOTHING, _AGAIN = 1, 2, 3
"""Rows of the record: some components seen, none seen, none seen at the same moment once more."""


def check_estimator(
    estimator: AbstractEstimator,
    model: AbstractModel | None = None,
    *,
    prior: AbstractEstimate | None = None,
    eager: bool = True,
    tolerance: float = 1e-9,
) -> None:
    """Raise unless an estimator gives the same numbers however it is run, and treats missing data as missing.

    Compiled equals step by step, a batch of records equals each record alone; numbers that were not measured do not
    matter; a row without measurement only predicts, and without an interval either it changes nothing.

    Args:
        estimator: the estimator.
        model: of the plant; a small cart with an angle and two sensors by default.
        prior: the estimate to start from.
        eager: take the single steps without compiling them, which may be slower and is one more law.
        tolerance: rounding allowed, in standard deviations.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.filters import kalman_filter
        >>> check_estimator(kalman_filter())
    """
    if model is None:
        model, prior = cart_model(across=False), cart_prior() if prior is None else prior
    prior = any_prior(model) if prior is None else prior
    label = type(estimator).__name__
    ours, other = (record(model, prior.mean, key) for key in jax.random.split(jax.random.key(3), 2))
    infos = _stepped(estimator, model, prior, ours, label, eager)
    batch = jax.jit(jax.vmap(lambda samples: scan(estimator, model, prior, samples)[1]))
    first, second = (
        batch(jax.tree.map(lambda *rows: jnp.stack(rows), *pair)) for pair in ((ours, other), (other, ours))
    )
    if not _agree(_member(first, 0), infos, tolerance):
        # Not the cheapest order to look in, but the one that tells which law is broken.
        _assert_agree(scan(estimator, model, prior, ours)[1], infos, f"{label}: scan = step by step", tolerance)
        compiled = jax.jit(lambda samples: scan(estimator, model, prior, samples)[1])(ours)
        _assert_agree(compiled, infos, f"{label}: jit = eager", tolerance)
        _assert_agree(_member(first, 0), infos, f"{label}: vmap = loop", tolerance)
    # Each record gives the same in either place, whatever its neighbour.
    _assert_agree(_member(second, 1), infos, f"{label}: vmap = loop", tolerance)
    _assert_agree(_member(second, 0), _member(first, 1), f"{label}: vmap = loop", tolerance)
    _check_estimates(infos, label)


def _member(infos: Any, i: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[i], infos)


def _stepped(
    estimator: AbstractEstimator,
    model: AbstractModel,
    prior: AbstractEstimate,
    samples: Sample,
    label: str,
    eager: bool,
) -> Any:
    """The record one step after the other, with the laws of single rows checked on the way."""
    carry, infos = estimator.init(model, prior), []
    step = estimator.step if eager else eqx.filter_jit(estimator.step)
    for k in range(len(samples.when.t)):
        sample: Sample = jax.tree.map(lambda leaf, k=k: leaf[k], samples)
        after, info = step(model, carry, sample)
        assert_same_form(after, carry, f"{label}: memory")
        if k in (_PARTLY, _NOTHING):
            other = step(model, carry, _disturbed(model, sample))[1]
            assert_identical(other, info, f"{label}: numbers that were not measured do not matter")
        if k in (_NOTHING, _AGAIN):
            _check_missing(info, label)
        if k == _NOTHING and eager and hasattr(estimator, "predict"):
            predicted = cast("Any", estimator).predict(model, carry, sample)
            assert_identical(info.estimate, predicted, f"{label}: without a measurement it only predicts")
        if k == _AGAIN:
            what = f"{label}: without a measurement and an interval nothing changes"
            assert_identical(info.estimate, infos[-1].estimate, what)
        carry = after
        infos.append(info)
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *infos)


def _disturbed(model: AbstractModel, sample: Sample) -> Sample:
    """The sample with other valid numbers where nothing was measured."""
    return Sample(sample.when, model.output.plus(sample.y, jnp.where(sample.seen, 0.0, 0.7)), sample.seen)


def _check_missing(info: Any, label: str) -> None:
    what = f"{label}: without a measurement"
    for name in ("weight", "nis", "log_likelihood", "residual"):
        value = np.asarray(getattr(info, name))
        assert_true(not np.any(value), f"{what}: expected {name} 0, got {value}")
    status = Status(int(info.status))
    assert_true(status == Status.missing, f"{what}: expected the status missing, got {status.name}")


def _check_estimates(infos: Any, label: str) -> None:
    covs: Array = jax.vmap(lambda estimate: estimate.cov)(infos.estimate)
    for k, cov in enumerate(np.asarray(covs)):
        assert_covariance(cov, f"{label}: covariance after row {k}")
    failed = [Status(int(code)).name for code in np.asarray(infos.status) if Status(int(code)).failed]
    assert_true(not failed, f"{label}: expected no failed step, got {failed}")


def _agree(actual: Any, expected: Any, tolerance: float) -> bool:
    try:
        _assert_agree(actual, expected, "", tolerance)
    except AssertionError:
        return False
    return True


def _assert_agree(actual: Any, expected: Any, what: str, tolerance: float) -> None:
    for k in range(len(expected.status)):
        ours, theirs = (jax.tree.map(lambda leaf, k=k: leaf[k], infos.estimate) for infos in (actual, expected))
        assert_same_estimate(ours, theirs, f"{what}: row {k}", tolerance=tolerance)
    for name in ("residual", "residual_cov", "nis", "log_likelihood", "weight"):
        assert_close(getattr(actual, name), getattr(expected, name), f"{what}: {name}", tolerance=tolerance)
    assert_identical(actual.status, expected.status, f"{what}: status")
    assert_same_form(actual.memory, expected.memory, f"{what}: memory")
    for ours, theirs in zip(jax.tree.leaves(actual.memory), jax.tree.leaves(expected.memory), strict=True):
        assert_close(ours, theirs, f"{what}: memory", tolerance=tolerance)
