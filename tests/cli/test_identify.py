"""`gainful identify`: from a log to parameters with intervals, and what a newcomer gets wrong."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from gainful.cli.app import app
from gainful.plants import fourier_excitation

CONFIG = """
title = "yaw"

[signals]
r = "rad/s"
tau = "N*m"

[equation]
of = "tau"
terms.inertia = "d(r)"
terms.linear = "r"
terms.quadratic = "r*abs(r)"

[data]
file = "yaw.csv"
signals.r = [{ column = "gyro_a", unit = "deg/s" }, { column = "gyro_b", unit = "deg/s" }]
signals.tau = "torque"
"""
TRUTH = {"inertia": 0.28, "linear": 0.07, "quadratic": 1.55}


def record() -> pd.DataFrame:
    """A vehicle that turns to and fro for 60 s; the gyros read degrees."""
    rng, t = np.random.default_rng(5), 0.05 * np.arange(1200)
    _, rate, acceleration = map(np.asarray, fourier_excitation([0.0, 0.3, 0.1], [0.3, 0.0, -0.2], 8.0, t))
    torque = np.stack([acceleration, rate, rate * np.abs(rate)], axis=1) @ np.array(list(TRUTH.values()))
    gyros = np.degrees(rate[:, None] + 0.03 * rng.standard_normal((1200, 2)))
    columns = {
        "t": t,
        "gyro_a": gyros[:, 0],
        "gyro_b": gyros[:, 1],
        "torque": torque + 0.05 * rng.standard_normal(1200),
    }
    return pd.DataFrame(columns).round(4)


@pytest.fixture
def yaw(project):
    """The project's folder with an identification in it."""
    project.config = project.folder / "yaw.toml"
    project.config.write_text(CONFIG)
    record().to_csv(project.folder / "yaw.csv", index=False)
    return project


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """One identification, run once."""
    home: Path = tmp_path_factory.mktemp("yaw")
    (home / "yaw.toml").write_text(CONFIG)
    record().to_csv(home / "yaw.csv", index=False)
    result = CliRunner().invoke(app, ["identify", str(home / "yaw.toml"), "--out", str(home / "out")])
    assert result.exit_code == 0, result.output
    return home / "out", result.stdout


def test_the_truth_is_in_the_intervals_and_the_units_follow_from_the_terms(done) -> None:
    found = json.loads((done[0] / "identification.json").read_text())
    assert found["method"] == "weak-iv"
    for name, truth in TRUTH.items():
        one = found["parameters"][name]
        assert abs(one["value"] - truth) < 4 * one["std"]
        assert one["low"] < one["value"] < one["high"]
    assert [found["parameters"][name]["unit"] for name in TRUTH] == ["kg*m^2", "kg*m^2/s", "kg*m^2"]
    assert found["noise"]["r"] * np.sqrt(2) == pytest.approx(0.03, rel=0.1)
    assert found["checks"]["weak-iv"]["simulated_share"] > 0.95
    assert found["identifiability"]["rows"] == 840 - 14


def test_numbers_never_come_alone(done) -> None:
    _, printed = done
    table = printed[printed.index("inertia") :]
    assert "±" in table.splitlines()[0]
    assert "rows kept back the terms explain" in " ".join(printed.split())
    assert "taken for granted: the instruments know nothing of the noise" in " ".join(printed.split())
    assert {"weak-iv", "weak-ls", "weak-gtls", "ls", "tls", "iv", "gtls"} <= set(printed.replace("│", " ").split())


def test_the_rows_left_behind_hold_both_parts(done) -> None:
    rows = pd.read_parquet(done[0] / "rows.parquet")
    assert rows["kept_back"].sum() == 360
    assert {"t", "measured", "explained", "r", "simulated_r"} <= set(rows.columns)


