"""A run tells how its network was used."""

import dataclasses

import jax
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import aiding_use
from gainful.networks import AffineMap, PerceptronTraining
from gainful.updates import Corrected


@pytest.fixture(scope="module")
def network() -> object:
    """Trained on innovations of a tenth of the size that they will have."""
    inputs = 0.1 * np.random.default_rng(0).normal(size=(80, 3))
    return PerceptronTraining((2,), iterations=2)(inputs, inputs[:, :1], key=jax.random.key(0))[0]


def test_shares_are_those_of_the_measured_rows_and_strange_ones_are_warned_of(network: AffineMap) -> None:
    model = gf.linear_model([[1.0]], [[1.0]], Q=1.0, R=1.0)
    prior = gf.make_prior(model, [0.0], [1.0])
    log = gf.draw_log(model, prior, np.arange(40.0), key=jax.random.key(2))
    log = dataclasses.replace(log, seen=log.seen & (np.arange(40) % 4 > 0)[:, None])
    result = gf.run(gf.kalman_filter(update=Corrected(network, gate=None)), model, prior, log)
    (use,) = aiding_use(result)
    assert (use.measured, use.unmeasured) == (30, 10)
    assert use.passed == 1.0
    assert use.unknown > 0.5
    assert any("unlike those the network was trained on" in text for text in gf.verdict(result).warnings)
    plain = gf.run(gf.kalman_filter(), model, prior, log)
    assert aiding_use(plain) == ()
