"""Examples of `gainful train-aiding`: what it leaves goes into `gainful estimate`, and the READMEs say what comes of it."""

import re

import numpy as np
import pytest

from gainful.diagnostics import rmse
from gainful.jobs import aiding_gain_rows, estimate, train, tune

from .test_examples import EXAMPLES, position_error


@pytest.fixture(scope="module")
def ship(tmp_path_factory):
    """The training, the folder it left, and the estimation with it."""
    folder = tmp_path_factory.mktemp("ship")
    job = train(EXAMPLES / "ship" / "ship.toml", folder / "trained")
    return job, folder / "trained", estimate(folder / "trained" / "aided.toml")


def told(row: str) -> list[float]:
    text = (EXAMPLES / "ship" / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"^\| {re.escape(row)} \| ([\d.]+) \| ([\d.]+) \|$", text, re.M)
    assert found
    return [float(each) for each in found.groups()]


def errors(job) -> list[float]:
    found = rmse(job.result)
    return [found["place"], found["speed"]]


def close(found: list[float], row: str) -> None:
    """Rounded to the digits of the README."""
    place, speed = told(row)
    assert found[0] == pytest.approx(place, abs=0.006)
    assert found[1] == pytest.approx(speed, abs=0.0006)


def test_the_ships_configuration_with_trained_parts_names_both(ship):
    job, folder, _ = ship
    text = (folder / "aided.toml").read_text(encoding="utf-8")
    shown = (EXAMPLES / "ship" / "README.md").read_text(encoding="utf-8")
    for line in ('sensor_maps = ["map_log.part"]', 'aiding = "aiding.part"'):
        assert line in text
        assert line in shown
    assert all((folder / name).is_file() for name in job.files)


def test_the_ships_errors_are_those_of_the_readme(ship, tmp_path):
    close(errors(ship[2]), "the same after `gainful train-aiding`")
    close(errors(estimate(EXAMPLES / "ship" / "ship.toml")), "`gainful estimate ship.toml`")
    tune(EXAMPLES / "ship" / "ship.toml", tmp_path / "tuned")
    close(errors(estimate(tmp_path / "tuned" / "tuned.toml")), "the same after `gainful tune`")


def test_the_ships_parts_are_worth_something_on_pieces_that_they_were_not_learned_from(ship):
    job = ship[0]
    log = job.maps["log"]
    # The noise of the log is 0.05 m/s; what the map leaves is that and the width of its cells.
    assert log.before == pytest.approx(0.245, abs=6e-4)
    assert log.after == pytest.approx(0.052, abs=6e-4)
    assert job.aiding is not None
    np.testing.assert_allclose(np.sqrt(job.aiding.base), [2.65, 0.115], rtol=0.005)
    np.testing.assert_allclose(np.sqrt(job.aiding.aided), [1.18, 0.046], rtol=0.005)
    assert all(job.aiding.accepted)


def test_the_report_of_the_ship_says_that_aiding_helped(ship):
    _, rows = aiding_gain_rows(ship[2])
    assert {row[0]: row[-1] for row in rows}["error of place"] == "helped"


def test_the_rovers_maps_are_worth_what_the_readme_says(tmp_path):
    job = train(EXAMPLES / "rover" / "rover_maps.toml", tmp_path / "maps")
    assert job.aiding is None
    np.testing.assert_allclose([each.before for each in job.maps.values()], [3.2, 3.9, 1.7, 2.8], atol=0.06)
    np.testing.assert_allclose([each.after for each in job.maps.values()], [1.5, 2.4, 1.1, 2.3], atol=0.06)
    result = estimate(tmp_path / "maps" / "aided.toml").result
    assert result.filtered is not None
    assert position_error(result.filtered) == pytest.approx(1.51, abs=0.006)
    assert position_error(result) == pytest.approx(1.52, abs=0.006)
