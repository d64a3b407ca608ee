"""Bad input ends in the right answer or in an error that says what is wrong; never in a silent wrong number."""

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.errors import (
    CovarianceError,
    DataError,
    GainfulError,
    ModelError,
    NumericalError,
    PrecisionError,
    ShapeError,
    Status,
)

from .problems import (
    ESTIMATORS,
    MEAN,
    REFERENCES,
    ROWS,
    STD,
    STEP,
    estimate,
    pendulum,
    run_breakable,
    swung,
    walk,
    with_one,
)

BOTH = pytest.mark.parametrize("kind", ESTIMATORS)
INDEFINITE = [[0.09, 0.2], [0.2, 0.09]]


def twice_as_wide(x, u, t):
    return jnp.concatenate([jnp.sin(x[:1]), x[:1]])


def three_states(x, u, t):
    return jnp.zeros(3)


def asymmetric(x, u, t):
    return jnp.array([[1e-4, 5e-5], [0.0, 1e-4]])


def negative(x, u, t):
    return jnp.array([[-0.01]])


def negative_later(x, u, t):
    return jnp.where(t > 2.0, -0.01, 0.01)[None, None]


def by_hand(mean, cov):
    return gf.Gaussian(jnp.asarray(mean), jnp.asarray(cov), pendulum().space)


def wide():
    return np.repeat(swung()[2], 2, axis=1)