def test_the_report_names_the_equation_and_its_assumptions(done) -> None:
    page = (done[0] / "report.html").read_text()
    assert "tau = inertia · d(r) + linear · r + quadratic · r*abs(r)" in page
    assert "Taken for granted" in page
    assert "Methods side by side" in page


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[equation]", "[equatoin]", "equatoin: unknown key; did you mean 'equation'?"),
        ('terms.linear = "r"', 'terms.linear = "rr"', "equation.linear: 'rr': 'rr' is not a signal; did you mean 'r'?"),
        ('title = "yaw"', 'method = "gls"', "method: 'gls' is not known; did you mean"),
        ('column = "gyro_a"', 'column = "gyro_c"', "did you mean 'gyro_"),
        ('file = "yaw.csv"', 'file = "jaw.csv"', "not found; did you mean 'yaw.csv'?"),
        ('signals.tau = "torque"', "", "data.signals: the equation's 'tau' has no column"),
        (
            'signals.tau = "torque"',
            'signals.tau = "torque"\nnoise.tua = 1.0',
            "data.noise: 'tua' is not a signal; did you mean 'tau'?",
        ),
        (
            'signals.tau = "torque"',
            'signals.tau = "torque"\n[check]\nshare = 1.0',
            "check.share: expected a number of at least 0 and below 1",
        ),
        (
            'signals.tau = "torque"',
            'signals.tau = "torque"\n[check]\nshare = 0.5\nfile = "b.csv"',
            "check: expected a share of the recording or another one, got both",
        ),
        (
            'signals.tau = "torque"',
            'signals.tau = "torque"\n[options]\nwindow = 4',
            "window: expected an odd number of samples",
        ),
        ('tau = "N*m"', 'tau = "Newtn"', "signal 'tau': 'Newtn' is not a unit"),
        ('terms.linear = "r"', 'terms.linear = "r + tau"', "linear: 'r + tau': units do not fit"),
        (
            'r = "rad/s"',
            'r = "rad/s"\nsin = "1"',
            "signals: expected names such as 'rate' that no function has, got 'sin'",
        ),
        ('of = "tau"', 'of = "tau"\nfile = "terms.py"', "equation.file:"),
        ('file = "yaw.csv"', 'file = "yaw.csv"\ndt = -1.0', "dt: expected a time above 0 s, got -1.0"),
        (
            'file = "yaw.csv"',
            'file = "yaw.csv"\ntime = ""',
            "time: expected a column, or dt for rows that are equally spaced",
        ),
        (
            'file = "yaw.csv"',
            'file = "yaw.csv"\nresample = "cubic"',
            "data.resample: expected 'none' or 'linear', got 'cubic'",
        ),
        ('file = "yaw.csv"', 'file = "yaw.csv"\ndt = 0.03', "signal 'r': expected samples every 0.03 s"),
        (
            'file = "yaw.csv"',
            'file = "yaw.csv"\nstop = 0.06',
            "expected at least 3 rows that all have in common, got 2",
        ),
        (
            'file = "yaw.csv"',
            'file = "yaw.csv"\nstop = 0.01',
            "signal 'r': expected at least two values between start and stop, got 1",
        ),
    ],
)
def test_what_a_newcomer_gets_wrong_is_told_and_nothing_is_written(yaw, old, new, message) -> None:
    yaw.change(old, new)
    result = yaw.run("identify", yaw.config)
    assert result.code in (1, 2)
    assert message in " ".join(result.err.split())
    assert not (yaw.folder / "out").exists()


def test_a_second_log_is_held_against_the_parameters_of_the_first(yaw) -> None:
    record().iloc[:700].to_csv(yaw.folder / "second.csv", index=False)
    yaw.change('signals.tau = "torque"', 'signals.tau = "torque"\n[check]\nfile = "second.csv"')
    result = yaw.run("identify", yaw.config, "--out", yaw.folder / "out")
    assert result.code == 0, result.err
    assert "on 700 rows kept back" in " ".join(result.out.split())


