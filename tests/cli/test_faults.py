"""Faults looked for in a record: found, timed, sized, and told apart, from one configuration file."""

import re

import numpy as np
import pytest

from gainful.errors import ConfigError
from gainful.jobs import estimate, fault_rows_of

MODEL = """
import jax.numpy as jnp

def f(x, u, t, dt):
    push = u[0] + u[1]
    return jnp.array([x[0] + dt * x[1] + 0.5 * dt**2 * push, x[1] + dt * push])

def h(x, u, t):
    return x
"""
CONFIG = """
filter = {filter}
inject = [{{ kind = "bias", signal = "left", size = 0.5, onset = 10.0 }}]

[model]
file = "model.py"
kind = "discrete"
states = {{ position = "m", speed = "m/s" }}
outputs = {{ place = "m", pace = "m/s" }}
inputs = {{ left = "m/s^2", right = "m/s^2" }}
Q = [1e-6, 1e-4]
R = [1e-2, 1e-2]

[data]
file = "record.csv"
time = "t"
outputs.place = "place"
outputs.pace = "pace"
inputs.left = "left"
inputs.right = "right"

[prior]
mean = [0.0, 0.0]
std = [0.1, 0.1]

[faults]
{faults}
"""
STATES = """states = [
    { kind = "offset", signal = "left", walk = 1e-3, sigma = 1e-2, bound = 1.0 },
    { kind = "loss", signal = "right", walk = 1e-3, sigma = 1e-2 },
]
"""


@pytest.fixture
def folder(tmp_path):
    """A cart pushed from both sides, sound as recorded."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 30.0, 0.1)
    left, right = np.sin(0.5 * t), 0.8 * np.cos(0.9 * t)
    x, rows = np.zeros(2), []
    for k in range(len(t)):
        if k:
            push = left[k] + right[k]
            x = np.array([x[0] + 0.1 * x[1] + 0.005 * push, x[1] + 0.1 * push]) + rng.normal(size=2) * [1e-3, 1e-2]
        rows.append([t[k], *(x + 0.1 * rng.normal(size=2)), left[k], right[k]])
    np.savetxt(tmp_path / "record.csv", rows, delimiter=",", header="t,place,pace,left,right", comments="")
    (tmp_path / "model.py").write_text(MODEL)
    return tmp_path


def job(folder, filter='"tsekf"', faults=STATES, out=None):
    (folder / "job.toml").write_text(CONFIG.format(filter=filter, faults=faults))
    return estimate(folder / "job.toml", out)


JUMPS = '{ kind = "glr", quiet = "tsekf", bounds = { offset_left = 1.0, loss_right = 1.0 } }'


@pytest.mark.parametrize(("filter", "within"), [('"tsekf"', 4.0), (JUMPS, 2.0)], ids=["two-stage", "jump bank"])
def test_an_injected_fault_is_found_timed_and_told_apart(folder, filter, within):
    found = job(folder, filter).faults
    offset, loss = found.faults
    assert offset.name == "offset_left"
    assert 0 <= offset.delay < within
    assert offset.times[0] == pytest.approx(10.0 + offset.delay)
    assert offset.explained == ("offset_left",)
    if filter == JUMPS:  # the filter of slow faults is still on its way
        assert abs(offset.size - 0.5) < 4 * offset.sigma
    # While the offset is underestimated the loss takes some of it; the record is still best explained by the offset.
    assert not loss.times or loss.explained == ("offset_left",)
    assert loss.delay is None
    assert found.isolability.startswith("all 2 faults observed")


def test_alarms_of_a_jump_bank_are_those_of_the_faults_whatever_else_was_added_to_the_model(folder):
    text = CONFIG.replace("[data]", "[model.augment]\nbiases = {{ pace = 1e-4 }}\n\n[data]", 1)
    text = text.replace("mean = [0.0, 0.0]\nstd = [0.1, 0.1]", "mean = [0.0, 0.0, 0.0]\nstd = [0.1, 0.1, 0.1]")
    (folder / "job.toml").write_text(text.format(filter=JUMPS, faults=STATES))
    offset, loss = estimate(folder / "job.toml").faults.faults
    assert 0 <= offset.delay < 2.0
    assert not loss.times


def test_a_fault_that_drifts_is_followed_and_smoothed_with_a_lag(folder):
    text = CONFIG.replace('kind = "bias", signal = "left", size = 0.5', 'kind = "drift", signal = "left", size = 0.2')
    drifting = STATES.replace('signal = "left", walk = 1e-3,', 'signal = "left", rate_sigma = 0.01, rate_walk = 0.05,')
    text = text.format(filter='"tsekf"', faults=drifting) + "\n[options]\nlag = 1.0\n"
    (folder / "job.toml").write_text(text)
    done = estimate(folder / "job.toml", folder / "out")
    offset, _, rate = done.faults.faults
    assert (rate.name, rate.unit) == ("offset_left_rate", "m/s^2/s")
    assert abs(offset.size - 0.2 * 19.9) < 4 * offset.sigma
    assert abs(rate.size - 0.2) < 4 * rate.sigma
    assert done.result.lag == 1.0
    assert done.result.std[150, 2] < 0.9 * done.result.filtered.std[150, 2]
    page = (folder / "out" / "report.html").read_text()
    assert "smoothed with a lag of 1 s" in page
    assert "which look 1 s ahead" in page


def test_an_alarm_that_began_before_a_fault_does_not_count_it_as_missed(folder):
    """The first of the two is there already, and its alarm still on, when the second comes."""
    second = 'inject = [{{ kind = "bias", signal = "left", size = 0.2, onset = 20.0 }}, {{ '
    (folder / "job.toml").write_text(CONFIG.replace("inject = [{{ ", second).format(filter='"tsekf"', faults=STATES))
    found = estimate(folder / "job.toml").faults.faults[0]
    assert found.times[0] < 20.0
    assert found.delay == pytest.approx(0.0, abs=1e-9)


def test_the_report_and_the_table_tell_of_the_faults(folder):
    done = job(folder, out=folder / "out")
    heads, rows = fault_rows_of(done.faults)
    assert heads[-1] == "delay [s]"
    assert [row[0] for row in rows] == ["offset_left", "loss_right"]
    page = (folder / "out" / "report.html").read_text()
    assert "Faults" in page
    assert "offset_left" in page
    assert "all 2 faults observed" in page


def test_a_threshold_for_a_rate_of_false_alarms_is_found_by_simulation(folder):
    found = job(folder, faults=STATES + "false_alarms = 20.0\nhold_off = 1.0\n").faults
    assert re.search(r"threshold .* for 20 false alarms per 1000 s", found.limit)
    assert found.faults[0].delay < 4.0


def test_a_hold_off_longer_than_the_record_is_refused(folder):
    with pytest.raises(ConfigError, match=r"faults.hold_off: expected less than the record's length, got 99.0 s"):
        job(folder, faults=STATES + "false_alarms = 20.0\nhold_off = 99.0\n")


def test_the_prior_of_the_faults_is_their_own_and_the_record_stays_as_it_was(folder):
    before = (folder / "record.csv").read_bytes()
    done = job(folder)
    assert done.result.model.space.names == ("position", "speed", "offset_left", "loss_right")
    assert np.asarray(done.result.prior.cov)[2, 2] == pytest.approx(1e-4)
    assert (folder / "record.csv").read_bytes() == before
