"""Networks by Kalman filters, one-step models and the section that asks for them: what is said to what is wrong."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.config import build_network, parse_identify_config
from gainful.errors import ConfigError, DataError, GainfulError, PrecisionError, ShapeError
from gainful.identification import (
    LaggedModel,
    Lags,
    NetworkRecipe,
    OneStepModel,
    Recording,
    fit_one_step,
    identify_network,
)
from gainful.jobs import identify_log
from gainful.networks import ProductFeatures, RadialBasisNetwork, SummedNetwork, make_radial_basis, zero_map
from gainful.regression import DecoupledKalmanTraining, KalmanTraining, WeightFilter, fit_weights

LIFTING = ProductFeatures([1.0, 1.0])
NETWORK = make_radial_basis(LIFTING, 1, 0, tail="affine")
X, U = np.linspace(-1.0, 1.0, 20)[:, None], np.sin(np.arange(20.0))[:, None]
RECORD = Recording(np.arange(20.0), {"y": X[:, 0], "u": U[:, 0]})
SECTION = {"of": "y", "inputs": {"u": 1}}


def section(**changes: object) -> object:
    table = {
        "signals": {"y": "1", "u": "1"},
        "network": SECTION | changes,
        "data": {"file": "a.csv", "signals": {"y": "y", "u": "u"}},
    }
    config = parse_identify_config(table)
    assert config.network is not None
    return build_network(config.network, config.signals)


def in_single_precision() -> object:
    with jax.enable_x64(False):
        return WeightFilter(form="covariance").init(2, 1)


def radial(**changes: object) -> RadialBasisNetwork:
    fields = {"weights": jnp.zeros((3, 1)), "centres": jnp.zeros((3, 3)), "lifting": LIFTING, "width": jnp.ones(())}
    return RadialBasisNetwork(**(fields | changes))


MISTAKES: list[tuple[Callable[[], object], type[GainfulError], str]] = [
    (
        lambda: ProductFeatures([1.0], centre=[0.0, 0.0]),
        ShapeError,
        "centre: expected one number per signal, got shape (2,)",
    ),
    (lambda: ProductFeatures([1.0, 0.0]), ConfigError, "scale: expected numbers above 0, got [1.0, 0.0]"),
    (lambda: ProductFeatures([1.0], gain=-1.0), ConfigError, "gain: expected numbers above 0, got -1.0"),
    (lambda: NETWORK.with_weights(jnp.zeros((2, 1))), ShapeError, "weights: expected shape (3, 1), got (2, 1)"),
    (lambda: radial(centres=jnp.zeros((3, 2))), ShapeError, "centres: expected 3 numbers each, got shape (3, 2)"),
    (lambda: radial(centres=jnp.zeros((0, 3))), ConfigError, "centres: expected at least 1 without a tail, got 0"),
    (lambda: radial(weights=jnp.zeros((2, 1))), ShapeError, "weights: expected 3 rows, got shape (2, 1)"),
    (lambda: radial(kernel="gausian"), ConfigError, "kernel: 'gausian' is not known; did you mean 'gaussian'?"),
    (lambda: radial(width=jnp.zeros(())), ConfigError, "width: expected a number above 0, got 0.0"),
    (lambda: make_radial_basis(LIFTING, 1, -1), ConfigError, "centres: expected a whole number of at least 0, got -1"),
    (lambda: make_radial_basis(LIFTING, 1, 1, placement="boxes"), ConfigError, "placement: 'boxes' is not known"),
    (lambda: make_radial_basis(LIFTING, 1, 1, tail="line"), ConfigError, "tail: 'line' is not known"),
    (
        lambda: make_radial_basis(LIFTING, 1, 3, placement="clusters"),
        DataError,
        "examples: expected at least 3, one per centre, got none",
    ),
    (
        lambda: make_radial_basis(LIFTING, 1, 3, placement="examples", examples=np.zeros((2, 2))),
        DataError,
        "examples: expected at least 3, one per centre, got 2",
    ),
    (
        lambda: SummedNetwork((zero_map(1, 1), zero_map(2, 1))),
        ShapeError,
        "networks: expected some of one size, got (inputs, outputs) of [(1, 1), (2, 1)]",
    ),
    (lambda: WeightFilter(form="root"), ConfigError, "form: 'root' is not known; known: covariance, square_root"),
    (lambda: WeightFilter(forgets="all"), ConfigError, "forgets: 'all' is not known"),
    (lambda: WeightFilter(noise_variance=0.0), ConfigError, "noise_variance: expected a number above 0, got 0.0"),
    (lambda: WeightFilter(forgetting=1.1), ConfigError, "forgetting: expected a number above 0 and at most 1, got 1.1"),
    (lambda: WeightFilter(random_walk=-1.0), ConfigError, "random_walk: expected a number of at least 0, got -1.0"),
    (in_single_precision, PrecisionError, 'form: expected "square_root" with 32-bit numbers, got "covariance"'),
    (
        lambda: fit_weights(X, U[:5]),
        ShapeError,
        "features and targets: expected one row of each per example, got shapes (20, 1) and (5, 1)",
    ),
    (
        lambda: fit_weights(X, np.full((20, 1), np.nan)),
        DataError,
        "features and targets: expected a row of finite numbers, got none in 20",
    ),
    (lambda: KalmanTraining(hidden=(0,)), ConfigError, "hidden: expected whole numbers of at least 1, got (0,)"),
    (lambda: KalmanTraining(random_walk=-1.0), ConfigError, "random_walk: expected a number of at least 0, got -1.0"),
    (
        lambda: DecoupledKalmanTraining(noise_variance=0.0),
        ConfigError,
        "noise_variance: expected a number above 0, got 0.0",
    ),
    (
        lambda: DecoupledKalmanTraining(groups="units"),
        ConfigError,
        "groups: 'units' is not known; did you mean 'unit'?",
    ),
    (
        lambda: OneStepModel(NETWORK, jnp.ones(1), "increments"),
        ConfigError,
        "form: 'increments' is not known; did you mean",
    ),
    (
        lambda: OneStepModel(NETWORK, jnp.ones(2)),
        ShapeError,
        "output_scale: expected 1 numbers, one per output, got shape (2,)",
    ),
    (
        lambda: OneStepModel(zero_map(2, 1), jnp.ones(1)).features(X[0], U[0]),
        ConfigError,
        "network: expected one that is linear in its weights, got a AffineMap",
    ),
    (lambda: fit_one_step(NETWORK, X, U[:3], X), ShapeError, "controls: expected shape (20, 1), got (3, 1)"),
    (
        lambda: fit_one_step(NETWORK, X, U, np.where(X[4] == X, np.inf, X)),
        DataError,
        "following: expected finite numbers, got [inf] in row 4",
    ),
    (
        lambda: fit_one_step(NETWORK, X, U, X, names=["rate"]),
        DataError,
        "following: expected outputs that vary, got a constant for rate",
    ),
    (lambda: Lags("y", 0, {}), ConfigError, "lags: expected a whole number of rows of at least 1, got 0"),
    (lambda: Lags("y", 1, {"u": 0}), ConfigError, "u: expected a whole number of rows of at least 1, got 0"),
    (lambda: Lags("y", 1, {"y": 1}), ConfigError, "inputs: expected signals other than 'y', which has lags of its own"),
    (
        lambda: LaggedModel(zero_map(3, 1), jnp.ones(()), Lags("y", 2, {})),
        ShapeError,
        "network: expected (inputs, outputs) of (2, 1), got (3, 1)",
    ),
    (lambda: NetworkRecipe("rbs"), ConfigError, "kind: 'rbs' is not known; did you mean 'rbf'?"),
    (
        lambda: identify_network(Lags("y", 1, {"v": 1}), RECORD),
        ConfigError,
        "recording: expected all of y, v, got no 'v'",
    ),
    (
        lambda: identify_network(Lags("y", 9, {"u": 9}), RECORD, NetworkRecipe("affine")),
        DataError,
        "rows: expected more whole ones than the 18 numbers that the network is told of each, got 11",
    ),
    (
        lambda: identify_network(
            Lags("y", 1, {"u": 1}), dataclasses.replace(RECORD, values={"y": np.ones(20), "u": U[:, 0]})
        ),
        DataError,
        "y: expected a signal that varies, got a constant in the rows that are whole",
    ),
    (
        lambda: identify_network(
            Lags("y", 100, {}), Recording(np.arange(400.0), {"y": np.sin(np.arange(400.0))}), NetworkRecipe("bilinear")
        ),
        ConfigError,
        "network: expected at most 4000 weights, got 5051: take fewer lags, or no products",
    ),
    (lambda: section(of="z"), ConfigError, "network.of: 'z' is not a signal"),
    (lambda: section(inputs={"uu": 1}), ConfigError, "network.inputs: 'uu' is not a signal; did you mean 'u'?"),
    (lambda: section(lags=0), ConfigError, "network.lags: expected a whole number of rows of at least 1, got 0"),
    (
        lambda: section(forgetting=0.0),
        ConfigError,
        "network.forgetting: expected a number above 0 and at most 1, got 0.0",
    ),
    (lambda: section(kind="rfb"), ConfigError, "network.kind: expected"),
    (
        lambda: section(training="kalman"),
        ConfigError,
        "network.training: expected none for 'rbf', which is found by least squares",
    ),
    (
        lambda: section(kind="mlp", training="kalmann"),
        ConfigError,
        "network.training.kind: 'kalmann' is not known here",
    ),
]


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake[2][:40])
def test_a_mistake_is_answered_with_what_was_expected_and_what_came(
    mistake: tuple[Callable[[], object], type[GainfulError], str],
) -> None:
    do, kind, said = mistake
    with pytest.raises(kind) as caught:
        do()
    assert said in str(caught.value)


NETWORK_TEXT = """
[signals]
y = "1"
u = "1"