# Each line: what is wrong, how to do it, the error, and what its message must say.
REFUSED = {
    "two columns measured, one in h": (
        lambda kind: estimate(kind, y=wide()),
        ShapeError,
        ["y: expected shape (200, 1) (across), got (200, 2)"],
    ),
    "h returns two, one column measured": (
        lambda kind: estimate(kind, pendulum(h=twice_as_wide)),
        ModelError,
        ["h: expected shape (1,), got (2,)"],
    ),
    "f returns three states": (
        lambda kind: estimate(kind, pendulum(f=three_states)),
        ModelError,
        ["f: expected shape (2,), got (3,)"],
    ),
    "x0 a column": (
        lambda kind: estimate(kind, prior=gf.make_prior(pendulum(), MEAN[:, None], STD)),
        ShapeError,
        ["prior mean: expected shape (2,) (theta, omega), got (2, 1)"],
    ),
    "x0 a column, made by hand": (
        lambda kind: estimate(kind, prior=by_hand(MEAN[:, None], np.diag(STD))),
        ShapeError,
        ["prior mean: expected shape (2,), got (2, 1)", "make_prior"],
    ),
    "x0 whole numbers, made by hand": (
        lambda kind: estimate(kind, prior=by_hand(np.array([1, 0]), np.diag(STD))),
        ShapeError,
        ["prior mean: expected floating-point numbers, got int64", "make_prior"],
    ),
    "x0 too long": (
        lambda kind: estimate(kind, prior=gf.make_prior(pendulum(), [1.0, 0.0, 0.0], STD)),
        ShapeError,
        ["prior mean: expected shape (2,) (theta, omega), got (3,)"],
    ),
    "prior of another model": (
        lambda kind: estimate(kind, prior=gf.make_prior(walk(), [0.0], [1.0])),
        ShapeError,
        ["prior: expected the states theta, omega, got x"],
    ),
    "Q three by three": (
        lambda kind: estimate(kind, pendulum(Q=np.eye(3))),
        ShapeError,
        ["Q: expected shape (2, 2), got (3, 3)"],
    ),
    "R negative": (
        lambda kind: estimate(kind, pendulum(R=-0.01)),
        CovarianceError,
        ["R: expected variances of at least 0, got -0.01 for 'across'"],
    ),
    "R negative, from a function": (
        lambda kind: estimate(kind, pendulum(R=negative)),
        CovarianceError,
        ["R at t = 0 s: expected variances of at least 0, got -0.01 for 'across'"],
    ),
    "R negative after a while": (
        lambda kind: estimate(kind, pendulum(R=negative_later)),
        CovarianceError,
        ["R at t = 2.0", "expected variances of at least 0, got -0.01 for 'across'"],
    ),
    "P0 indefinite": (
        lambda kind: estimate(kind, prior=gf.make_prior(pendulum(), MEAN, cov=INDEFINITE)),
        CovarianceError,
        ["prior cov", "positive semi-definite", "eigenvalue -0.11", "'theta'", "'omega'"],
    ),
    "P0 indefinite, made by hand": (
        lambda kind: estimate(kind, prior=by_hand(MEAN, INDEFINITE)),
        CovarianceError,
        ["prior cov", "eigenvalue -0.11", "'theta'", "'omega'"],
    ),
    "P0 three by three": (
        lambda kind: estimate(kind, prior=gf.make_prior(pendulum(), MEAN, cov=np.eye(3))),
        ShapeError,
        ["prior cov: expected shape (2, 2), got (3, 3)"],
    ),
    "Q asymmetric": (
        lambda kind: estimate(kind, pendulum(Q=np.array(asymmetric(0, 0, 0)))),
        CovarianceError,
        ["Q: expected a symmetric matrix, got 5e-05 for ('theta', 'omega') but 0 for ('omega', 'theta')"],
    ),
    "Q asymmetric, from a function": (
        lambda kind: estimate(kind, pendulum(Q=asymmetric)),
        CovarianceError,
        ["Q at t = 0 s: expected a symmetric matrix, got 5e-05", "'theta'"],
    ),
    "infinity measured": (
        lambda kind: estimate(kind, y=with_one(np.inf)),
        DataError,
        ["signal 'across'", "finite number, or NaN for missing", "got inf in row 100 at t = 2 s"],
    ),
    "text measured": (
        lambda kind: estimate(kind, y=[*swung()[2][:100, 0], "off", *swung()[2][101:, 0]]),
        DataError,
        ["y: expected numbers, got 'off' in row 100"],
    ),
    "complex numbers measured": (
        lambda kind: estimate(kind, y=swung()[2] + 0j),
        DataError,
        ["y: expected real numbers, got complex128"],
    ),
    "time goes back": (
        lambda kind: estimate(kind, t=np.where(np.arange(ROWS) == 50, 0.5, swung()[0])),
        DataError,
        ["t: expected times that never decrease, got 0.5 s after 0.98 s in row 50"],
    ),
    "time without a number": (
        lambda kind: estimate(kind, t=np.where(np.arange(ROWS) == 50, np.nan, swung()[0])),
        DataError,
        ["t: expected finite numbers, got nan in row 50"],
    ),
    "time in dates": (
        lambda kind: estimate(kind, t=np.datetime64("2024-01-01", "ns") + np.arange(ROWS) * np.timedelta64(20, "ms")),
        DataError,
        ["t: expected seconds, got datetime64[ns]", "np.timedelta64(1, 's')"],
    ),
    "fewer times than measurements": (
        lambda kind: estimate(kind, t=swung()[0][:-1]),
        ShapeError,
        ["y: expected shape (199, 1) (across), got (200, 1)"],
    ),
    "nothing at all": (
        lambda kind: estimate(kind, t=[], y=[]),
        DataError,
        ["t: expected at least one row, got none"],
    ),
    "uneven steps for a model with its own step": (
        lambda kind: estimate(kind, t=swung()[0] ** 1.5),
        ModelError,
        ["f: expected to take dt", "f(x, u, t, dt)"],
    ),
    "float32 too coarse for the times": (
        lambda kind: estimate(
            kind,
            prior=gf.Gaussian(jnp.asarray(MEAN, jnp.float32), jnp.eye(2, dtype=jnp.float32), pendulum().space),
            t=1.7e9 + swung()[0],
        ),
        PrecisionError,
        ["float32", "steps of 0.02 s", "float64"],
    ),
}


