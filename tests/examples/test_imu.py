"""The README on the inertial unit says what its trials say."""

import re

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.jobs import estimate
from gainful.noise import with_scaled_noise

from .test_examples import EXAMPLES, recorded

FOLDER = EXAMPLES / "imu"
SCRIPT = FOLDER / "attitude.py"
README = (FOLDER / "README.md").read_text(encoding="utf-8")
QUICK = ("exact", "gated for good", "sage_husa")


@pytest.fixture(scope="module")
def trials(script):
    return script.Trials(recorded("imu_broad"))


def told() -> dict[str, list[list[float]]]:
    """Errors by choice, then by trial, of the README."""
    found = re.findall(r"^\| `([^`]+)` \|((?: [\d. /]+ \|){2} [\d. /]+ )\|$", README, re.M)
    assert found
    return {name: [[float(x) for x in cell.split("/")] for cell in cells.split("|")] for name, cells in found}


def test_every_choice_of_the_script_is_in_the_readme(script):
    assert list(told()) == list(script.CHOICES)


@pytest.mark.parametrize("name", list(told()))
def test_the_errors_are_those_of_the_readme(script, trials, name, request):
    if name not in QUICK and not request.config.getoption("--full"):
        pytest.skip("half a minute of compiling for all choices; --full tries them")
    choice = script.CHOICES[name]
    own = script.Trials(trials.folder, offsets=True) if "offsets" in choice else trials
    for trial, cell in zip(script.TRIALS, told()[name], strict=True):
        found = script.attitude_errors(own.run(trial, **choice), own.moving(trial))
        # Rounded to 0.01 degrees.
        assert cell == pytest.approx(found, abs=0.006)


def test_the_magnet_is_met_by_a_gate_for_good_and_by_learning_the_noise(script, trials):
    moving = trials.moving("magnet")
    errors = {name: script.attitude_errors(trials.run("magnet", **script.CHOICES[name]), moving)[0] for name in QUICK}
    assert max(errors["gated for good"], errors["sage_husa"]) < 0.55 * errors["exact"]


def test_the_noise_of_the_configuration_has_the_largest_likelihood_on_the_slow_trial(script, trials):
    log, names = script.excerpt(trials), (*script.ACCELEROMETER, *script.MAGNETOMETER)

    def likelihood(factor=1.0, changed=()):
        factors = {name: jnp.asarray(factor if name in changed else 1.0) for name in names}
        scaled = with_scaled_noise(gf.extended_kalman_filter(), {}, factors)
        return float(gf.run(scaled, trials.model, trials.prior, log).log_likelihood[1000:].sum())

    best = likelihood()
    for sensor in (script.ACCELEROMETER, script.MAGNETOMETER):
        # Five times the 0.6 % to which the fit knows each.
        assert best > max(likelihood(0.97, sensor), likelihood(1.03, sensor))


def test_the_noise_of_the_readme_is_what_the_likelihood_says(script, trials, request):
    if not request.config.getoption("--full"):
        pytest.skip("two fits of a minute each; --full tries them")
    found = re.findall(
        r"^\| (?:both sensors|all three) \| ([^|]+) \| ([\d.]+) m/s² \| ([\d.]+) uT \|(.*) \|$", README, re.M
    )
    for gyro, (rest, *sigmas, errors) in zip((False, True), found, strict=True):
        fit = script.fitted(trials, gyro=gyro)
        sensors = [each for each in fit.entries if each.entry.kind == "measurement"]
        assert [each.fitted[0] for each in sensors] == pytest.approx([float(each) for each in sigmas], abs=6e-4)
        if gyro:
            assert fit.entries[0].factor == pytest.approx(float(rest.split()[0]), rel=0.01)
        for trial, told_error in zip(script.TRIALS, errors.split("|"), strict=True):
            result = gf.run(fit.estimator, trials.model, trials.prior, trials.logs[trial])
            assert script.attitude_errors(result, trials.moving(trial))[0] == pytest.approx(float(told_error), rel=0.01)


def test_an_error_of_attitude_splits_into_the_vertical_and_the_heading(script):
    half = np.radians(10.0) / 2
    level = np.array([[0.0, 0.0, 0.0, 1.0]])
    for vector, parts in (([0, 0, np.sin(half)], (0.0, 10.0)), ([np.sin(half), 0, 0], (10.0, 0.0))):
        q = np.array([[*vector, np.cos(half)]])
        (found,) = script.between(q, level)
        assert found == pytest.approx(q[0])
        assert np.degrees(2 * np.arcsin(np.hypot(*found[:2]))) == pytest.approx(parts[0])
        assert np.degrees(2 * np.arctan2(found[2], found[3])) == pytest.approx(parts[1], abs=1e-9)


def test_the_trial_with_the_magnet_runs_from_its_configuration(script, trials, tmp_path):
    folder = recorded("imu_broad")
    text = (FOLDER / "magnet.toml").read_text().replace('folder = "data"', f'folder = "{folder}"')
    path = tmp_path / "magnet.toml"
    path.write_text(text.replace('file = "imu.py"', f'file = "{FOLDER / "imu.py"}"'))
    job = estimate(path)
    errors = script.attitude_errors(job.result, trials.moving("magnet"))
    assert errors == pytest.approx(told()["sage_husa"][2], abs=0.006)