[network]
of = "y"
lags = 1
inputs.u = 1

[data]
file = "a.csv"
time = ""
dt = 1.0
signals = { y = "y", u = "u" }
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "[data]",
            '[equation]\nof = "y"\nterms.a = "u"\n[data]',
            "equation or network: expected one of the two sections, got both",
        ),
        (
            '[network]\nof = "y"\nlags = 1\ninputs.u = 1\n',
            "",
            "equation or network: expected one of the two sections, got neither",
        ),
        (
            "\n[signals]",
            'method = "ls"\n[signals]',
            "method: expected none beside a network, whose kind says it, got 'ls'",
        ),
        (', u = "u" }', " }", "data.signals: the network's 'u' has no column"),
        ('u = "u" }', 'u = "force" }', "'force'"),
        ("lags = 1", "lag = 1", "network.lag: unknown key; did you mean 'lags'?"),
        (
            "lags = 1",
            "lags = 12",
            "rows: expected more whole ones than the 13 numbers that the network is told of each, got 2",
        ),
    ],
)
def test_a_wrong_network_section_is_answered_in_its_words(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in NETWORK_TEXT
    (tmp_path / "net.toml").write_text(NETWORK_TEXT.replace(old, new))
    rows = "\n".join(f"{np.sin(k)},{np.cos(k)}" for k in range(20))
    (tmp_path / "a.csv").write_text(f"y,u\n{rows}\n")
    with pytest.raises(GainfulError) as caught:
        identify_log(tmp_path / "net.toml")
    assert said in str(caught.value)
