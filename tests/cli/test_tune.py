"""`gainful tune`: what it prints, what it writes, and that the tuned configuration has the fitted noise."""

import json
import tomllib

import numpy as np
import pytest

import gainful as gf
from gainful.config import build_filter, build_model, build_prior, load_config
from gainful.config.rewriting import scaled_beneath
from gainful.jobs import tune
from gainful.running.fitting.entries import typical_noise

PLANT = """
import jax.numpy as jnp

def f(x, u, t):
    return jnp.array([x[0] + 0.1 * x[1], x[1]])

def h(x, u, t):
    return jnp.array([x[0], x[0]])

def wide(x, u, t):
    return x[:1]
"""
SHIP = """
title = "a ship"   # of two receivers
filter = "kf"

[model]
file = "plant.py"
kind = "discrete"
states = { s = "m", v = "m/s" }
outputs = { near = "m", far = "m" }
Q = [0.0, 1e-4]    # guessed
R = 0.01           # from the data sheet

[data]
file = "ship.csv"
outputs.near = "near"
outputs.far = "far"
truth.s = "s"

# where it starts
[prior]
mean = { s = 0.0, v = 1.0 }
std = { s = 1.0, v = 1.0 }
"""


def voyage(rows=300):
    """A ship that wanders with 0.05 m/s per step, seen by receivers of 0.1 and 0.4 m."""
    rng = np.random.default_rng(12)
    lines, s, v = ["t,near,far,s"], 0.0, 1.0
    for k in range(rows):
        s, v = (s + 0.1 * v, v + 0.05 * rng.normal()) if k else (s, v)
        far = f"{s + 0.4 * rng.normal()}" if k % 3 else ""
        lines.append(f"{0.1 * k:.1f},{s + 0.1 * rng.normal()},{far},{s}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def ship(project, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    project.config.write_text(SHIP)
    (project.folder / "plant.py").write_text(PLANT)
    (project.folder / "ship.csv").write_text(voyage())
    return project


def noise_of(path):
    """Q and R of a configuration, as its filter uses them."""
    config = load_config(path)
    model = build_model(config.model, path.parent)
    prior = build_prior(config, model)
    log = gf.read_log(model, config.data, path.parent)
    law = build_filter(config, model).noise
    typical = typical_noise(model, prior, log)
    memory = law.init(model)
    return np.asarray(law.process(memory, typical.process)), np.asarray(law.measurement(memory, typical.measurement))


def test_the_tuned_configuration_keeps_its_comments_runs_and_has_the_fitted_noise(ship):
    done = ship.run("tune", ship.config)
    assert done.code == 0, done.err
    for words in ("noise (sigma)", "R  near", "held out", "before: not consistent", "after: consistent", "run it:"):
        assert words in done.out
    folder = ship.folder / "out" / "drive"
    text = (folder / "tuned.toml").read_text()
    tuned = tomllib.loads(text)
    for comment in ("# of two receivers", "# guessed", "# from the data sheet", "# where it starts\n[prior]"):
        assert comment in text
    assert (tuned["model"]["file"], tuned["data"]["folder"]) == ("../../plant.py", "../..")
    assert "noise" not in tuned
    told = json.loads((folder / "tune.json").read_text())
    sigmas = {each["names"][0]: each["fitted"][0] for each in told["entries"]}
    # The file has six digits.
    np.testing.assert_allclose(tuned["model"]["Q"], [0.0, sigmas["v"] ** 2], rtol=1e-5)
    np.testing.assert_allclose(tuned["model"]["R"], [sigmas["near"] ** 2, sigmas["far"] ** 2], rtol=1e-5)
    # 300 and 200 readings: errors of 4 and 5 %, of the wandering some 15 %; three of each.
    np.testing.assert_allclose([sigmas["near"], sigmas["far"]], [0.1, 0.4], rtol=0.15)
    assert sigmas["v"] == pytest.approx(0.05, rel=0.45)
    assert told["log_likelihood_per_row"]["held_out"]["after"] > told["log_likelihood_per_row"]["held_out"]["before"]
    assert ship.run("estimate", folder / "tuned.toml").code == 0


def test_noise_from_functions_catalogue_models_and_filters_is_scaled_in_a_section_of_its_own(project, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    project.change('filter = "ekf"', 'filter = { kind = "assembled", noise = "nominal" }  # own')
    done = project.run("tune", project.config, "--held-out", "0", "--only", "measured_x,measured_y", "--out", "tuned")
    assert done.code == 0, done.err
    assert "held out" not in done.out
    tuned = project.folder / "tuned" / "tuned.toml"
    section = tomllib.loads(tuned.read_text())["noise"]
    assert section["kind"] == "scaled"
    assert section["outputs"]["measured_x"] == section["outputs"]["measured_y"]
    assert "states" not in section
    before, after = noise_of(project.config), noise_of(tuned)
    np.testing.assert_allclose(after[1], section["outputs"]["measured_x"] ** 2 * before[1], rtol=1e-9)
    np.testing.assert_allclose(after[0], before[0], rtol=1e-12)
    again = project.run("tune", tuned, "--held-out", "0", "--only", "measured_x,measured_y", "--out", "again")
    assert again.code == 0, again.err
    twice = tomllib.loads((project.folder / "again" / "tuned.toml").read_text())["noise"]
    # Fitted once more, next to nothing changes.
    assert twice["outputs"]["measured_x"] == pytest.approx(section["outputs"]["measured_x"], rel=1e-2)


def test_sensors_densities_and_walks_are_changed_where_they_stand(ship):
    ship.change('kind = "discrete"', 'kind = "continuous"\nh = ""')
    ship.change('outputs = { near = "m", far = "m" }\n', "")
    ship.change("R = 0.01           # from the data sheet\n", "")
    ship.change(
        "[data]", '[model.sensors.near]\nh = "wide"\nR = 0.01\n[model.sensors.far]\nh = "wide"\nR = [0.01]\n\n[data]'
    )
    plant = (ship.folder / "plant.py").read_text().replace("[x[0] + 0.1 * x[1], x[1]]", "[x[1], 0.0]")
    (ship.folder / "plant.py").write_text(plant)
    done = ship.run("tune", ship.config)
    assert done.code == 0, done.err
    tuned = tomllib.loads((ship.folder / "out" / "drive" / "tuned.toml").read_text())
    fit = json.loads((ship.folder / "out" / "drive" / "tune.json").read_text())
    factor = {"+".join(each["names"]): each["factor"] for each in fit["entries"]}
    assert tuned["model"]["Q"] == pytest.approx([0.0, 1e-4 * factor["s+v"] ** 2], rel=1e-5)
    assert tuned["model"]["sensors"]["near"]["R"] == pytest.approx(0.01 * factor["near"] ** 2, rel=1e-5)
    assert tuned["model"]["sensors"]["far"]["R"] == pytest.approx([0.01 * factor["far"] ** 2], rel=1e-5)
    assert "noise" not in tuned
    # The fitted filter and the one of the tuned file have the same noise.
    model = build_model(load_config(ship.config).model, ship.folder)
    job = tune(ship.config)
    found = job.fit.estimator.noise
    log = gf.read_log(model, load_config(ship.config).data, ship.folder)
    typical = typical_noise(model, build_prior(load_config(ship.config), model), log)
    memory = found.init(model)
    q, r = noise_of(ship.folder / "out" / "drive" / "tuned.toml")
    np.testing.assert_allclose(q, found.process(memory, typical.process), rtol=1e-5)
    np.testing.assert_allclose(r, found.measurement(memory, typical.measurement), rtol=1e-5)


def test_what_is_frozen_stays_as_it_was_written(ship):
    done = ship.run("tune", ship.config, "--freeze", "Q.v", "--freeze", "far", "--method", "em", "--floor", "0.01")
    assert done.code == 0, done.err
    tuned = tomllib.loads((ship.folder / "out" / "drive" / "tuned.toml").read_text())
    assert tuned["model"]["Q"] == [0.0, 1e-4]
    near, far = tuned["model"]["R"]
    assert (near != 0.01, far) == (True, 0.01)


def test_the_walk_of_a_parameter_is_changed_where_it_stands(ship):
    plant = (
        (ship.folder / "plant.py")
        .read_text()
        .replace(
            "(x, u, t):\n    return jnp.array([x[0], x[0]])",
            "(x, u, t, p):\n    return p['scale'] * jnp.array([x[0], x[0]])",
        )
    )
    (ship.folder / "plant.py").write_text(plant)
    ship.change(
        "[data]",
        "parameters = { scale = 1.0 }\n\n[parameters]\nscale = { sigma = 0.01, walk = 0.001 } # drifts\n\n[data]",
    )
    done = ship.run("tune", ship.config, "--only", "scale", "--floor", "0.5")
    assert done.code == 0, done.err
    tuned = tomllib.loads((ship.folder / "out" / "drive" / "tuned.toml").read_text())
    told = json.loads((ship.folder / "out" / "drive" / "tune.json").read_text())
    assert tuned["parameters"]["scale"]["walk"] == pytest.approx(0.001 * told["entries"][0]["factor"], rel=1e-5)
    assert told["changes"] == ["parameters.scale.walk"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "s", "--freeze", "v"], "only, freeze: expected one of them, got both"),
        (["--only", "nier"], "'nier' is no state or output of the model; did you mean 'near'?"),
        (["--only", "v,near"], "only: expected names of states or of outputs, got both in 'v,near'"),
        (["--method", "mll"], "method: 'mll' is not known; did you mean 'ml'?"),
        (["--held-out", "1.5"], "held_out: expected a share from 0 to below 1, or records, got 1.5"),
        (["--only", "s"], "process: the model has no noise for 's'"),
    ],
)
def test_wrong_options_are_one_line_and_leave_nothing(ship, arguments, words):
    done = ship.run("tune", ship.config, *arguments)
    assert done.code == 2
    assert words in done.err
    assert not (ship.folder / "out").exists()


def test_a_name_of_a_state_and_of_an_output_must_say_which(ship):
    ship.change('near = "m", far', 's = "m", far')
    ship.change("outputs.near =", "outputs.s =")
    done = ship.run("tune", ship.config, "--freeze", "s")
    assert (done.code, "'s' is a state and an output; write Q.s or R.s" in done.err) == (2, True)


def test_scaled_noise_goes_beneath_what_a_noise_law_does():
    law = {"kind": "capped", "limits": {"v": 1.0}, "inner": {"kind": "scaled", "states": {"v": 2.0}}}
    assert scaled_beneath(law, {"v": 3.0}, {"y": 0.5}) == law | {
        "inner": {"kind": "scaled", "states": {"v": 6.0}, "outputs": {"y": 0.5}}
    }
    assert scaled_beneath("sage_husa", {}, {"y": 0.5}) == {
        "kind": "sage_husa",
        "inner": {"kind": "scaled", "outputs": {"y": 0.5}},
    }
