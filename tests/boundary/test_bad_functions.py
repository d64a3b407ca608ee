"""What a model's functions do wrong is told with row, time, state, line and a cure."""

import re

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.errors import (
    ModelError,
    NumericalError,
    ShapeError,
)

from .problems import ESTIMATORS, ROWS, breakable, estimate, run_breakable, stay, with_one

# What breaks on the way: row, time, cause and state are named.
ON_THE_WAY = {
    "f": (
        {"f": 3.0},
        "row 3 at t = 3 s: the predicted or updated estimate is not finite",
        "f returned nan in 'x' from",
    ),
    "h": ({"h": 3.0}, "row 3 at t = 3 s: the predicted or updated estimate is not finite", "h returned nan in 'y' at"),
    "Q": ({"Q": 3.0, "new_Q": np.nan}, "row 3 at t = 3 s", "Q is not finite at the state x = 1"),
    "R": ({"R": 3.0, "new_R": np.nan}, "row 3 at t = 3 s", "R is not finite at the state x = 1"),
    "growth": ({"growth": 1e200}, "row 1 at t = 1 s", "the covariance overflowed near the state x = 1"),
    "kink": ({"kink": 1.0, "mean": 2.0}, "row 0 at t = 0 s", "the derivative of h is not finite at the state x = 2"),
    "Q below 0 along the way": (
        {"edge_Q": 1.5, "new_Q": -50.0, "y": [1, 1, 9, 9, 9, 9]},
        "the innovation covariance is not positive definite",
        "Q: expected variances of at least 0, got -50 for 'x'",
    ),
    "R below 0 along the way": (
        {"edge_R": 1.5, "new_R": -50.0, "y": [1, 1, 9, 9, 9, 9]},
        "the innovation covariance is not positive definite",
        "R: expected variances of at least 0, got -50 for 'y'",
    ),
    "R a little below 0 along the way": (
        {"edge_R": 1.5, "new_R": -0.01, "y": [1, 1, 9, 9, 9, 9]},
        "row 3 at t = 3 s: the variance of 'x' came out as -0.01",
        "check that Q and R are covariances at all times",
    ),
}


@pytest.mark.parametrize("case", ON_THE_WAY)
def test_what_breaks_on_the_way_is_told_with_row_time_and_state(case):
    changes, where, why = ON_THE_WAY[case]
    with pytest.raises(NumericalError) as caught:
        run_breakable(**changes)
    assert where in str(caught.value)
    assert why in str(caught.value)


def test_a_function_without_a_value_at_a_sigma_point_is_told():
    with pytest.raises(NumericalError, match=r"row 0 at t = 0 s.*within a sigma or so of the state x = 1"):
        run_breakable("ukf", wall=1.5)


def test_without_throw_the_last_good_estimate_is_kept_and_its_status_says_so():
    result = estimate("ekf", y=with_one(np.nan), throw=False)
    assert result.counts() == {"ok": ROWS - 1, "missing": 1}
    model = breakable(f=3.0)
    log = gf.make_log(model, np.arange(6.0), np.ones(6))
    broken = gf.run(ESTIMATORS["ekf"], model, gf.make_prior(model, [1.0], [1.0]), log, throw=False)
    assert broken.counts() == {"ok": 3, "nonfinite": 3}
    np.testing.assert_array_equal(broken.mean[3:], np.repeat(broken.mean[2:3], 3, axis=0))
    assert gf.verdict(broken).consistent is False


def python_sine(x, u, t):
    return np.sin(x)


def python_float(x, u, t):
    return jnp.array([float(x[0])])


def python_if(x, u, t):
    return x if x[0] > 0 else -x


def no_return(x, u, t):
    jnp.sin(x)


def no_such_name(x, u, t):
    return y


MISTAKES = {
    "numpy in place of jax.numpy": (python_sine, "it needs jax.numpy in place of numpy"),
    "float of a traced number": (python_float, "it needs jax.numpy in place of float()"),
    "a branch": (python_if, "it needs jnp.where in place of if"),
    "an unknown name": (no_such_name, "NameError: name 'y' is not defined"),
}


@pytest.mark.parametrize("role", ["f", "h"])
@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_in_a_function_is_told_with_its_line_and_a_cure(case, role):
    fn, cure = MISTAKES[case]
    model = gf.discrete_model(**{"f": stay, "h": stay} | {role: fn}, states=["x"], outputs=["y"], Q=0.1, R=1.0)
    log = gf.make_log(model, [0.0, 1.0], [1.0, 1.0])
    with pytest.raises(ModelError) as caught:
        gf.run(ESTIMATORS["ekf"], model, gf.make_prior(model, [1.0], [1.0]), log)
    line = fn.__code__.co_firstlineno + 1
    assert str(caught.value).startswith(f"{role}: failed at test_bad_functions.py line {line}: {cure}")


def test_a_function_that_forgets_to_return_is_told():
    model = gf.discrete_model(no_return, stay, states=["x"], outputs=["y"], Q=0.1, R=1.0)
    log = gf.make_log(model, [0.0, 1.0], [1.0, 1.0])
    with pytest.raises(ModelError, match=re.escape("f: expected 1 number") + ".*got None"):
        gf.run(ESTIMATORS["ekf"], model, gf.make_prior(model, [1.0], [1.0]), log)


def test_a_table_with_named_columns_is_taken_by_name_not_by_place():
    pandas = pytest.importorskip("pandas")
    model = gf.linear_model(np.eye(2), np.eye(2), Q=0.1, R=1.0, states=["a", "b"], outputs=["left", "right"])
    table = pandas.DataFrame({"right": [2.0, 2.0], "left": [1.0, 1.0]})
    np.testing.assert_array_equal(gf.make_log(model, [0.0, 1.0], table).y, [[1.0, 2.0], [1.0, 2.0]])


def test_a_prior_in_other_coordinates_of_the_same_names_is_refused():
    base = gf.discrete_model(scaled, stay, states=["x"], outputs=["y"], Q=0.1, R=1.0, parameters={"a": 1.0})
    free, bounded = (gf.augment(base, parameters={"a": 0.0}, bounds=b) for b in ({}, {"a": (0, None)}))
    log = gf.make_log(bounded, [0.0, 1.0], [1.0, 1.0])
    prior = gf.make_prior(free, [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(ShapeError, match=re.escape("prior: expected the states x, log(a), got x, a")):
        gf.run(ESTIMATORS["ekf"], bounded, prior, log)


def scaled(x, u, t, p):
    return p["a"] * x
