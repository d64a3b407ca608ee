"""`gainful train-aiding`: from records to trained parts, and `gainful estimate` with them."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from gainful.cli.app import app

CONFIG = """
# A ship with fixes every ten seconds; its filter takes the fixes to be five times as noisy as they are.
title = "ship"
filter = "kf"

[model]
file = "ship.py"
function = "model"

[data]
file = "trip.csv"
outputs.fix = "fix"
outputs.log = "log"
truth.place = "place"
truth.speed = "speed"

[prior]
mean = [0.0, 5.0]
std = [10.0, 1.0]

[training]
pieces = 12
held_out = 4
network = "affine"
maps.log = { context = ["speed"], network = { kind = "cmac", levels = 20, layers = 5, compress = "none", epochs = 3 } }
"""
MODEL = """
import gainful as gf


def model():
    return gf.linear_model(
        [[1.0, 10.0], [0.0, 1.0]],
        [[1.0, 0.0], [0.0, 1.0]],
        Q=[1.4**2, 0.02**2],
        R=[0.4**2, 1.0],
        states={"place": "m", "speed": "m/s"},
        outputs={"fix": "m", "log": "m/s"},
    )
"""


def trip(rows: int = 2400) -> pd.DataFrame:
    """A ship whose speed log errs by its speed, the same way each time."""
    rng = np.random.default_rng(8)
    # Speeds that come back again and again, so that there is something to learn.
    speed = 5.0 + 2.0 * np.sin(np.arange(rows) / 40.0) + 0.05 * rng.standard_normal(rows)
    place = np.concatenate([[0.0], np.cumsum(10.0 * speed[:-1])])
    fix = place + 0.08 * rng.standard_normal(rows)
    log = speed + 0.4 * np.sin(2.0 * speed) + 0.05 * rng.standard_normal(rows)
    return pd.DataFrame({"t": 10.0 * np.arange(rows), "fix": fix, "log": log, "place": place, "speed": speed})


def home(folder: Path) -> Path:
    (folder / "ship.toml").write_text(CONFIG)
    (folder / "ship.py").write_text(MODEL)
    trip().to_csv(folder / "trip.csv", index=False)
    return folder / "ship.toml"


def command(*arguments: object):
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """One training, run once."""
    folder = tmp_path_factory.mktemp("ship")
    result = command("train-aiding", home(folder), "--out", folder / "out")
    assert result.exit_code == 0, result.output
    return folder, result.stdout


def test_the_map_and_the_network_are_worth_something_on_the_pieces_held_out(trained) -> None:
    folder, printed = trained
    told = json.loads((folder / "out" / "training.json").read_text())
    log = told["maps"]["log"]
    # An error of amplitude 0.4 goes; what stays is the noise of 0.05 and what the cells are too wide for.
    assert log["before"] == pytest.approx(0.4 / np.sqrt(2), rel=0.2)
    assert log["after"] < 0.4 * log["before"]
    assert "speed" in told["aiding"]["corrected"]
    gain = told["aiding"]["states"]["speed"]
    assert gain["mean_square_with"] < gain["mean_square_without"]
    assert gain["gain"]["low"] > 0
    assert "on the pieces held out" in printed


def test_the_configuration_that_was_written_uses_what_was_trained(trained) -> None:
    folder, printed = trained
    text = (folder / "out" / "aided.toml").read_text()
    assert text.startswith("\n# A ship with fixes every ten seconds")
    assert 'aiding = "aiding.part"' in text
    assert 'sensor_maps = ["map_log.part"]' in text
    assert "[training]" not in text
    line = next(line for line in printed.splitlines() if line.startswith("run it:"))
    result = command(*line.removeprefix("run it:  gainful ").split(), "--out", folder / "aided")
    assert result.exit_code == 0, result.output
    shown = " ".join(result.stdout.split())
    assert "what aiding changed" in shown
    assert "the network was let through in" in shown
    page = (folder / "aided" / "report.html").read_text()
    assert "What the network added to each estimate" in page
    row = next(line for line in result.stdout.splitlines() if "error of speed" in line)
    assert "helped" in row


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("pieces = 12", "pieces = 0", "training.pieces: expected a whole number of at least 1, got 0"),
        ("pieces = 12", "pieces = 9000", "training.pieces: expected fewer than the 2400 rows of the record, got 9000"),
        ("held_out = 4", "held_out = 12", "training.held_out: expected from 2 to 11 of the 12 pieces, got 12"),
        (
            'network = "affine"',
            'network = "affin"',
            "training.network.kind: 'affin' is not known here; did you mean 'affine'?",
        ),
        ('network = "affine"', "features = []", "training.features: expected at least one, got none"),
        ('network = "affine"', 'smoother = "b.toml"', 'training.smoother: has no effect with teacher = "truth"'),
        ('network = "affine"', 'teacher = "tru"', "training.teacher: expected 'truth' or 'smoother', got 'tru'"),
        ("maps.log", "maps.lag", "'lag'"),
        ('context = ["speed"]', 'context = ["sped"]', "did you mean 'speed'?"),
        ("[training]", "[trainings]", "trainings: unknown key; did you mean 'training'?"),
        ('truth.place = "place"\ntruth.speed = "speed"\n', "", "expected"),
    ],
)
def test_what_cannot_be_trained_is_told_and_nothing_is_written(tmp_path, old, new, message) -> None:
    config = home(tmp_path)
    text = config.read_text()
    assert old in text
    config.write_text(text.replace(old, new))
    result = command("train-aiding", config, "--out", tmp_path / "out")
    assert result.exit_code in (1, 2)
    assert message in " ".join(result.stderr.split())
    assert not (tmp_path / "out").exists()


def test_a_configuration_without_a_training_section_is_refused(tmp_path) -> None:
    config = home(tmp_path)
    config.write_text(config.read_text().split("[training]")[0])
    result = command("train-aiding", config, "--out", tmp_path / "out")
    assert "training: missing; what is to be learned, and from which records?" in " ".join(result.stderr.split())


def test_a_training_section_that_asks_for_nothing_is_refused(tmp_path) -> None:
    config = home(tmp_path)
    before, _ = config.read_text().split("[training]")
    config.write_text(f"{before}[training]\naiding = false\n")
    result = command("train-aiding", config, "--out", tmp_path / "out")
    said = "training: expected something to learn, got aiding = false and no maps"
    assert said in " ".join(result.stderr.split())


def test_faults_are_not_trained_with(tmp_path) -> None:
    config = home(tmp_path)
    config.write_text(config.read_text() + '\n[faults]\nstates = [{ kind = "bias", signal = "fix", sigma = 0.1 }]\n')
    result = command("train-aiding", config, "--out", tmp_path / "out")
    said = "training: expected a configuration without [faults], got one with them"
    assert said in " ".join(result.stderr.split())
