"""Messages of noise laws, of fitting the noise and of diagnosing it: the argument, what was expected, what came."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.config import parse_config
from gainful.config.build import build_filter
from gainful.diagnostics import innovation_lag_bound, stationary_mistuned_error
from gainful.errors import ConfigError, NumericalError, ShapeError
from gainful.jobs import tune
from gainful.noise import with_scaled_noise

from .problems import breakable, walk

LAWS = [
    (lambda: gf.SageHusa(memory=0.0), "memory: expected a number above 0 and at most 1, got 0.0"),
    (lambda: gf.SageHusa(floor=2.0), "floor: expected a factor above 0 and at most 1, got 2.0"),
    (lambda: gf.SageHusa(ceiling=0.5), "ceiling: expected a factor of at least 1, got 0.5"),
    (lambda: gf.SageHusa(patience=0), "patience: expected a whole number of at least 1, got 0"),
    (lambda: gf.InnovationMatching(window=0), "window: expected a whole number of at least 1, got 0"),
    (lambda: gf.InnovationMatching(settle=-1), "settle: expected a whole number of at least 0, got -1"),
    (lambda: gf.InnovationMatching(ceiling=float("nan")), "ceiling: expected a factor of at least 1, got nan"),
    (lambda: gf.VariationalNoise(start=0.0), "start: expected a number above 0, got 0.0"),
    (lambda: gf.VariationalNoise(iterations=0), "iterations: expected a whole number of at least 1, got 0"),
    (lambda: gf.VariationalCovariances(prediction=0.0), "prediction: expected a number above 0, got 0.0"),
    (lambda: gf.VariationalCovariances(memory=1.5), "memory: expected a number above 0 and at most 1, got 1.5"),
    (
        lambda: with_scaled_noise(gf.RecursiveLeastSquares(), {}, {}),
        "estimator: expected one with a noise law to scale, got a RecursiveLeastSquares",
    ),
]

TIMES = np.arange(40.0)
Y = np.random.default_rng(1).normal(size=40)
KF = gf.kalman_filter()


def fit(model=None, estimator=KF, prior=None, log=None, **options):
    model = walk() if model is None else model
    prior = gf.make_prior(model, [0.0] * model.space.size, [1.0] * model.space.dof) if prior is None else prior
    return gf.fit_noise(estimator, model, prior, gf.make_log(model, TIMES, Y) if log is None else log, **options)


def moments(model=None, t=TIMES, y=Y, **options):
    model = walk() if model is None else model
    return fit(model, log=gf.make_log(model, t, y), method="moments", **options)


def attitude():
    return gf.continuous_model(
        lambda x, u, t: jnp.zeros(3), lambda x, u, t: x[:1], states={"q": "quaternion"}, outputs=1, Q=[1.0] * 3, R=1.0
    )


def decay():
    return gf.continuous_model(lambda x: -x, lambda x: x, states=1, outputs=1, Q=0.1, R=1.0)


def bent(x, u, t):
    return x + 0.1 * x**2


BANK = gf.InteractingMultipleModel((KF, KF), ((0.9, 0.1), (0.1, 0.9)))
GAPS = np.where(TIMES == 7, np.nan, Y)

FITS = [
    (lambda: fit(method="mle"), "method: 'mle' is not known; did you mean 'ml'?"),
    (lambda: fit(floor=0.0), "floor: expected a factor above 0 and at most 1, got 0.0"),
    (lambda: fit(ceiling=np.inf), "ceiling: expected a finite factor of at least 1, got inf"),
    (lambda: fit(iterations=0), "iterations: expected a whole number of at least 1, got 0"),
    (lambda: fit(contamination=1.0), "contamination: expected a share from 0 to below 1, got 1.0"),
    (lambda: fit(process=("xx",)), "process: 'xx' is not one of the model's; did you mean 'x'?"),
    (lambda: fit(measurement=("y", "y")), "measurement: expected each name once, got 'y' twice"),
    (
        lambda: fit(walk(Q=0.0), process=("x",)),
        "process: the model has no noise for 'x', and a factor on none changes nothing",
    ),
    (lambda: fit(process=(), measurement=()), "process, measurement: expected at least one entry to fit, got none"),
    (lambda: fit(log=[]), "logs: expected at least one record, got none"),
    (lambda: fit(skip=-1), "skip: expected a whole number of at least 0, got -1"),
    (lambda: fit(held_out=1.0), "held_out: expected a share from 0 to below 1, or records, got 1.0"),
    (
        lambda: fit(prior=[gf.make_prior(walk(), [0.0], [1.0])] * 2),
        "prior: expected one, or one for each of 1 records, got 2",
    ),
    (lambda: fit(skip=35, held_out=0.0), "logs: expected at least 10 measured rows to fit, got 5"),
    (lambda: fit(method="truth"), 'method: "truth" needs records with truth, got none'),
    (
        lambda: fit(estimator=BANK, method="em"),
        'method: "em" smooths, and needs a single filter, got a InteractingMultipleModel',
    ),
    (
        lambda: fit(attitude(), prior=gf.make_prior(attitude(), [0, 0, 0, 1], [1] * 3), method="moments"),
        "got one with quaternions",
    ),
    (lambda: moments(decay(), t=TIMES**1.1), 'method: "moments" needs equal steps, got some that vary; use "ml"'),
    (lambda: moments(y=GAPS), 'method: "moments" needs a record without missing readings; use "ml"'),
    (
        lambda: moments(gf.discrete_model(bent, lambda x: x, states=1, outputs=1, Q=0.1, R=1.0)),
        'method: "moments" needs a linear model with constant matrices, got slopes that vary; use "ml"',
    ),
    (lambda: moments(walk(Q=0.0)), 'method: "moments" needs a gain that becomes stationary; use "ml"'),
    (
        lambda: moments(gf.linear_model([[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0]], Q=[0.1, 0.0], R=1.0)),
        'method: "moments" needs a filter that forgets its start, got one with a slowest mode of 1 per step; use "ml"',
    ),
    (lambda: moments(walk(Q=1e-3), held_out=0.0), 'method: "moments" needs more than '),
]

JUDGEMENTS = [
    (
        lambda: innovation_lag_bound([[1.0]], [[1.0]], [[0.5]], [[1.0]], [[1.0]], 0),
        ConfigError,
        "lags: expected a whole number",
    ),
    (
        lambda: stationary_mistuned_error([[1.0]], [[1.0]], [[0.0]], [[1.0]], [[1.0]]),
        ConfigError,
        "K: expected a gain that makes a stable filter, got one with a mode of 1 per step",
    ),
    (
        lambda: stationary_mistuned_error([[1.0]], [[1.0, 0.0]], [[0.5]], [[1.0]], [[1.0]]),
        ShapeError,
        "H: expected shape (1, 1), got (1, 2)",
    ),
]


@pytest.mark.parametrize(("attempt", "message"), [*LAWS, *FITS])
def test_a_law_or_a_fit_names_the_argument_what_was_expected_and_what_came(attempt, message):
    with pytest.raises(ConfigError) as caught:
        attempt()
    assert message in str(caught.value)


@pytest.mark.parametrize(("attempt", "error", "message"), JUDGEMENTS)
def test_a_diagnosis_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)


def test_a_filter_that_fails_before_it_is_fitted_says_where_and_why():
    model = breakable(f=5.0)
    with pytest.raises(NumericalError, match=r"row 5 at t = 5 s: .* f returned nan in 'x'"):
        fit(model, log=gf.make_log(model, np.arange(20.0), np.ones(20)))


def test_a_likelihood_without_a_derivative_says_so():
    model = breakable(kink=0.1)
    log, prior = gf.make_log(model, np.arange(20.0), np.ones(20), start=-1.0), gf.make_prior(model, [2.0], [1.0])
    with pytest.raises(NumericalError, match="fit_noise: the likelihood has no derivative in the noise"):
        fit(model, gf.unscented_kalman_filter(), prior, log)


CONFIG = {
    "model": {"catalogue": "planar_vehicle"},
    "data": {"file": "a.csv", "time": "t", "outputs": {"y": "y"}},
    "prior": {"mean": [0.0]},
}
CONFIGURED = [
    (
        {"noise": "sage_husa", "filter": {"kind": "assembled", "noise": "nominal"}},
        "noise: expected it here or in filter.noise, got it in both",
    ),
    ({"noise": "sage_huse"}, "noise.kind: 'sage_huse' is not known here; did you mean 'sage_husa'?"),
    (
        {"noise": {"kind": "scaled", "states": {"x": 2.0}}, "filter": "rls"},
        "noise: expected one with a noise law to scale, got a RecursiveLeastSquares",
    ),
    (
        {"noise": "sage_husa", "filter": "imm"},
        "noise: expected a single filter to have it, got a InteractingMultipleModel",
    ),
]


@pytest.mark.parametrize(("changes", "message"), CONFIGURED)
def test_the_noise_of_a_configuration_names_the_key_what_was_expected_and_what_came(changes, message):
    with pytest.raises(ConfigError) as caught:
        build_filter(parse_config(CONFIG | changes), walk())
    assert message in str(caught.value)


def test_scaled_noise_of_a_configuration_goes_beneath_the_filters_own():
    table = {"kind": "assembled", "noise": {"kind": "sage_husa", "memory": 0.9}}
    chosen = build_filter(
        parse_config(CONFIG | {"filter": table, "noise": {"kind": "scaled", "outputs": {"y": 2.0}}}), walk()
    )
    assert chosen.noise == gf.SageHusa(memory=0.9, inner=gf.Scaled({}, {"y": 2.0}))
    replaced = build_filter(parse_config(CONFIG | {"noise": {"kind": "sage_husa", "memory": 0.9}}), walk())
    assert dataclasses.replace(replaced, noise=gf.Nominal()) == gf.extended_kalman_filter()
    assert replaced.noise == gf.SageHusa(memory=0.9)


TUNE = """
filter = "kf"
[model]
file = "plant.py"
[data]
file = "log.csv"
outputs.y = "y"
outputs.x = "x"
[prior]
mean = [0.0]
std = [1.0]
"""
TUNED = [
    ({"only": ["x"], "freeze": ["y"]}, "only, freeze: expected one of them, got both"),
    ({"only": ["Q.x,R.y"]}, "only: expected names of states or of outputs, got both in 'Q.x,R.y'"),
    ({"freeze": ["x"]}, "'x' is a state and an output; write Q.x or R.x"),
    ({"only": ["z"]}, "'z' is no state or output of the model; known: x, x, y"),
]


@pytest.mark.parametrize(("options", "message"), TUNED)
def test_tuning_names_the_option_what_was_expected_and_what_came(tmp_path, options, message):
    (tmp_path / "plant.py").write_text(
        "import gainful as gf\n\ndef model():\n"
        "    return gf.linear_model([[1.0]], [[1.0], [1.0]], Q=0.1, R=[1.0, 1.0], states=['x'], outputs=['y', 'x'])\n"
    )
    (tmp_path / "log.csv").write_text("t,y,x\n" + "".join(f"{k},{y},{y}\n" for k, y in enumerate(Y)))
    (tmp_path / "estimate.toml").write_text(TUNE)
    with pytest.raises(ConfigError) as caught:
        tune(tmp_path / "estimate.toml", **options)
    assert message in str(caught.value)
