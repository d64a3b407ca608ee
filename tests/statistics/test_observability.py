import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import observability
from gainful.errors import ConfigError, NumericalError

STEP = 0.1  # s
ROWS = 60


@pytest.fixture(scope="module")
def moving(standing):
    """A body of constant velocity, measured by `H`, its position in units of `1 / position` metres."""

    def made(H, R=0.01, *, position=1.0, std=(1.0, 1.0), y=None):
        scale = np.diag([position, 1.0])
        F = scale @ np.array([[1.0, STEP], [0.0, 1.0]]) @ np.linalg.inv(scale)
        H = np.atleast_2d(H) @ np.linalg.inv(scale)
        Q = scale @ np.diag([1e-6, 1e-4]) @ scale
        model = gf.linear_model(F, H, Q=Q, R=R * np.eye(len(H)), states=["position", "velocity"])
        prior = gf.make_prior(model, [0.0, 0.0], scale @ np.array(std))
        log = gf.make_log(model, STEP * np.arange(ROWS), np.zeros((ROWS, len(H))) if y is None else y)
        return standing(model, prior, log)

    return made


def test_position_is_named_where_only_velocity_is_measured(moving):
    found = observability(moving([0.0, 1.0]))
    assert (found.rank, found.names) == (1, ("position", "velocity"))
    assert found.unobserved == ("position",)
    assert np.isinf(found.condition)
    assert found.sentence == "1 of 2 directions observed; not observed: position"


def test_position_alone_observes_velocity_too(moving):
    found = observability(moving([1.0, 0.0]))
    assert (found.rank, found.unobserved, found.weak) == (2, (), ())
    assert 1.0 < found.condition < 1e3
    assert found.sentence == f"all 2 states observed (condition {found.condition:.2g})"


def test_gramian_is_the_sum_along_the_record(moving):
    R, std = 0.04, (2.0, 0.5)
    found = observability(moving([1.0, 0.0], R, std=std))
    expected = np.zeros((2, 2))
    for k in range(ROWS):
        row = np.array([[1.0, k * STEP]]) * std
        expected += row.T @ row / R
    np.testing.assert_allclose(found.gramian, expected, rtol=1e-9)
    np.testing.assert_allclose(found.singular_values, np.linalg.eigvalsh(expected)[::-1], rtol=1e-9)


def test_information_is_what_the_filter_gains_without_process_noise():
    model = gf.linear_model([[1.0, STEP], [0.0, 1.0]], [[1.0, 0.0]], Q=[0.0, 0.0], R=0.04)
    prior = gf.make_prior(model, [0.0, 0.0], [2.0, 0.5])
    result = gf.run(gf.kalman_filter(), model, prior, gf.make_log(model, STEP * np.arange(ROWS), np.zeros(ROWS)))
    start = gf.smooth(result).cov[0] / np.outer([2.0, 0.5], [2.0, 0.5])
    np.testing.assert_allclose(start, np.linalg.inv(np.eye(2) + observability(result).gramian), rtol=1e-6)


def test_units_change_nothing(moving):
    metres, millimetres = (observability(moving([1.0, 0.0], position=scale)) for scale in (1.0, 1e3))
    np.testing.assert_allclose(millimetres.singular_values, metres.singular_values, rtol=1e-9)
    assert millimetres.rank == metres.rank


def test_two_biases_of_one_sensor_are_told_apart_from_nothing(standing):
    model = gf.linear_model(
        np.eye(3), [[1.0, 1.0, 1.0]], Q=[1e-4, 0.0, 0.0], R=0.1, states=["x", "bias_a", "bias_b"], outputs=["y"]
    )
    prior = gf.make_prior(model, np.zeros(3), np.ones(3))
    log = gf.make_log(model, np.arange(40.0), np.zeros(40))
    found = observability(standing(model, prior, log))
    assert found.rank == 1
    # Any two differences will do, and each should be one.
    assert len(found.unobserved) == 2
    for words in found.unobserved:
        assert words.count(" - ") == 1
        assert words.startswith("0.71 ")
        assert sum(name in words for name in found.names) == 2


def test_bias_of_a_second_sensor_is_observed(standing):
    base = gf.linear_model(np.eye(1), [[1.0], [1.0]], Q=1e-3, R=[0.1, 0.1], states=["x"], outputs=["a", "b"])
    for biases, rank in (({"b": 0.0}, 2), ({"a": 0.0, "b": 0.0}, 2)):
        model = gf.augment(base, biases=biases)
        prior = gf.make_prior(model, np.zeros(model.space.dof), np.ones(model.space.dof))
        log = gf.make_log(model, np.arange(40.0), np.zeros((40, 2)))
        found = observability(standing(model, prior, log))
        assert found.rank == rank
        expected = () if len(biases) == 1 else ("0.58 x - 0.58 bias_a - 0.58 bias_b",)
        assert found.unobserved == expected


