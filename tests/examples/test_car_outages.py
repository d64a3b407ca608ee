"""The README on outages says what comes of cutting them into the record."""

import re

import numpy as np
import pytest

from gainful.jobs import estimate

from .test_examples import EXAMPLES, recorded

FOLDER = EXAMPLES / "car_outages"
SCRIPT = FOLDER / "outages.py"
README = (FOLDER / "README.md").read_text(encoding="utf-8")
ONE_PROGRAM = ("no wheels, nothing learned", "wheels, nothing learned", "wheels, wheel offset")
OTHERS = "half a minute of maps for all rows; --full tries them"


@pytest.fixture(scope="module")
def drive(script):
    return script.Drive(recorded("car_comma2k19"))


@pytest.fixture(scope="module")
def table(script, drive, request):
    names = tuple(script.CONTENDERS) if request.config.getoption("--full") else ONE_PROGRAM
    return script.errors(drive, names)


def rows(first: str) -> dict[str, list[list[float]]]:
    """A table of the README whose second head is `first`: numbers of each cell by the row's name."""
    part = README.split(f"| | {first} |", 1)[1].split("\n\n", 1)[0]
    found = re.findall(r"^\| ([a-z][^|]*) \|(.*)\|$", part, re.M)
    assert found
    return {
        name: [[float(x) for x in re.findall(r"-?\d+\.\d+", cell)] for cell in cells.split("|")]
        for name, cells in found
    }


def test_the_errors_over_the_outages_are_those_of_the_readme(script, table):
    told = rows("at its start")
    assert list(told) == list(script.CONTENDERS)
    found = script.spread(table)
    for name in dict.fromkeys(table.contender):
        for after, cell in zip(script.AFTER, told[name], strict=True):
            values = found.loc[(name, after)]
            assert cell == pytest.approx(values.tolist()[: len(cell)], abs=0.006)


def test_the_differences_are_those_of_the_readme_and_of_independent_outages_only(script, table):
    there = set(table.contender)
    pairs = {tuple(name.split(" - ")): cells for name, cells in rows("5 s").items()}
    assert set(pairs) == set(script.PAIRS)
    for (first, second), cells in pairs.items():
        if {first, second} <= there:
            for after, (mean, half, share) in zip(script.AFTER[1:], cells, strict=True):
                found = script.difference(table, first, second, after)
                assert [mean, half] == pytest.approx(found[:2], abs=0.006)
                assert share == pytest.approx(max(found[2], 1 - found[2]), abs=0.006)


def test_wheels_help_and_their_learned_offset_helps_beyond_chance_at_5_s(script, table):
    mean, half, share = script.difference(table, "wheels, nothing learned", "wheels, wheel offset", 5.0)
    assert mean - half > 0
    assert share == 1.0
    _, _, share = script.difference(table, "no wheels, nothing learned", "wheels, nothing learned", 20.0)
    assert share == 1.0


def test_a_map_learned_before_an_outage_knows_nothing_after_it(script, drive):
    learned, report = drive.learned_map(20.0, script.AffineTraining())
    rows_before = int(np.sum((drive.log.t >= 1.0 + drive.log.t[0]) & (drive.log.t < 20.0) & drive.log.seen[:, 3]))
    assert report.training.samples == rows_before
    # The wheels read 0.13 m/s too little on the whole record.
    assert -0.3 < float(learned.error(np.array([15.0]))) < 0.0


def test_one_outage_from_its_configuration_is_that_of_the_script(script, drive, tmp_path):
    folder = recorded("car_comma2k19")
    text = (FOLDER / "outage.toml").read_text().replace('folder = "data"', f'folder = "{folder}"')
    path = tmp_path / "outage.toml"
    path.write_text(text.replace('file = "../car/car.py"', f'file = "{EXAMPLES / "car" / "car.py"}"'))
    job = estimate(path)
    own = drive.run(script.CONTENDERS["wheels, gyro, mount and wheel offset"], 25.0)
    found = script.position_errors(job.result, 25.0)
    # Two scales that are known to be none change rounding alone.
    assert found == pytest.approx(script.position_errors(own, 25.0), abs=1e-6)
    assert job.result.log.counts["course left out in an outage"] > 190