def test_uneven_samples_are_interpolated_where_asked(yaw) -> None:
    table = record()
    table["t"] += np.where(np.arange(len(table)) % 2, 0.01, 0.0)
    table.to_csv(yaw.folder / "yaw.csv", index=False)
    refused = yaw.run("identify", yaw.config)
    assert 'resample = "linear" interpolates' in " ".join(refused.err.split())
    yaw.change('file = "yaw.csv"', 'file = "yaw.csv"\ndt = 0.05\nresample = "linear"\n')
    yaw.change('title = "yaw"', 'title = "yaw"\nmethod = "weak-ls"')
    result = yaw.run("identify", yaw.config, "--out", yaw.folder / "out")
    assert result.code == 0, result.err


def test_terms_may_call_functions_of_a_file(yaw) -> None:
    (yaw.folder / "terms.py").write_text("import jax.numpy as jnp\n\n\ndef damping(r):\n    return r * jnp.abs(r)\n")
    yaw.change('of = "tau"', 'of = "tau"\nfile = "terms.py"')
    yaw.change('"r*abs(r)"', '"damping(r)"')
    yaw.change('title = "yaw"', 'title = "yaw"\nmethod = "weak-ls"')
    result = yaw.run("identify", yaw.config, "--out", yaw.folder / "out")
    assert result.code == 0, result.err
    found = json.loads((yaw.folder / "out" / "identification.json").read_text())
    assert found["parameters"]["quadratic"]["unit"] == ""
    assert found["parameters"]["quadratic"]["value"] == pytest.approx(1.55, rel=0.1)


NETWORK = """
title = "valve"

[signals]
y = "m"
u = "1"

[network]
kind = "KIND"
of = "y"
lags = 1
inputs.u = 1
random_walk = 1e-6

[data]
file = "valve.csv"
time = ""
dt = 0.1
signals = { y = "y", u = "u" }
"""


def test_a_network_is_held_against_the_linear_equation(project) -> None:
    rng = np.random.default_rng(2)
    u, y = rng.uniform(-1.0, 1.0, 300), np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.6 * y[k - 1] + np.sin(2.0 * u[k]) - 0.4 * u[k] * y[k - 1]
    pd.DataFrame({"y": y, "u": u}).to_csv(project.folder / "valve.csv", index=False)
    (project.folder / "net.toml").write_text(NETWORK.replace("KIND", "rbf"))
    result = CliRunner().invoke(
        app, ["identify", str(project.folder / "net.toml"), "--out", str(project.folder / "net")]
    )
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    assert "rbf of 53 weights; on 90 rows kept back it explains" in words
    found = json.loads((project.folder / "net" / "identification.json").read_text())
    assert found["network"]["told"] == ["u", "lag(y)"]
    assert found["check"]["simulated_share"] > 0.95 > found["linear"]["ls"]["simulated_share"]
    assert found["adapted"]["explained_share"] > 0.95
    rows = pd.read_parquet(project.folder / "net" / "rows.parquet")
    assert rows["kept_back"].sum() == 90
    page = (project.folder / "net" / "report.html").read_text()
    assert "y = lag(y) + rbf(u, lag(y))" in page
    assert "rbf, learning on" in page


def test_a_network_where_a_line_would_do_is_told_so(project) -> None:
    u = np.random.default_rng(2).normal(size=300)
    y = np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.6 * y[k - 1] + u[k]
    pd.DataFrame({"y": y + 0.01 * np.cos(np.arange(300) ** 2), "u": u}).to_csv(
        project.folder / "valve.csv", index=False
    )
    (project.folder / "net.toml").write_text(NETWORK.replace("KIND", "bilinear"))
    result = CliRunner().invoke(
        app, ["identify", str(project.folder / "net.toml"), "--out", str(project.folder / "net")]
    )
    assert result.exit_code == 0, result.output
    assert "nothing here asks for a network" in " ".join(result.output.split())