@BOTH
@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_refused_with_name_expected_and_given(case, kind):
    attempt, error, fragments = REFUSED[case]
    with pytest.raises(error) as caught:
        attempt(kind)
    assert isinstance(caught.value, GainfulError)
    for fragment in fragments:
        assert fragment in str(caught.value)


@BOTH
def test_a_sound_run_agrees_with_plain_numpy(kind):
    t, truth, y = swung()
    result = estimate(kind)
    np.testing.assert_allclose(result.mean, REFERENCES[kind](t, y), rtol=0, atol=1e-10)
    assert np.sqrt(np.mean((result["theta"] - truth[:, 0]) ** 2)) < 0.1


@BOTH
def test_one_missing_sample_is_skipped_and_the_rest_is_right(kind):
    t, truth, _ = swung()
    result = estimate(kind, y=with_one(np.nan))
    np.testing.assert_allclose(result.mean, REFERENCES[kind](t, with_one(np.nan)), rtol=0, atol=1e-10)
    assert result.status[100] == Status.missing
    assert np.all(np.delete(result.status, 100) == Status.ok)
    assert result.std[100, 0] > result.std[99, 0]
    assert np.sqrt(np.mean((result["theta"] - truth[:, 0]) ** 2)) < 0.1


@BOTH
def test_missing_marks_of_every_kind_mean_the_same(kind):
    expected = estimate(kind, y=with_one(np.nan)).mean
    masked = np.ma.array(with_one(-999.0), mask=with_one(-999.0) == -999.0)
    listed = [None if k == 100 else float(value) for k, value in enumerate(swung()[2][:, 0])]
    np.testing.assert_array_equal(estimate(kind, y=masked).mean, expected)
    np.testing.assert_array_equal(estimate(kind, y=listed).mean, expected)


@BOTH
def test_an_initial_state_of_whole_numbers_gives_the_same_run(kind):
    model = pendulum()
    whole = estimate(kind, prior=gf.make_prior(model, [1, 0], [1, 1]))
    np.testing.assert_array_equal(whole.mean, estimate(kind, prior=gf.make_prior(model, [1.0, 0.0], [1.0, 1.0])).mean)
    assert whole.mean.dtype == np.float64


@BOTH
def test_a_sensor_that_never_speaks_leaves_the_prior_carried_forward(kind):
    t, _, _ = swung()
    silent = np.full((ROWS, 1), np.nan)
    result = estimate(kind, y=silent)
    np.testing.assert_allclose(result.mean, REFERENCES[kind](t, silent), rtol=0, atol=1e-10)
    assert np.all(result.status == Status.missing)
    assert "nothing was measured" in result.warnings[0]
    assert gf.verdict(result).consistent is None


@BOTH
def test_the_same_time_twice_is_two_measurements_of_one_moment(kind):
    t, _, y = swung()
    t = t.copy()
    t[60:] -= STEP
    result = estimate(kind, t=t)
    np.testing.assert_allclose(result.mean, REFERENCES[kind](t, y), rtol=0, atol=1e-10)
    assert result.std[60, 0] < result.std[59, 0]


@BOTH
def test_a_perfect_sensor_is_followed_as_plain_numpy_follows_it(kind):
    model = pendulum(R=0.0)
    t, truth, _ = swung()
    log = gf.make_log(model, t, np.sin(truth[:, :1]))
    result = gf.run(ESTIMATORS[kind], model, gf.make_prior(model, MEAN, STD), log)
    np.testing.assert_allclose(result.mean, REFERENCES[kind](t, log.y, R=0.0), rtol=0, atol=1e-7)
    assert np.all(result.status == Status.ok)


def test_a_perfect_sensor_that_speaks_twice_at_once_is_named():
    with pytest.raises(NumericalError) as caught:
        run_breakable(old_R=0.0, new_R=0.0, old_Q=0.0, new_Q=0.0)
    assert "row 1 at t = 1 s: the innovation covariance is not positive definite" in str(caught.value)
    assert "R is 0 for 'y', and its prediction is certain already" in str(caught.value)