def test_rows_that_were_not_measured_tell_nothing(moving):
    y = np.full((ROWS, 2), np.nan)
    y[:, 1] = 0.0
    found = observability(moving(np.eye(2), y=y))
    assert found.unobserved == ("position",)
    y[:] = np.nan
    y[0, 0] = 0.0
    found = observability(moving(np.eye(2), y=y))
    assert found.unobserved == ("velocity",)
    np.testing.assert_allclose(found.gramian, np.diag([100.0, 0.0]), rtol=1e-9)


def test_barely_reached_direction_is_called_weak(moving):
    # One second of drift at 0.1 m/s per sigma, seen with a sigma of 1 m: the velocity is hardly known better.
    found = observability(moving([1.0, 0.0], R=1.0, std=(1.0, 0.05)))
    assert found.rank == 2
    assert found.weak == ("velocity",)
    assert found.sentence.endswith("; weakly observed: velocity")
    assert observability(moving([1.0, 0.0], R=1.0, std=(1.0, 0.05)), least=0.9).unobserved == ("velocity",)


def test_window_sees_only_its_own_rows(standing):
    model = gf.discrete_model(
        lambda x, u, t: x,
        lambda x, u, t: jnp.array([x[0] + jnp.where(t > 29.5, x[1], 0.0)]),
        states=["x", "gain"],
        outputs=["y"],
        Q=[0.0, 0.0],
        R=0.1,
    )
    prior = gf.make_prior(model, [0.0, 0.0], [1.0, 1.0])
    result = standing(model, prior, gf.make_log(model, np.arange(60.0), np.zeros(60)))
    assert observability(result).rank == 2
    assert observability(result, window=(0.0, 29.0)).unobserved == ("gain",)
    assert observability(result, window=(30.0, 59.0)).unobserved == ("0.71 x - 0.71 gain",)
    with pytest.raises(ConfigError, match=r"window: expected times within 0 to 59 s, got \(70.0, 80.0\)"):
        observability(result, window=(70.0, 80.0))


def test_nonlinear_model_is_judged_along_its_estimates():
    # Range alone: across the line of sight the position shows only once the body moves.
    model = gf.discrete_model(
        lambda x, u, t: x + u,
        lambda x, u, t: jnp.hypot(x[0], x[1])[None],
        states={"east": "m", "north": "m"},
        inputs=["east_step", "north_step"],
        outputs={"range": "m"},
        Q=[1e-8, 1e-8],
        R=0.01,
    )
    prior = gf.make_prior(model, [10.0, 0.0], [0.1, 0.1])
    still, path = np.zeros((30, 2)), np.tile([0.0, 1.0], (30, 1))
    for u, unobserved in ((still, ("north",)), (path, ())):
        log = gf.draw_log(model, prior, np.arange(30.0), u, key=jax.random.key(2))
        found = observability(gf.run(gf.unscented_kalman_filter(), model, prior, log))
        assert found.unobserved == unobserved


def test_attitude_is_judged_per_axis(standing):
    def down(x, u, t):
        from gainful.spaces import quaternion_conjugate, rotate

        return rotate(quaternion_conjugate(x), jnp.array([0.0, 0.0, 1.0]))

    model = gf.discrete_model(lambda x, u, t: x, down, states={"q": "quaternion"}, outputs=3, Q=[1e-8] * 3, R=0.01)
    prior = gf.make_prior(model, {"q": [0.0, 0.0, 0.0, 1.0]}, {"q": 0.1})
    log = gf.make_log(model, np.arange(30.0), np.tile([0.0, 0.0, 1.0], (30, 1)))
    assert observability(standing(model, prior, log)).unobserved == ("q_rotation_z",)


def test_state_the_prior_is_certain_of_is_not_examined(moving, standing):
    found = observability(moving([0.0, 1.0], std=(0.0, 1.0)))
    assert (found.names, found.rank, found.unobserved) == (("velocity",), 1, ())
    nothing = moving([0.0, 1.0])
    prior = eqx.tree_at(lambda prior: prior.cov, nothing.prior, jnp.zeros((2, 2)))
    nothing = standing(nothing.model, prior, nothing.log)
    assert observability(nothing).sentence == "nothing to observe: the prior is certain of every state"


def test_sensor_without_noise_is_very_informative(moving):
    found = observability(moving([1.0, 0.0], R=0.0))
    assert found.rank == 2
    assert np.isfinite(found.gramian).all()


def test_model_that_overflows_asks_for_a_window(standing):
    model = gf.linear_model([[1e10]], [[1.0]], Q=1e-6, R=1.0)
    prior = gf.make_prior(model, [0.0], [1.0])
    log = gf.make_log(model, np.arange(50.0), np.zeros(50))
    result = standing(model, prior, log)
    with pytest.raises(NumericalError, match="use a window"):
        observability(result)
    assert observability(result, window=(0.0, 5.0)).rank == 1
