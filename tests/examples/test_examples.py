"""The examples reach the accuracy they promise, on the records they name."""

import dataclasses
import re
import tomllib
from pathlib import Path

import jax
import numpy as np
import pytest

import gainful as gf
from gainful.config import build_filter, build_model, build_prior, load_config, parse_config
from gainful.diagnostics import coverage, rmse
from gainful.faults import Outliers, inject
from gainful.identification import identify_network
from gainful.io import read_log
from gainful.jobs import IdentifyJob, NetworkJob, estimate, identify_log, state_rows

EXAMPLES = Path(__file__).parents[2] / "examples"
RECORDS = Path(__file__).parents[3] / "shared" / "data"
ARCSECOND = np.pi / 180 / 3600  # rad


def position_error(result: gf.Result, first: str = "x", second: str = "y") -> float:
    errors = rmse(result)
    return float(np.hypot(errors[first], errors[second]))


def recorded(folder: str) -> Path:
    path = RECORDS / folder
    if not path.is_dir():
        pytest.skip(f"the record {folder} is not on this machine")
    return path


@pytest.fixture(scope="module")
def rover() -> gf.Result:
    return estimate(EXAMPLES / "rover" / "rover.toml").result


def test_the_rover_is_located_within_a_metre_and_a_half_and_better_when_smoothed(rover):
    assert rover.filtered is not None
    assert position_error(rover.filtered) <= 1.5
    assert position_error(rover) < position_error(rover.filtered)


def test_the_rovers_bands_hold_the_truth(rover):
    shares = coverage(rover)
    assert min(shares["x"], shares["y"], shares["heading"]) > 0.9


def test_the_rovers_radios_are_found_to_read_long(rover):
    known = rover.log.seen.any(axis=1)
    found = [rover[f"bias_range_{k}"][known].mean() for k in (0, 1, 5, 6)]
    assert 2.3 < np.mean(found) < 3.5  # measured minus true range is 2.75 to 3.04 m per beacon


def test_ranges_taken_at_their_word_lead_the_rover_astray(rover):
    job = estimate(EXAMPLES / "rover" / "rover_without_bias.toml")
    assert job.result.filtered is not None
    assert 3.0 < position_error(job.result.filtered) < 4.0
    assert job.verdict.consistent is False
    heads, rows = state_rows(job)
    distance = next(row for row in rows if row[0] == "distance (x, y)")
    assert distance[heads.index("RMSE filtered")] == pytest.approx(position_error(job.result.filtered))


def test_the_rovers_configuration_works_on_another_copy_of_the_record_by_its_paths_alone(rover):
    folder = recorded("rover_range_plaza1")
    text = (EXAMPLES / "rover" / "rover.toml").read_text()
    text = text.replace(".csv.gz", ".csv").replace('folder = "data"', f'folder = "{folder}"')
    text = text.replace('beacons = "data/beacons.csv"', f'beacons = "{folder / "beacons.csv"}"')
    config = parse_config(tomllib.loads(text))
    model = build_model(config.model, EXAMPLES / "rover")
    log = read_log(model, config.data)
    assert len(log) == len(rover.log)
    result = gf.run(build_filter(config, model), model, build_prior(config, model), log)
    # The copies are rounded alike but for a digit.
    assert position_error(result) == pytest.approx(position_error(rover.filtered), abs=1e-3)


@pytest.mark.parametrize("kind", ["ekf", "ukf"])
def test_the_satellites_attitude_is_known_to_a_third_of_the_trackers_noise(kind):
    config = load_config(EXAMPLES / "satellite" / "satellite.toml")
    config = dataclasses.replace(config, filter={"kind": kind, "square_root": True})
    model = build_model(config.model, EXAMPLES / "satellite")
    log = read_log(model, config.data, EXAMPLES / "satellite")
    result = gf.run(build_filter(config, model), model, build_prior(config, model), log)
    errors = np.array([rmse(result)[f"attitude_rotation_{axis}"] for axis in "xyz"]) / ARCSECOND
    assert (errors < 12).all()  # the tracker's are 30 arcseconds per axis
    assert all(abs(result[f"bias_w{axis}"][-1]) < 5e-6 for axis in "xyz")  # the logged rates are corrected on board


def test_a_fault_put_into_the_satellites_gyro_is_found_dated_and_sized():
    faults = {each.name: each for each in estimate(EXAMPLES / "satellite" / "fault.toml").faults.faults}
    found = faults["offset_wy"]
    assert found.explained == ("offset_wy",)
    assert 0 <= found.delay < 30
    assert len(found.times) == 1
    assert abs(found.size - 5e-5) < 5e-6  # the record's own offset is 1.5e-6
    # The record itself is at odds with its rates about the other axes, but only from 2500 s on.
    assert all(t > 2500 for name in ("offset_wx", "offset_wz") for t in faults[name].times)


