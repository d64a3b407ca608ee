"""A stream gives what the whole record gives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.errors import CovarianceError, DataError, NumericalError, ShapeError, Status

ROWS = 60


def planar_rate(x, u, t):
    return jnp.array([u[0] * jnp.cos(x[2]), u[0] * jnp.sin(x[2]), u[1]])


def distance(x, u, t):
    return jnp.hypot(x[0] - 20.0, x[1])[None]


def compass(x, u, t):
    return x[2:3]


@pytest.fixture(scope="module")
def model():
    sensors = [
        gf.sensor("range", distance, outputs={"range": "m"}, R=0.04),
        gf.sensor("compass", compass, outputs={"compass": "angle"}, R=0.01),
    ]
    states = {"x": "m", "y": "m", "heading": "angle"}
    return gf.continuous_model(
        planar_rate, states=states, inputs=["speed", "turn"], Q=[1e-3, 1e-3, 1e-4], sensors=sensors
    )


@pytest.fixture(scope="module")
def prior(model):
    return gf.make_prior(model, [0.0, 0.0, 3.0], [1.0, 1.0, 0.3])


@pytest.fixture(scope="module")
def log(model, prior):
    """Uneven steps, missing components and rows, one wild range."""
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.05, 0.4, ROWS))
    u = np.stack([np.ones(ROWS), 0.3 * np.sin(t)], axis=1)
    drawn = gf.draw_log(model, prior, t, u, key=jax.random.key(3))
    y = drawn.y.copy()
    y[rng.random(y.shape) < 0.3] = np.nan
    y[10:14] = np.nan
    y[30, 0] = 500.0
    return gf.make_log(model, t, y, u)


FILTERS = {
    "ekf": gf.extended_kalman_filter(),
    "gated square-root ukf": gf.unscented_kalman_filter(update=gf.Gated(), square_root=True),
}


@pytest.mark.parametrize("name", FILTERS)
def test_pushing_samples_one_by_one_equals_running_the_record(name, model, prior, log):
    whole = gf.run(FILTERS[name], model, prior, log)
    online = gf.OnlineFilter(FILTERS[name], model, prior)
    y = np.where(log.seen, log.y, np.nan)
    estimates = [online.push(log.t[k], y[k], log.u[k]) for k in range(len(log))]
    # The same program over the same numbers; XLA may fuse it differently, a few roundings a row.
    tolerance = 1e-15 * 10 * ROWS
    np.testing.assert_allclose([e.mean for e in estimates], whole.mean, rtol=0, atol=20 * tolerance)
    np.testing.assert_allclose([e.cov for e in estimates], whole.cov, rtol=0, atol=tolerance)
    assert [e.status for e in estimates] == whole.status.tolist()
    np.testing.assert_array_equal([e.weight for e in estimates], whole.weight)


def test_long_steps_are_split_as_in_a_record(model, prior, log):
    y = np.where(log.seen, log.y, np.nan)
    split = gf.run(FILTERS["ekf"], model, prior, gf.make_log(model, log.t, y, log.u, max_step=0.1))
    online = gf.OnlineFilter(FILTERS["ekf"], model, prior, max_step=0.1)
    last = [online.push(log.t[k], y[k], log.u[k]) for k in range(len(log))][-1]
    np.testing.assert_allclose(last.mean, split.mean[-1], rtol=0, atol=1e-12)


def test_signals_may_be_named_and_absent_ones_are_missing(model, prior):
    named, listed = (gf.OnlineFilter(FILTERS["ekf"], model, prior, start=0.0) for _ in range(2))
    first = named.push(0.5, {"compass": 3.1}, [1.0, 0.0])
    second = listed.push(0.5, [np.nan, 3.1], [1.0, 0.0])
    assert first.mean.tolist() == second.mean.tolist()
    assert first.status is Status.ok
    assert first["heading"] == first.mean[2]


def test_nothing_measured_is_a_prediction(model, prior):
    online = gf.OnlineFilter(FILTERS["ekf"], model, prior, start=0.0)
    estimate = online.push(1.0, None, [1.0, 0.0])
    assert estimate.status is Status.missing
    assert estimate["x"] == pytest.approx(np.cos(3.0))
    assert (estimate.std[:2] > 1.0).all()


def test_a_sample_from_the_past_is_refused_and_changes_nothing(model, prior):
    online = gf.OnlineFilter(FILTERS["ekf"], model, prior)
    online.push(1.0, {"range": 20.0}, [1.0, 0.0])
    with pytest.raises(DataError, match=r"t: expected a time not before 1 s, got 0\.5 s"):
        online.push(0.5, {"range": 20.0}, [1.0, 0.0])
    assert online.push(1.0, None, [1.0, 0.0]).t == 1.0


@pytest.mark.parametrize(
    ("y", "u", "error", "message"),
    [
        ([1.0], [1.0, 0.0], ShapeError, r"y: expected shape \(2,\) \(range, compass\), got \(1,\)"),
        ({"rnge": 1.0}, [1.0, 0.0], ShapeError, r"'rnge' is not a signal of the model; did you mean 'range'"),
        ([np.inf, 0.0], [1.0, 0.0], DataError, "expected finite numbers, or NaN for missing"),
        ([1.0, 0.0], None, ShapeError, r"u: expected shape \(2,\) \(speed, turn\), got \(0,\)"),
        ([1.0, 0.0], [np.nan, 0.0], DataError, "u at t = 1 s: expected finite numbers"),
    ],
)
def test_a_sample_of_the_wrong_form_is_named(y, u, error, message, model, prior):
    with pytest.raises(error, match=message):
        gf.OnlineFilter(FILTERS["ekf"], model, prior).push(1.0, y, u)


def test_a_failed_step_raises_and_leaves_the_filter_as_it_was():
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.0, R=0.0, states=["x"], outputs=["y"])
    prior = gf.make_prior(model, [0.0], [1.0])
    online = gf.OnlineFilter(gf.kalman_filter(), model, prior)
    online.push(0.0, [2.0])
    with pytest.raises(NumericalError, match=r"t = 1 s: the innovation covariance is not positive definite"):
        online.push(1.0, [2.0])
    assert online.push(0.5, None)["x"] == pytest.approx(2.0)
    quiet = gf.OnlineFilter(gf.kalman_filter(), model, prior, throw=False)
    quiet.push(0.0, [2.0])
    assert quiet.push(1.0, [3.0]).status is Status.not_positive


def test_warming_up_uses_no_sample(model, prior):
    online = gf.OnlineFilter(FILTERS["ekf"], model, prior)
    online.warm_up()
    fresh = gf.OnlineFilter(FILTERS["ekf"], model, prior)
    assert (online.push(1.0, [20.0, 3.0], [1.0, 0.0]).mean == fresh.push(1.0, [20.0, 3.0], [1.0, 0.0]).mean).all()


def test_a_step_of_no_length_is_refused_as_longest(model, prior):
    with pytest.raises(DataError, match=r"max_step: expected a time above 0 s, got 0"):
        gf.OnlineFilter(FILTERS["ekf"], model, prior, max_step=0)


def test_parts_that_do_not_fit_are_refused_before_the_first_sample(model):
    with pytest.raises(ShapeError, match=r"prior: expected AbstractEstimate, got list; make one with make_prior"):
        gf.OnlineFilter(FILTERS["ekf"], model, [0.0, 0.0, 0.0])
    wrong = gf.continuous_model(
        lambda x, u, t: x, lambda x, u, t: x, states=2, outputs=2, Q=lambda x, u, t: [[1.0, 0.5], [0.0, 1.0]], R=1.0
    )
    with pytest.raises(CovarianceError, match=r"Q at t = 3 s: expected a symmetric matrix"):
        gf.OnlineFilter(FILTERS["ekf"], wrong, gf.make_prior(wrong, [0.0, 0.0], [1.0, 1.0]), start=3.0)


def test_a_prior_of_another_model_is_refused(model):
    other = gf.linear_model([[1.0]], [[1.0]], Q=0.0, R=1.0, states=["z"])
    with pytest.raises(ShapeError, match=r"prior: expected the states x, y, heading, got z"):
        gf.OnlineFilter(FILTERS["ekf"], model, gf.make_prior(other, [0.0], [1.0]))
