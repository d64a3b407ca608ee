"""What a record told of its parameters, and when they were found to have changed."""

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import changes, learned, verdict
from gainful.faults import Fault, with_faults

ROWS, JUMP = 600, 400


def gain_model():
    """A sensor whose unknown gain is seen whenever the input is not 0; `idle` has no effect at all."""
    return gf.discrete_model(
        lambda x, u, t: 0.9 * x,
        lambda x, u, t, p: x + p["gain"] * u + 0.0 * p["idle"],
        states={"x": "m"},
        inputs={"drive": "1"},
        outputs={"y": "m"},
        Q=0.001,
        R=0.01,
        parameters={"gain": 1.0, "idle": 1.0},
    )


@pytest.fixture(scope="module")
def result(generator):
    """The gain doubles at row 400; one reading in ten is an outlier."""
    rng = generator("learning")
    u = np.sign(np.sin(0.7 * np.arange(ROWS)))
    y = np.where(np.arange(ROWS) < JUMP, 1.0, 2.0) * u + 0.1 * rng.normal(size=ROWS)
    y += np.where(rng.random(ROWS) < 0.1, 3.0 * rng.normal(size=ROWS), 0.0)
    model = gf.augment(gain_model(), parameters={"gain": 0.0, "idle": 0.0}, bounds={"gain": (0.0, None)})
    prior = gf.make_prior(model, {"x": 0.0, "gain": 1.2, "idle": 1.0}, {"x": 0.1, "gain": 0.6, "idle": 0.3})
    update = gf.ChangeDetection({"log(gain)": 0.5}, gf.MasreliezMartin())
    log = gf.make_log(model, 0.5 * np.arange(ROWS), y, u)
    return gf.run(gf.extended_kalman_filter(update=update), model, prior, log)


def test_a_parameter_is_learned_where_its_sigma_falls_and_only_there(result):
    gain, idle = learned(result)
    assert (gain.name, idle.name) == ("gain", "idle")
    # In units of the covariance: of a positive parameter its logarithm.
    assert gain.before == pytest.approx(0.6 / 1.2)
    assert gain.after == pytest.approx(result.std[:, 1].min())
    assert gain.after < 0.1 * gain.before
    assert idle.after == pytest.approx(idle.before) == pytest.approx(0.3)
    assert gain.warning == ""
    assert idle.warning.startswith(
        "next to nothing was learned of idle: its sigma never fell below 0.3, from 0.3 before"
    )


def test_the_verdict_warns_of_what_was_not_learned(result):
    told = verdict(result).warnings
    assert [text for text in told if "learned" in text] == [learned(result)[1].warning]


def test_a_change_is_found_with_its_time_and_direction(result):
    (found,) = changes(result)
    assert found.state == "log(gain)"
    assert found.up
    # The bounded push of an outlier adds 0.9 to a sum at most, that of a change up to as much: 8 take ten rows or so.
    assert 0.5 * JUMP < found.t < 0.5 * (JUMP + 60)
    gain, idle = learned(result)
    assert gain.changes == (found,)
    assert idle.changes == ()
    assert result["gain"][-1] == pytest.approx(2.0, abs=0.1)


def test_of_a_smoothed_result_the_filter_is_judged(result):
    smoothed = gf.smooth(result)
    assert changes(smoothed) == changes(result)
    assert learned(smoothed) == learned(result)


def test_without_a_detection_there_are_no_changes_and_without_parameters_nothing_was_learned():
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
    log = gf.make_log(model, np.arange(5.0), np.zeros(5))
    plain = gf.run(gf.kalman_filter(), model, gf.make_prior(model, [0.0], [1.0]), log)
    assert changes(plain) == ()
    assert learned(plain) == ()


def test_parameters_are_found_under_faults_and_biases():
    inner = gf.augment(gain_model(), parameters={"gain": 0.0})
    model = with_faults(inner, [Fault("bias", "y", 0.0, 0.1)])
    base = gf.make_prior(inner, {"x": 0.0, "gain": 1.0}, {"x": 0.1, "gain": 0.5})
    prior = gf.faults.extend_prior(model, base)
    log = gf.make_log(model, np.arange(5.0), jnp.ones(5), jnp.ones(5))
    (found,) = learned(gf.run(gf.extended_kalman_filter(), model, prior, log))
    assert (found.name, found.before) == ("gain", pytest.approx(0.5))
