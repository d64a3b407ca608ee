"""A job with uncertain parameters and a robust update: what its summary and its report say."""

import re

import numpy as np
import pytest

PLANT = """
import jax.numpy as jnp

def f(x, u, t, p):
    return jnp.array([p["decay"] * x[0] + u[0]])

def h(x, u, t):
    return x
"""
ROBUST = """
title = "a tank"
update = "masreliez_martin"
[model]
file = "plant.py"
kind = "discrete"
states = { level = "m" }
inputs = { flow = "m" }
outputs = { gauge = "m" }
Q = 1e-4
R = 0.01
parameters = { decay = 0.9 }
[parameters]
decay = { sigma = 0.2, jump = 0.2, bounds = [0.0, 1.0] }
[data]
file = "tank.csv"
inputs.flow = { column = "flow", hold = "next" }
outputs.gauge = "gauge"
[prior]
mean = { level = 0.0 }
std = { level = 0.1 }
"""


def tank(rows=600, jump=400):
    """A level whose decay falls from 0.8 to 0.5, one reading in ten wrong by a metre or so."""
    rng = np.random.default_rng(4)
    lines, level = ["t,flow,gauge"], 0.0
    for k in range(rows):
        flow = float(np.sign(np.sin(0.3 * k)))
        level = (0.8 if k < jump else 0.5) * level + flow if k else 0.0
        error = 0.1 * rng.normal() + (rng.normal() if rng.random() < 0.1 else 0.0)
        lines.append(f"{0.1 * k:.1f},{flow},{level + error}")
    return "\n".join(lines) + "\n"


@pytest.fixture
def robust(project):
    project.config.write_text(ROBUST)
    (project.folder / "plant.py").write_text(PLANT)
    (project.folder / "tank.csv").write_text(tank())
    return project


def cells(printed, name):
    """The numbers and words of the row that begins with a name, in all tables."""
    return [
        [cell.strip() for cell in line.split("\u2502")[1:-1]]
        for line in printed.splitlines()
        if f"\u2502 {name} " in line
    ]


def test_the_summary_tells_of_the_parameters_of_changes_and_of_measurements_not_in_full(robust, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    done = robust.run("estimate", robust.config)
    assert done.code == 0, done.err
    (row,) = cells(done.out, "decay")  # among the states it is logit(decay)
    assert float(row[1]) == 0.9
    assert float(row[2]) == pytest.approx(0.5, abs=0.03)
    lower, upper = (float(end) for end in row[3].split(" to "))
    assert lower < float(row[2]) < upper
    assert 0 < float(row[4].removesuffix(" %")) < 20
    when, way = row[5].split(" ")
    assert way == "down"
    assert 40.0 < float(when) < 46.0
    for head in (
        "at the start",
        "at the end",
        "95 % band",
        "sigma left, %",
        "changes found",
        "not in full, %",
        "below half, %",
    ):
        assert head in done.out
    (row,) = cells(done.out, "gauge")
    clipped, outliers = (float(cell.removesuffix(" %")) for cell in row[4:6])
    # A tenth are outliers, and a quarter of sound ones are beyond the threshold of 1.14 sigmas.
    assert 20 < clipped < 50
    assert 4 < outliers < clipped


def test_with_an_exact_update_the_summary_says_nothing_of_weights_and_without_parameters_nothing_of_them(project):
    done = project.run("estimate", project.config)
    assert "not in full" not in done.out
    assert "below half" not in done.out
    assert "parameters" not in done.out


def test_the_report_has_the_parameters_a_figure_of_weights_and_a_mark_where_a_change_was_found(robust):
    done = robust.run("estimate", robust.config)
    assert done.code == 0, done.err
    page = (robust.folder / "out" / "drive" / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<caption>(.*?)</caption>", page) == ["States", "Parameters", "Measurements"]
    assert re.search(r"<h2[^>]*>Weights</h2>", page)
    assert '"name":"alarm"' in page