def outlier_table() -> dict[str, list[float]]:
    """Position errors by update, of the rover's README."""
    text = (EXAMPLES / "rover" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|((?: [\d.]+ \|){5})$", text, re.M)
    return {name: [float(cell) for cell in cells.split("|")[:-1]] for name, cells in rows}


@pytest.mark.parametrize("name", list(outlier_table()))
def test_the_rovers_errors_with_outliers_are_those_of_its_readme(rover, name, request):
    if name not in ("exact", "gated", "maximum_correntropy") and not request.config.getoption("--full"):
        pytest.skip("a minute of compiling for all rows; --full tries them")
    config = dataclasses.replace(load_config(EXAMPLES / "rover" / "rover_outliers.toml"), update=name)
    chosen = build_filter(config, rover.model)
    for column, (share, size) in enumerate([(0.0, 0.0), (0.05, 20.0), (0.1, 20.0), (0.05, 5.0), (0.1, 5.0)]):
        faults = [Outliers(each.signal, share, size) for each in config.inject]
        draws = [jax.random.key(k) for k in range(5 if share else 1)]
        logs = [inject(rover.log, rover.model, faults, key) for key in draws]
        errors = [position_error(gf.run(chosen, rover.model, rover.prior, log, throw=False)) for log in logs]
        # Rounded to 0.01 m; lost filters differ by more between machines.
        assert np.mean(errors) == pytest.approx(outlier_table()[name][column], abs=0.3 if name == "exact" else 0.006)


def test_the_rover_with_outliers_is_located_as_its_readme_says():
    job = estimate(EXAMPLES / "rover" / "rover_outliers.toml")
    assert [each.share for each in job.config.inject] == [0.1] * 4
    assert position_error(job.result.filtered) == pytest.approx(0.99, abs=0.006)  # as docs/examples.md says
    assert position_error(job.result) < position_error(job.result.filtered)


def test_the_rovers_biases_by_the_two_stage_filter_are_those_of_the_joint_one(rover):
    two, joint = (
        gf.run(each, rover.model, rover.prior, rover.log)
        for each in (gf.two_stage_extended_kalman_filter(), gf.extended_kalman_filter())
    )
    # Rounding over thousands of rows, in units of what is known.
    assert (np.abs(two.mean - joint.mean) / joint.std).max() < 1e-7
    assert np.abs(two.std / joint.std - 1.0).max() < 1e-7


def test_the_car_is_located_within_a_metre_at_three_rates(tmp_path):
    folder = recorded("car_comma2k19")
    text = (EXAMPLES / "car" / "car.toml").read_text().replace('folder = "data"', f'folder = "{folder}"')
    path = tmp_path / "car.toml"
    path.write_text(text.replace('file = "car.py"', f'file = "{EXAMPLES / "car" / "car.py"}"'))
    job = estimate(path)
    result = job.result
    assert result.filtered is not None
    assert position_error(result.filtered, "east", "north") < 1.0
    assert position_error(result, "east", "north") < position_error(result.filtered, "east", "north")
    assert rmse(result)["heading"] < np.radians(0.5)
    assert coverage(result)["north"] > 0.9
    # Three rates: fixes at 10 Hz, wheels at 83 Hz, and rows at the gyro's 104 Hz beside them.
    fixes, wheels = result.seen[:, 0].sum(), result.seen[:, 3].sum()
    assert fixes == 579
    assert 4950 < wheels <= 4974
    assert len(result.log) > 6000 + wheels * 0.8


def test_a_fault_put_into_a_tumbling_cubesats_gyro_is_found_by_its_magnetometer(tmp_path):
    folder, example = recorded("satellite_suchai3"), EXAMPLES / "suchai3"
    text = (example / "fault.toml").read_text().replace('folder = "data"', f'folder = "{folder}"')
    path = tmp_path / "fault.toml"
    path.write_text(text.replace('file = "suchai3.py"', f'file = "{example / "suchai3.py"}"'))
    job = estimate(path)
    assert job.faults is not None
    faults = {each.name: each for each in job.faults.faults}
    found, degree = faults["offset_wy"], np.pi / 180
    assert found.times == (2014.0,)
    assert found.delay == pytest.approx(14.0)
    assert found.explained == ("offset_wy",)
    assert all(not faults[name].times for name in ("offset_wx", "offset_wz"))
    # The record's own offset is in it, 0.07 deg/s.
    assert abs(found.size - 0.57 * degree) < 0.01 * degree
    assert found.sigma == pytest.approx(0.0515 * degree, rel=0.05)
    # Offsets across the spin are hardly better known than before, and the record says so itself.
    assert min(faults[f"offset_w{axis}"].sigma for axis in "xz") > 0.2 * degree
    assert "offset_wx and offset_wy cannot be told apart" in job.faults.isolability
    assert (np.sqrt(np.mean(job.result.residual**2, axis=0)) < 0.4).all()  # uT, of a field of 32 to 53


def told(text: str) -> list[tuple[float, float]]:
    """All `value ± interval` of a text, also those with a power of ten."""
    found = re.findall(r"\(?(-?\d+\.?\d*) ± (\d+\.?\d*)\)?(?:e(-?\d+))?", text)
    return [(float(a) * 10 ** int(e or 0), float(b) * 10 ** int(e or 0)) for a, b, e in found]


def identified(folder: str, config: str, data: Path | None = None, tmp: Path | None = None) -> IdentifyJob:
    """An example's identification, on its own record or on one elsewhere."""
    path = EXAMPLES / folder / config
    if data is not None:
        assert tmp is not None
        text = path.read_text(encoding="utf-8").replace('folder = "data"', f'folder = "{data}"')
        path = tmp / config
        path.write_text(text, encoding="utf-8")
    return identify_log(path)


def intervals(job: IdentifyJob) -> list[tuple[float, float]]:
    low, high = job.found.interval
    return list(zip(job.found.theta.tolist(), ((high - low) / 2).tolist(), strict=True))


def test_the_underwater_vehicles_readme_says_what_is_found():
    text = (EXAMPLES / "underwater_vehicle" / "README.md").read_text(encoding="utf-8")
    good, plain = identified("underwater_vehicle", "yaw.toml"), identified("underwater_vehicle", "pointwise.toml")
    both = [pair for two in zip(intervals(good), intervals(plain), strict=True) for pair in two]
    # As the README rounds them: two digits of the interval.
    for (value, reach), (found, half) in zip(told(text), both, strict=True):
        assert value == pytest.approx(found, abs=0.06 * half)
        assert reach == pytest.approx(half, rel=0.06)
    truth = np.array([0.28, 0.07, 1.55])
    assert (np.abs(good.found.theta - truth) < 4 * good.found.std).all()
    assert abs(plain.found.theta[0] - truth[0]) > 8 * (plain.found.interval[1] - plain.found.theta)[0] * 0.95
    assert any("pulls least squares: inertia" in each for each in plain.cautions)


def test_the_robot_arms_readme_says_what_is_found(tmp_path):
    job = identified("robot_arm", "arm.toml", recorded("flexible_structures"), tmp_path)
    text = (EXAMPLES / "robot_arm" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| .* \| (\d+\.\d) % \| (\d+\.\d) % \|$", text, re.M)
    for (ahead, alone), method in zip(rows, ("ls", "tls", "iv"), strict=True):
        assert 100 * job.checks[method].explained_share == pytest.approx(float(ahead), abs=0.06)
        assert 100 * job.checks[method].simulated_share == pytest.approx(float(alone), abs=0.06)
    # The measure other toolboxes print: 99.7 % one row ahead, 78 % by itself for batch least squares.
    fits = [1 - np.sqrt(1 - share) for share in (job.check.explained_share, job.check.simulated_share)]
    assert fits == pytest.approx([0.997, 0.78], abs=0.01)


def network_rows(example: str) -> dict[str, tuple[float, float]]:
    """Fits one row ahead and by itself that a README tells, by the first words of the model."""
    text = (EXAMPLES / example / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.*?) \| [\d]+ \| (\d+\.\d+) % \| (\d+\.\d) % \|$", text, re.M)
    return {name: (float(ahead), float(alone)) for name, ahead, alone in rows}


@pytest.mark.parametrize("example", ["robot_arm", "steel_subframe"])
def test_what_the_readme_tells_of_networks_is_found(example, tmp_path):
    job = identified(example, "network.toml", recorded("flexible_structures"), tmp_path)
    assert isinstance(job, NetworkJob)
    told = network_rows(example)
    checks = {"`rbf`, 50 thin plates": job.check, "linear, least squares": job.linear["ls"]}
    recipe = dataclasses.replace(job.found.recipe, kernel="gaussian")
    again = identify_network(job.found.model.lags, job.found.recording, recipe)
    checks["`rbf`, 50 Gaussians"] = again.check(job.kept_back)
    for name, check in checks.items():
        ahead, alone = told[name]
        assert 100 * check.fit == pytest.approx(ahead, abs=0.006)
        assert 100 * check.simulated_fit == pytest.approx(alone, abs=0.06)
    needed = any("nothing here asks for a network" in each for each in job.cautions)
    assert needed == (example == "steel_subframe")


def test_the_gliders_readme_says_what_is_found(tmp_path):
    job = identified("glider", "glide.toml", recorded("auv_glider_sea035"), tmp_path)
    assert job.again is not None
    text = (EXAMPLES / "glider" / "README.md").read_text(encoding="utf-8")
    low, high = job.again.interval
    again = list(zip(job.again.theta.tolist(), ((high - low) / 2).tolist(), strict=True))
    for (value, reach), (found, half) in zip(
        told(text), [pair for two in zip(intervals(job), again, strict=True) for pair in two], strict=True
    ):
        assert value == pytest.approx(found, abs=0.06 * half)
        assert reach == pytest.approx(half, rel=0.06)
    assert job.check.explained_share == pytest.approx(0.852, abs=0.001)
