import dataclasses
import itertools

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import coverage, rmse
from gainful.errors import ConfigError, Status


@pytest.fixture(scope="module")
def result(drifting):
    return gf.run(gf.kalman_filter(), drifting.model, drifting.prior, drifting.log)


def test_rmse_is_the_root_of_the_mean_square_error(drifting, result):
    off = drifting.log.truth["speed"] - result["speed"]
    assert rmse(result) == pytest.approx({"position": rmse(result)["position"], "speed": np.sqrt(np.mean(off**2))})
    assert list(rmse(result)) == ["position", "speed"]


def test_rmse_of_an_angle_wraps_and_of_an_attitude_is_per_axis(standing):
    model = gf.discrete_model(
        lambda x, u, t: x,
        lambda x, u, t: x[:1],
        states={"heading": "angle", "q": "quaternion", "gain": "1"},
        outputs=["y"],
        Q=np.full(5, 1e-6),
        R=1.0,
    )
    prior = gf.make_prior(model, [np.pi - 0.1, 0.0, 0.0, 0.0, 1.0, 1.0], np.full(5, 1e-3))
    half = 0.05
    truth = {"heading": np.full(4, -np.pi + 0.1)}
    truth |= {
        f"q_{axis}": np.full(4, value) for axis, value in zip("xyzw", (np.sin(half), 0, 0, np.cos(half)), strict=True)
    }
    log = gf.make_log(model, np.arange(4.0), np.full((4, 1), np.nan), truth=truth)
    errors = rmse(standing(model, prior, log))
    expected = {"heading": 0.2, "q_rotation_x": 0.1, "q_rotation_y": 0.0, "q_rotation_z": 0.0}
    assert errors == pytest.approx(expected, abs=1e-9)


def test_rows_that_failed_or_lack_truth_do_not_count(drifting, result):
    truth = {"speed": drifting.log.truth["speed"].copy()}
    truth["speed"][:10] = 1e6
    status = result.status.copy()
    status[:10] = Status.nonfinite
    broken = dataclasses.replace(result, status=status, log=dataclasses.replace(drifting.log, truth=truth))
    assert list(rmse(broken)) == list(coverage(broken)) == ["speed"]
    assert rmse(broken)["speed"] < 10.0
    truth["speed"][:10] = np.nan
    holes = dataclasses.replace(result, log=dataclasses.replace(drifting.log, truth=truth))
    assert rmse(holes) == rmse(broken)


def test_coverage_of_a_sound_filter_is_its_level(pendulum, many, results):
    estimator = gf.extended_kalman_filter()
    batch = list(itertools.islice(results(pendulum, estimator, many(pendulum, estimator)), 100))
    for level in (0.5, 0.95):
        shares = [coverage(result, level) for result in batch]
        for name in ("swing", "rate"):
            # 6000 rows, of which neighbours agree.
            assert np.mean([share[name] for share in shares]) == pytest.approx(level, abs=0.03)


def test_coverage_drops_where_the_covariance_is_too_small(result):
    shrunk = dataclasses.replace(result, estimates=dataclasses.replace(result.estimates, cov=result.estimates.cov / 16))
    assert coverage(shrunk)["position"] < 0.6 < 0.9 < coverage(result)["position"]


def test_state_known_exactly_is_inside_its_band_while_it_is_right(standing):
    model = gf.discrete_model(
        lambda x, u, t: jnp.array([0.9 * x[0] + x[1], x[1]]),
        lambda x, u, t: x[:1],
        states=["x", "offset"],
        outputs=["y"],
        Q=[0.1, 0.0],
        R=0.1,
    )
    prior = gf.make_prior(model, [0.0, 0.3], [1.0, 0.0])
    log = gf.make_log(model, np.arange(20.0), np.zeros(20), truth={"offset": np.full(20, 0.3)})
    result = standing(model, prior, log)
    assert coverage(result) == {"offset": 1.0}
    off = dataclasses.replace(log, truth={"offset": np.full(20, 0.3001)})
    assert coverage(dataclasses.replace(result, log=off)) == {"offset": 0.0}


def test_level_of_coverage_must_be_a_probability(result):
    with pytest.raises(ConfigError, match="level: expected a probability between 0 and 1, got 95"):
        coverage(result, 95)
