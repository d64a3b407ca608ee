"""Every message of the library: the argument, what was expected, what came."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import chi_square_bounds, ljung_box, step_cost, step_seconds, weighing, whiteness_tests
from gainful.errors import (
    ConfigError,
    CovarianceError,
    DataError,
    GainfulError,
    MissingExtraError,
    ModelError,
    NumericalError,
    ShapeError,
    did_you_mean,
)
from gainful.linalg import check_covariance
from gainful.plants import constant_velocity
from gainful.spaces import Interval, make_space

from .problems import ESTIMATORS, run_breakable, stay, walk


def steps(f=stay, h=stay, **changes):
    given = {"states": ["x"], "outputs": ["y"], "Q": 0.1, "R": 1.0} | changes
    return gf.discrete_model(f, h, **given)


def scaled(x, u, t, p):
    return p["a"] * x


def with_parameter(value=1.0):
    return steps(f=scaled, parameters={"a": value})


def matrix(shape):
    def noise(x, u, t):
        return jnp.eye(*shape)

    return noise


def near(name, **changes):
    return gf.sensor(name, stay, **{"R": 1.0} | changes)


def run(model=None, prior=None, log=None, estimator=None):
    model = walk() if model is None else model
    return gf.run(
        ESTIMATORS["ekf"] if estimator is None else estimator,
        model,
        gf.make_prior(model, [1.0], [1.0]) if prior is None else prior,
        gf.make_log(model, [0.0, 1.0], [1.0, 1.0]) if log is None else log,
    )


class Unhashable:
    __hash__ = None

    def __call__(self, x, u, t):
        return x


def log_of(**changes):
    given = {
        "t": np.arange(2.0),
        "dt": np.ones(2),
        "u": np.zeros((2, 0)),
        "y": np.ones((2, 1)),
        "seen": np.ones((2, 1), bool),
    }
    return gf.Log(**given | changes)


def prior(mean, std=None, model=None, **given):
    return gf.make_prior(walk() if model is None else model, mean, std, **given)


def attitude():
    return gf.discrete_model(stay, stay, states={"q": "quaternion"}, outputs={"z": "quaternion"}, Q=0.1, R=1.0)


def bounded(bounds):
    return steps(states={"x": bounds})


MODELS = [
    (
        lambda: make_space("x"),
        ModelError,
        "signals: expected a list of names or a mapping from name to unit, got the text 'x'",
    ),
    (lambda: make_space([]), ModelError, "signals: expected at least one name, each once, got []"),
    (lambda: make_space(["x", "x"]), ModelError, "signals: expected at least one name, each once, got ['x', 'x']"),
    (
        lambda: make_space({"x": (1.0, None)}),
        ModelError,
        "bounds of 'x': expected (0, None), (None, None) or two finite",
    ),
    (lambda: Interval("x", 1.0, 0.0), ModelError, "bounds of 'x': expected lower < upper, got 1.0 and 0.0"),
    (lambda: constant_velocity(axes=5), ModelError, "axes: expected 1, 2 or 3, got 5"),
    (
        lambda: constant_velocity(acceleration_density=-1.0),
        ModelError,
        "acceleration_density: expected at least 0, got -1.0",
    ),
    (
        lambda: gf.draw_log(walk(), prior([1.0], [1.0]), [0.0, 1.0], np.ones((2, 3)), key=None),
        ShapeError,
        "u: expected shape (2, 0), got (2, 3)",
    ),
    (lambda: steps(f=3), ModelError, "f: expected a function of (x, u, t), got 3"),
    (
        lambda: steps(h=lambda x, u, t, dtt: x),
        ModelError,
        "expected a function of x, u and t, then optionally dt and p",
    ),
    (
        lambda: steps(h=lambda x, u, t, dtt: x),
        ModelError,
        "got the arguments ['x', 'u', 't', 'dtt'] ('dtt': did you mean 'dt'?)",
    ),
    (
        lambda: steps(f=lambda: 0),
        ModelError,
        "f: expected a function of x, u and t, then optionally dt and p by name; got",
    ),
    (lambda: steps(Q="a"), ModelError, "Q: expected numbers or a function, got 'a'"),
    (lambda: steps(R=None), ModelError, "R: missing; a model needs h, outputs and R, or sensors"),
    (lambda: steps(sensors=[near("a")]), ModelError, "sensors: give either h, outputs and R, or sensors, not both"),
    (
        lambda: steps(h=None, outputs=None, R=None, sensors=[]),
        ModelError,
        "sensors: expected at least one, got an empty list",
    ),
    (
        lambda: steps(h=None, outputs=None, R=None, sensors=[near("a"), near("a")]),
        ModelError,
        "sensors: expected distinct sensor names, got 'a' twice",
    ),
    (
        lambda: steps(h=None, outputs=None, R=None, sensors=[near("a"), near("b", outputs=["a"])]),
        ModelError,
        "sensors: expected distinct signal names, got 'a' twice",
    ),
    (lambda: steps(parameters={"a": "b"}), ModelError, "parameter 'a': expected a number, got 'b'"),
    (lambda: steps(parameters={"x": 1.0}), ModelError, "parameters: 'x' is already the name of a state or an output"),
    (lambda: steps(Q=np.ones((2, 3))), ShapeError, "Q: expected a square matrix, got shape (2, 3)"),
    (lambda: steps(Q=np.eye(2)), ShapeError, "Q: expected shape (1, 1), got (2, 2)"),
    (
        lambda: gf.continuous_model(stay, stay, states=1, outputs=1, Q=1.0, R=1.0, substeps=0),
        ModelError,
        "substeps: expected a whole number of at least 1, got 0",
    ),
    (lambda: walk(F=np.eye(2)), ShapeError, "F: expected shape (1, 1), got (2, 2)"),
    (lambda: walk(B=matrix((1, 1))), ModelError, "inputs: missing; it cannot be read off a function B or D"),
    (lambda: walk(F=matrix((1, 1)), states=None), ModelError, "states: missing; it cannot be read off a function F"),
    (lambda: run(steps(Q=matrix((2, 2)))), ModelError, "Q: expected shape (1, 1), got (2, 2)"),
    (
        lambda: run(steps(G=matrix((2, 1)))),
        ModelError,
        "G: expected 1 rows, one per degree of freedom of the state, got shape (2, 1)",
    ),
    (lambda: run(steps(f=lambda x, u, t: 1j * x)), ModelError, "f: expected real numbers, got complex ones"),
    (lambda: run(steps(R=matrix((2, 2)))), ModelError, "R: expected shape (1, 1), got (2, 2)"),
    (
        lambda: run(
            steps(h=None, outputs=None, R=None, sensors=[near("a", R=matrix((2, 2))), near("b")]),
            log=log_of(y=np.ones((2, 2)), seen=np.ones((2, 2), bool)),
        ),
        ModelError,
        "R of sensor 'a': expected shape (1, 1), got (2, 2)",
    ),
    (lambda: gf.augment(walk()), ModelError, "augment: expected at least one parameter or bias, got none"),
    (
        lambda: gf.augment(walk(), biases={"y": -1.0}),
        ModelError,
        "walk of 'y': expected a number of at least 0, got -1.0",
    ),
    (
        lambda: gf.augment(walk(), parameters={"b": 0.0}),
        ModelError,
        "parameter 'b' is not one of the model's; none is known here",
    ),
    (
        lambda: gf.augment(walk(), biases={"yy": 0.0}),
        ModelError,
        "bias: signal 'yy' is not one of the model's; did you mean 'y'?",
    ),
    (
        lambda: gf.augment(with_parameter(), parameters={"a": 0.0}, bounds={"aa": (0, None)}),
        ModelError,
        "bounds: parameter 'aa' is not one of the model's; did you mean 'a'?",
    ),
    (
        lambda: gf.augment(with_parameter([1.0, 2.0]), parameters={"a": 0.0}),
        ModelError,
        "parameter 'a': expected a single number, got shape (2,)",
    ),
    (
        lambda: gf.augment(gf.augment(walk(), biases={"y": 0.0}), biases={"y": 0.0}),
        ModelError,
        "augment: 'bias_y' is already a state of the model",
    ),
    (
        lambda: check_covariance(np.array([[1.0, np.nan], [np.nan, 1.0]]), "R", ["a", "b"]),
        CovarianceError,
        "R: expected finite numbers, got nan for 'a', 'b'",
    ),
]

PARTS = [
    (lambda: gf.Unscented(alpha=0.0), ConfigError, "alpha: expected a number above 0, got 0.0"),
    (lambda: gf.Unscented(kappa=-2.0).points(2), ConfigError, "kappa: expected more than -2 for 2 states, got -2.0"),
    (lambda: gf.GaussHermite(order=1), ConfigError, "order: expected a whole number of at least 2, got 1"),
    (lambda: gf.GaussHermite(order=10).points(5), ConfigError, "order: 10 points in each of 5 directions make 100000"),
    (lambda: gf.Iterated(iterations=0), ConfigError, "iterations: expected a whole number of at least 1, got 0"),
    (lambda: gf.Gated(probability=0.0), ConfigError, "probability: expected a number above 0 and at most 1, got 0.0"),
    (lambda: gf.Gated(reacquire=1.5), ConfigError, "reacquire: expected a whole number of at least 0, got 1.5"),
]

RUNS = [
    (lambda: gf.make_log(walk(), [[0.0]], [1.0]), ShapeError, "t: expected one dimension, got shape (1, 1)"),
    (
        lambda: gf.make_log(walk(), [0.0], [1.0], start=1.0),
        DataError,
        "start: expected a time not after the first row's 0 s, got 1 s",
    ),
    (
        lambda: gf.make_log(walk(), [0.0], [1.0], truth={"xx": [1]}),
        DataError,
        "truth: 'xx' is not a state of the model; did you mean 'x'?",
    ),
    (lambda: gf.make_log(walk(), [0.0], [1.0], truth={"x": [1, 2]}), ShapeError, "truth 'x': expected 1 rows, got 2"),
    (
        lambda: gf.make_log(walk(), [0.0], [[1.0], [1.0, 2.0]]),
        DataError,
        "y: expected numbers, got rows of different lengths",
    ),
    (lambda: gf.make_log(walk(), 3, object()), ShapeError, "t: expected one dimension, got shape ()"),
    (lambda: gf.make_log(walk(), [0.0], object()), DataError, "y: expected numbers, got <object"),
    (
        lambda: gf.make_log(walk(B=[[1.0]], inputs=["u"]), [0.0, 1.0], [1.0, 1.0], [1.0, np.nan]),
        DataError,
        "input 'u': expected finite numbers, got nan in row 1 at t = 1 s (1 such rows)",
    ),
    (
        lambda: gf.make_log(walk(B=[[1.0]], inputs=["u"]), [0.0], [1.0]),
        ShapeError,
        "u: expected shape (1, 1) (u), got (1, 0)",
    ),
    (lambda: prior(["a"], [1.0]), ShapeError, "prior mean: expected numbers, got ['a']"),
    (lambda: prior({"x": "a"}, [1.0]), ShapeError, "prior mean of 'x': expected numbers, got 'a'"),
    (lambda: prior([1.0], cov="a"), ShapeError, "prior cov: expected numbers, got 'a'"),
    (lambda: prior({"x": [1, 2]}, [1.0]), ShapeError, "prior mean of 'x': expected 1 number, got [1, 2]"),
    (lambda: prior({"q": 1.0}, [1.0], attitude()), ShapeError, "prior mean of 'q': expected 4 numbers, got 1.0"),
    (lambda: prior({"q_x": 1.0}, [1.0], attitude()), ShapeError, "prior mean: 'q_x' is not a state of the model; "),
    (lambda: prior([np.nan], [1.0]), ShapeError, "prior mean of 'x': expected a finite number, got nan"),
    (lambda: prior([1.0], [1.0, 2.0]), ShapeError, "prior std: expected shape (1,) (x), got (2,)"),
    (
        lambda: prior({"q": [0, 0, 0, 1]}, {"q": [1, 2]}, attitude()),
        ShapeError,
        "prior std of 'q': expected 1 or 3 numbers, got [1, 2]",
    ),
    (
        lambda: prior({"q": [0, 0, 0, 2]}, [1, 1, 1], attitude()),
        ShapeError,
        "prior mean of 'q_x': expected a unit quaternion, got 0",
    ),
    (
        lambda: prior([0.0], [1.0], bounded((0, None))),
        ShapeError,
        "prior mean of 'x': expected a number above 0, got 0",
    ),
    (
        lambda: prior([5.0], [1.0], bounded((0, 2))),
        ShapeError,
        "prior mean of 'x': expected a number between 0 and 2, got 5",
    ),
    (lambda: prior([1.0]), CovarianceError, "prior: expected either std or cov, got neither"),
    (lambda: run(estimator="ekf"), ShapeError, "estimator: expected AbstractEstimator, got str"),
    (lambda: run(prior=[1.0]), ShapeError, "prior: expected AbstractEstimate, got list; make one with make_prior"),
    (lambda: run(log=[1.0]), ShapeError, "data: expected Log, got list; make one with make_log"),
    (lambda: gf.run(ESTIMATORS["ekf"], stay, None, None), ShapeError, "model: expected AbstractModel, got function"),
    (lambda: run(log=log_of(y=np.ones((2, 2)))), ShapeError, "data.y: expected shape (2, 1), got (2, 2)"),
    (lambda: run(log=log_of(u=np.ones((2, 1)))), ShapeError, "data.u: expected shape (2, 0), got (2, 1)"),
    (
        lambda: run(prior=gf.Gaussian(jnp.array([jnp.nan]), jnp.eye(1), walk().space)),
        ShapeError,
        "prior mean of 'x': expected a finite number, got nan",
    ),
    (lambda: run(steps(f=Unhashable())), ModelError, "model: expected functions that can be hashed, got a Unhashable"),
    (
        lambda: gf.draw_log(walk(), prior([1.0], [1.0]), [[0.0]], key=None),
        ModelError,
        "t: expected a vector of times, got shape (1, 1)",
    ),
]

JUDGEMENTS = [
    (lambda: chi_square_bounds(0, 1), ConfigError, "degrees and runs: expected numbers above 0, got 0 and 1"),
    (lambda: chi_square_bounds(1, 1, level=1.0), ConfigError, "level: expected a probability between 0 and 1, got 1.0"),
    (lambda: ljung_box(np.ones(3), 3), ConfigError, "lags: expected 1 to 2 for 3 values, got 3"),
    (lambda: whiteness_tests(run_breakable(), lags=0), ConfigError, "lags: expected at least 1, got 0"),
    (
        lambda: gf.observability(run_breakable(), window=(7.0, 9.0)),
        ConfigError,
        "window: expected times within 0 to 5 s, got (7.0, 9.0)",
    ),
    (
        lambda: step_cost(gf.kalman_filter(), walk(), prior([0.0], [1.0]), None),
        ShapeError,
        "data: expected Log, got NoneType",
    ),
    (lambda: weighing(run_breakable(), window=0), ConfigError, "window: expected a whole number of at least 1, got 0"),
    (lambda: weighing(run_breakable(), most=1.0), ConfigError, "most: expected a share between 0 and 1, got 1.0"),
    (lambda: step_seconds({}, repeats=0), ConfigError, "repeats: expected a whole number of at least 1, got 0"),
]


@pytest.mark.parametrize(("attempt", "error", "message"), [*MODELS, *PARTS, *RUNS, *JUDGEMENTS])
def test_a_message_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)


def test_every_error_can_be_caught_as_the_library_or_as_python_has_it():
    for error, usual in (
        (ConfigError, ValueError),
        (ModelError, ValueError),
        (ShapeError, ValueError),
        (CovarianceError, ValueError),
        (DataError, ValueError),
        (gf.errors.UnitError, DataError),
        (NumericalError, ArithmeticError),
        (gf.errors.PrecisionError, ArithmeticError),
        (MissingExtraError, ImportError),
    ):
        assert issubclass(error, GainfulError)
        assert issubclass(error, usual)


def test_a_hint_is_the_nearest_name_or_all_of_them():
    assert did_you_mean("angel", ["angle", "rate"]) == "did you mean 'angle'?"
    assert did_you_mean("zzz", ["rate", "angle"]) == "known: angle, rate"
    assert did_you_mean("zzz", []) == "none is known here"


def test_a_state_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(KeyError, match="'z' is not a state; states: x"):
        run_breakable()["z"]


def test_only_the_result_of_a_filter_can_be_smoothed_and_only_once():
    result = run_breakable()
    with pytest.raises(ModelError, match="smooth: the result is smoothed already"):
        gf.smooth(dataclasses.replace(result, filtered=result))
    with pytest.raises(ModelError, match="smooth: expected the result of a Kalman filter, got one of str"):
        gf.smooth(dataclasses.replace(result, estimator="by hand"))


def test_a_lag_of_the_smoother_is_not_negative():
    with pytest.raises(ConfigError, match=r"lag: expected seconds of at least 0, got -1.0"):
        gf.smooth(run_breakable(), lag=-1.0)


def test_only_the_reports_of_a_filter_can_be_smoothed_with_a_lag():
    result = run_breakable()
    samples = gf.samples_of(result.log, float)
    bank = gf.InteractingMultipleModel()
    _, info = gf.scan(bank, result.model, result.prior, samples)
    with pytest.raises(ModelError, match="fixed_lag: expected a Kalman filter, got a InteractingMultipleModel"):
        gf.running.fixed_lag(bank, result.model, samples, info, 1.0)


def test_a_record_along_which_the_model_diverges_cannot_be_judged_for_observability():
    result = run_breakable(growth=1e70)
    with pytest.raises(NumericalError, match="the observability Gramian is not finite: the model diverges"):
        gf.observability(result)
