"""Networks, gates and maps: what is asked for in vain is said with what was expected and what came."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.aiding import SensorMap, Smoother, validation_gate
from gainful.errors import ConfigError, DataError, GainfulError, ShapeError
from gainful.linearization import Taylor
from gainful.networks import (
    CMAC,
    AffineTraining,
    CMACTraining,
    HarmonicTraining,
    PerceptronTraining,
    Tiling,
    make_tiling,
    zero_map,
)
from gainful.updates import Context, Corrected, Exact, InnovationHistory, Likelihood, OnlineGate

KEY = jax.random.key(0)
LINE = np.linspace(0.0, 1.0, 200)[:, None]
MODEL = gf.linear_model([[1.0, 1.0], [0.0, 1.0]], [[1.0, 0.0]], Q=0.1, R=1.0, states=["x", "v"], outputs=["y"])
PRIOR = gf.make_prior(MODEL, [0.0, 0.0], [1.0, 1.0])
LOG = gf.make_log(MODEL, np.arange(60.0), np.zeros(60), truth={"x": np.zeros(60)})
UNSEEN = gf.make_log(MODEL, np.arange(60.0), np.full(60, np.nan), truth={"x": np.zeros(60)})
OTHER = gf.linear_model(np.eye(2), [[1.0, 0.0]], Q=0.1, R=1.0, states=["place", "v"], outputs=["y"])


def map_of(signal: str = "y", context: tuple[str, ...] = ("x",)) -> SensorMap:
    return SensorMap(signal, context, zero_map(len(context), 1), jnp.asarray(1.0))


def trained(**options: object) -> object:
    return gf.train_aiding(gf.kalman_filter(), MODEL, PRIOR, [LOG] * 4, **({"held_out": 2, "key": KEY} | options))


def learned(**options: object) -> object:
    given = {"signal": "y", "context": ["x"], "key": KEY} | options
    return gf.learn_sensor_map(MODEL, [LOG, LOG], [np.zeros((60, 2))] * 2, **given)


def timeless(features: Context) -> object:
    """Features of a measurement that nobody told the moment of."""
    seen, still = jnp.ones(1, bool), jnp.zeros((2, 2))
    likelihood = Likelihood(lambda x: x[:1], MODEL.output, jnp.eye(1), seen, still, MODEL.sensors, Taylor())
    _, update = Exact()(None, PRIOR, likelihood, jnp.zeros(1))
    return features(features.init(MODEL), likelihood, update)


MISTAKES: list[tuple[Callable[[], object], type[GainfulError], str]] = [
    (lambda: CMACTraining(levels=4, layers=5), ConfigError, "levels: expected a whole number of at least the 5 layers"),
    (lambda: CMACTraining(layers=0), ConfigError, "layers: expected a whole number of at least 1, got 0"),
    (lambda: CMACTraining(rate=2.0), ConfigError, "rate: expected a number above 0 and below 2, got 2.0"),
    (lambda: CMACTraining(exponent=-1.0), ConfigError, "exponent: expected a number of at least 0, got -1.0"),
    (lambda: CMACTraining(method="ridg"), ConfigError, "method: 'ridg' is not known; did you mean 'ridge'?"),
    (lambda: CMACTraining(epochs=0), ConfigError, "epochs: expected a whole number of at least 1, got 0"),
    (lambda: CMACTraining(ridge=0.0), ConfigError, "ridge: expected a number above 0, got 0.0"),
    (lambda: CMACTraining(forgetting=1.5), ConfigError, "forgetting: expected a number above 0 and at most 1, got 1.5"),
    (lambda: CMAC((), jnp.zeros((1, 1)), jnp.zeros(1), 1), ConfigError, "tilings: expected at least one, got none"),
    (
        lambda: make_tiling(np.eye(3).repeat(2, 0), levels=1000, layers=2, compress="none", table="dense"),
        ConfigError,
        "cells: expected a number from 1 to 16777216, got 2515",
    ),
    (lambda: make_tiling(LINE, compress="tanh"), ConfigError, "compress: 'tanh' is not known"),
    (lambda: make_tiling(LINE, columns=[1]), ConfigError, "columns: expected numbers from 0 to 0, got 1"),
    (lambda: make_tiling(LINE, displacement=[1, 2]), ConfigError, "displacement: expected 1 numbers, got (1, 2)"),
    (
        lambda: Tiling(*[jnp.zeros(1)] * 4, (0,), 8, 4, (1, 1), "none", False, 8),
        ConfigError,
        "displacement: expected 1 numbers, got (1, 1)",
    ),
    (lambda: PerceptronTraining(hidden=()), ConfigError, "hidden: expected whole numbers of at least 1, got ()"),
    (lambda: PerceptronTraining(rate=0.0), ConfigError, "rate: expected a number above 0, got 0.0"),
    (lambda: PerceptronTraining(method="adam"), ConfigError, "method: 'adam' is not known"),
    (lambda: HarmonicTraining(0), ConfigError, "harmonics: expected a whole number of at least 1, got 0"),
    (lambda: AffineTraining()(LINE[:40], LINE[:40], key=KEY), DataError, "expected at least 50 examples for 1 outputs"),
    (lambda: AffineTraining()(LINE, LINE[:9], key=KEY), ShapeError, "got shapes (200, 1) and (9, 1)"),
    (lambda: AffineTraining()(LINE / 0.0, LINE, key=KEY), DataError, "inputs: expected finite numbers, got"),
    (lambda: CMACTraining()(LINE[:60], LINE[:60], key=KEY), DataError, "visited less than 20 times; expected about"),
    (lambda: OnlineGate(window=0.5), ConfigError, "window: expected a number of at least 1, got 0.5"),
    (lambda: OnlineGate(least=-1), ConfigError, "least: expected a whole number of at least 0, got -1"),
    (lambda: InnovationHistory(leaks=(1.0,)), ConfigError, "leaks: expected numbers of at least 0 and below 1"),
    (lambda: Context(("z",)).init(MODEL), ConfigError, "signals: 'z' is no state, input or time"),
    (lambda: timeless(Context(("t",))), ConfigError, "context features: expected an update that is told the moment"),
    (
        lambda: Corrected(zero_map(5, 2), least_visits=-1.0),
        ConfigError,
        "least_visits: expected a number of at least 0",
    ),
    (
        lambda: Corrected(zero_map(5, 2), variances=zero_map(5, 2)),
        ConfigError,
        "variances: expected a covariance too, whose correlations they take, got none",
    ),
    (
        lambda: Corrected(zero_map(4, 2)).init(MODEL),
        ConfigError,
        "network: expected 5 inputs (move x, move v, left y, gain x by y, gain v by y) and 2 outputs, got 4 and 2",
    ),
    (
        lambda: Corrected(zero_map(5, 2), covariance=jnp.eye(3)).init(MODEL),
        ConfigError,
        "covariance: expected shape (2, 2), got (3, 3)",
    ),
    (
        lambda: Corrected(zero_map(5, 2), components=("w",)).init(MODEL),
        ConfigError,
        "components: 'w' is not a state of the model",
    ),
    (
        lambda: gf.smooth(gf.run(gf.kalman_filter(update=Corrected(zero_map(5, 2))), MODEL, PRIOR, LOG)),
        GainfulError,
        "smooth the filter without it",
    ),
    (
        lambda: validation_gate(np.zeros((1, 5, 2)), np.zeros((1, 5, 2))),
        ConfigError,
        "expected at least 2 records, got 1",
    ),
    (lambda: validation_gate(np.zeros((2, 5, 2)), np.zeros((2, 5, 1))), ShapeError, "got (2, 5, 2) and (2, 5, 1)"),
    (
        lambda: validation_gate(np.zeros((2, 5, 2)), np.zeros((2, 5, 2)), 5),
        ConfigError,
        "steady_from: expected a row from 0 to 4, got 5",
    ),
    (lambda: trained(held_out=1), ConfigError, "held_out: expected from 2 to 3 of the 4 records, got 1"),
    (lambda: trained(passes=0), ConfigError, "passes: expected a whole number of at least 1, got 0"),
    (lambda: trained(teacher="thruth"), ConfigError, "teacher: 'thruth' is not known; did you mean 'truth'?"),
    (lambda: trained(teacher="reference"), ConfigError, "reference: expected one per record, 4, got none"),
    (
        lambda: trained(teacher="reference", reference=[np.zeros((9, 2))] * 4),
        ShapeError,
        "reference: expected shape (60, 2), got (9, 2)",
    ),
    (
        lambda: gf.train_aiding(gf.kalman_filter(), MODEL, [PRIOR], [LOG] * 4, held_out=2, key=KEY),
        ConfigError,
        "prior: expected one, or one per record, 4, got 1",
    ),
    (
        lambda: gf.train_aiding(
            gf.kalman_filter(), MODEL, PRIOR, [gf.make_log(MODEL, np.arange(9.0), np.zeros(9))] * 4, held_out=2, key=KEY
        ),
        DataError,
        "record 0 has no truth of x, v",
    ),
    (
        lambda: gf.train_aiding(
            gf.kalman_filter(),
            MODEL,
            PRIOR,
            [LOG] * 4,
            held_out=2,
            key=KEY,
            teacher="smoother",
            smoother=Smoother(gf.kalman_filter(), OTHER),
        ),
        ConfigError,
        "smoother: expected the states x, v, got place, v",
    ),
    (
        lambda: gf.train_aiding(gf.kalman_filter(), MODEL, PRIOR, [UNSEEN] * 4, held_out=2, key=KEY),
        DataError,
        "training: expected rows with both a measurement and a reference, got none",
    ),
    (
        lambda: gf.learn_sensor_map(MODEL, [LOG, LOG], [np.zeros((60, 2))], signal="y", context=["x"], key=KEY),
        ConfigError,
        "states: expected one per record, 2, got 1",
    ),
    (
        lambda: gf.learn_sensor_map(MODEL, [LOG, LOG], [np.zeros((9, 2))] * 2, signal="y", context=["x"], key=KEY),
        ShapeError,
        "states: expected shape (60, 2), got (9, 2)",
    ),
    (lambda: learned(signal="z"), ConfigError, "signal: 'z' is not an output of the model"),
    (lambda: learned(context=["z"]), ConfigError, "context: 'z' is no state, input, output or time"),
    (lambda: learned(context=[]), ConfigError, "context: expected at least one name, got none"),
    (lambda: learned(held_out=2), ConfigError, "held_out: expected from 0 to 1 of the records, got 2"),
    (lambda: learned(every=0), ConfigError, "every: expected a whole number of at least 1, got 0"),
    (lambda: learned(floor=-1.0), ConfigError, "floor: expected a sigma of at least 0, got -1.0"),
    (lambda: learned(start=99.0), DataError, "signal 'y': expected rows with both a measurement and a reference"),
    (lambda: gf.with_sensor_maps(MODEL, []), ConfigError, "maps: expected at least one, got none"),
    (
        lambda: gf.with_sensor_maps(MODEL, [map_of(), map_of()]),
        ConfigError,
        "maps: expected one per signal, got two of 'y'",
    ),
    (
        lambda: SensorMap("y", ("x", "v"), zero_map(1, 1), jnp.asarray(1.0)),
        ConfigError,
        "map of 'y': expected a network of 2 inputs and one output, got 1 and 1",
    ),
]


@pytest.mark.parametrize(("attempt", "kind", "expected"), MISTAKES, ids=[expected[:40] for *_, expected in MISTAKES])
def test_a_mistake_is_told_with_what_was_expected(
    attempt: Callable[[], object], kind: type[GainfulError], expected: str
) -> None:
    with np.errstate(all="ignore"), pytest.raises(kind) as caught:
        attempt()
    assert expected in str(caught.value)
