"""Two stages, robust and adaptive in one filter: made of parts alone, and on a few flights what the README says."""

import dataclasses
import re

import numpy as np
import pytest

from gainful.filters import KalmanFilter
from gainful.jobs import estimate
from gainful.studies.monte_carlo import run_experiment

from .test_examples import EXAMPLES

FOLDER = EXAMPLES / "combination"
SCRIPT = FOLDER / "combination.py"
README = (FOLDER / "README.md").read_text(encoding="utf-8")


def told(head):
    """The table of the README with a head, first numbers of its cells by the row's name."""
    part = README.split(head, 1)[1].split("\n\n", 1)[0]
    rows = re.findall(r"^\| ([a-z][^|]*) \|(.*)\|$", part, re.M)
    return {name: [cell.strip() for cell in cells.split("|")] for name, cells in rows}


def test_every_filter_is_a_kalman_filter_of_parts_of_the_package(script):
    for name in script.NAMES:
        made = script.assembled(name, *script.SETTINGS[name]).estimator
        assert type(made) is KalmanFilter
        for part in (made.linearization, made.update, made.noise):
            assert type(part).__module__.startswith("gainful.")


def test_all_were_tuned_with_the_same_effort_and_are_told(script):
    assert len({len(script.settings(name)) for name in script.NAMES}) == 1
    for name in script.NAMES:
        assert script.SETTINGS[name] in script.settings(name)
    assert list(told("| filter | rate")) == list(script.NAMES)


def test_together_they_are_better_than_two_stages_alone_on_a_few_flights(script):
    whole = script.experiment("faulty", "With the fault", script.Flight(script.OFFSET))
    some = {name: whole.contenders[name] for name in (script.STAGES, script.ALL)}
    # Compiled quickly: the last digits differ, and nothing below hangs on them.
    found = run_experiment(dataclasses.replace(whole, contenders=some, kept=(), trace=None), 3, script.SEED, quick=True)
    alone, together = found.values[script.STAGES], found.values[script.ALL]
    for quantity in ("rate", "angle", "fault"):
        assert np.mean(together[quantity]) < np.mean(alone[quantity])
    # Of 1040 rows with six states: honest to a factor of two, where gross errors alone make it ten.
    assert 0.5 < np.mean(together["nees"]) < 2.0


def test_the_configuration_finds_the_fault_as_the_readme_says():
    job = estimate(FOLDER / "combination.toml")
    result = job.result
    size = result["offset_torque_x"][-1]
    assert f"{1e3 * size:.1f} mN m" in README
    assert job.faults is not None
    assert size == pytest.approx(0.01, abs=3 * result.std[-1, 6])
