"""`gainful estimate`: three files on success; on failure one line, an exit code, and nothing else."""

import os
import re
import resource
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import gainful as gf
from gainful.cli import main

from .conftest import command

FILES = ["estimates.parquet", "report.html", "result.nc"]
PLANT = """
import jax.numpy as jnp

def f(x, u, t):
    return jnp.where(t > 20, jnp.nan, 1.0) * x

def h(x, u, t):
    return x
"""
FAULTY = """
[model]
file = "plant.py"
kind = "discrete"
states = { s = "m" }
outputs = { fix = "m" }
Q = 0.1
R = 1.0
[data]
file = "drive.csv"
outputs.fix = "y_m"
[prior]
mean = [0.0]
std = [1.0]
"""


def test_a_run_leaves_three_files_and_prints_states_verdict_and_place(project):
    done = project.run("estimate", project.config)
    assert done.code == 0, done.err
    assert done.err == ""
    assert project.left == ["out"]
    assert sorted(path.name for path in (project.folder / "out" / "drive").iterdir()) == FILES
    for word in ("a drive", "heading", "measured_x", "consistent: ", "120 rows", "wrote out/drive/report.html"):
        assert word in done.out
    table = pd.read_parquet(project.folder / "out" / "drive" / "estimates.parquet")
    # The units of four columns were converted, or the vehicle would not be on its circle.
    angle = 0.1 * table.index.to_numpy()
    assert np.abs(table["x"] - 10 * np.sin(angle))[20:].max() < 1.0
    assert np.abs(table["heading"] - angle)[20:].max() < 0.2
    assert table["status"].value_counts().to_dict() == {0: 114, 1: 6}


def test_files_are_found_from_the_configuration_and_results_go_to_the_working_directory(project, tmp_path, monkeypatch):
    (tmp_path / "away").mkdir()
    monkeypatch.chdir(tmp_path / "away")
    assert project.run("estimate", os.path.relpath(project.config)).code == 0
    assert [path.name for path in (tmp_path / "away" / "out").iterdir()] == ["drive"]
    assert project.run("estimate", "../home/drive.toml", "--out", "here/there").code == 0
    assert sorted(path.name for path in (tmp_path / "away" / "here" / "there").iterdir()) == FILES
    assert project.left == []


def test_an_older_result_is_replaced_by_a_good_run_and_survives_a_bad_one(project):
    out = project.folder / "out" / "drive"
    out.mkdir(parents=True)
    for name in [*FILES, "notes.txt"]:
        (out / name).write_text("old")
    project.change('"y_m"', '"y_mm"')
    assert project.run("estimate", project.config).code == 1
    assert {path.name: path.read_text() for path in out.iterdir()} == dict.fromkeys([*FILES, "notes.txt"], "old")
    project.change('"y_mm"', '"y_m"')
    assert project.run("estimate", project.config).code == 0
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "notes.txt"])
    assert (out / "notes.txt").read_text() == "old"
    assert all((out / name).stat().st_size > 1000 for name in FILES)


# What is wrong: what to replace by what in the configuration, the exit code, and the whole line.
MISTAKES = {
    "a typo in a key": (
        "filter =",
        "filtr =",
        2,
        "configuration drive.toml: filtr: unknown key; did you mean 'filter'?",
    ),
    "a typo in a section": ("[prior]", "[priors]", 2, "priors: unknown key; did you mean 'prior'?"),
    "no section": ("[prior]", "[data.prior]", 2, "prior: missing"),
    "a typo in the filter": ('"ekf"', '"efk"', 2, "filter.kind: 'efk' is not a filter; did you mean 'ekf'?"),
    "a typo in the catalogue": (
        "planar_v",
        "planer_v",
        2,
        "model.catalogue: 'planer_vehicle' is not known; did you mean",
    ),
    "a typo in an argument": ("position_s", "positon_s", 2, "has no such argument; did you mean 'position_sigma'?"),
    "a typo in a signal": (
        "measured_y",
        "mesured_y",
        2,
        "outputs: 'mesured_y' is not a signal of the model; did you mean",
    ),
    "a typo in a state": (
        "heading = 0.0",
        "headin = 0.0",
        2,
        "prior mean: 'headin' is not a state of the model; did you",
    ),
    "a number as text": ("x = 1.0", 'x = "one"', 2, "prior.std.x: expected a number or a list of numbers, got 'one'"),
    "a negative sigma": ("x = 1.0", "x = -1.0", 2, "prior std of 'x': expected at least 0, got -1"),
    "no TOML": ("title =", "title", 2, "not valid TOML"),
    "a missing data file": ("drive.csv", "drives.csv", 1, "drives.csv: not found; did you mean 'drive.csv'?"),
    "a wrong column": ('"y_m"', '"y_mm"', 1, "drive.csv: no column 'y_mm'; did you mean 'y_m'?"),
    "a unit that does not convert": (
        '"km/h"',
        '"km"',
        1,
        "signal 'speed': expected a unit that converts to 'm/s', got 'km'",
    ),
    "a file that is no log": ("drive.csv", "drive.toml", 1, "expected one of .csv"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_answered_with_one_line_and_an_exit_code_and_nothing_is_written(project, case):
    old, new, code, message = MISTAKES[case]
    project.change(old, new)
    done = project.run("estimate", project.config)
    assert done.code == code
    assert done.out == ""
    assert done.err.startswith("error: ")
    assert done.err.count("\n") == 1
    assert message in done.err
    assert project.left == []


def test_a_missing_configuration_is_answered_with_the_nearest(project):
    done = project.run("estimate", "drives.toml")
    assert done.code == 2
    assert done.err == "error: configuration drives.toml: not found; did you mean 'drive.toml'?\n"
    done = project.run("estimate", ".")
    assert done.code == 2
    assert done.err == "error: configuration .: expected a file, got a folder; there is drive.toml in it\n"


def test_text_in_the_log_is_answered_with_its_place(project):
    log = project.folder / "drive.csv"
    lines = log.read_text().splitlines()
    lines[8] = lines[8].replace(",3.6,", ",fast,")
    log.write_text("\n".join(lines))
    done = project.run("estimate", project.config)
    assert done.code == 1
    assert "drive.csv: column 'speed_kmh' expected numbers, got 'fast' in data row 7" in done.err


def test_brackets_and_emoji_codes_in_a_message_come_out_as_they_are(project):
    strange = "y [m] [red]:smile: \\[b]"
    project.change('"y_m"', f"'{strange}'")
    assert repr(strange) in project.run("estimate", project.config).err


def test_brackets_in_titles_and_folders_come_out_as_they_are(project):
    project.change('"a drive"', '"a [red]drive[/red] :smile:"')
    done = project.run("estimate", project.config, "--out", "run [1]")
    assert done.code == 0, done.err
    assert "a [red]drive[/red] :smile:" in done.out
    assert "wrote run [1]/report.html" in done.out


def test_a_numerical_failure_is_told_with_row_time_and_cause_and_nothing_is_written(project):
    (project.folder / "plant.py").write_text(PLANT)
    project.config.write_text(FAULTY)
    done = project.run("estimate", project.config)
    assert done.code == 1
    assert re.fullmatch(
        r"error: row 81 at t = 20\.25 s: the predicted or updated estimate is not finite\. "
        r"f returned nan in 's' from the state s = [-\d.]+; 38 later rows failed too\n",
        done.err,
    )
    assert project.left == []
    project.config.write_text(FAULTY + "[options]\nthrow = false\n")
    done = project.run("estimate", project.config)
    assert done.code == 0
    assert "not consistent: " in done.out
    assert "39 of 120 rows failed" in " ".join(done.out.split())


def test_a_mistake_in_the_models_file_is_told_with_its_line(project):
    (project.folder / "plant.py").write_text(PLANT.replace("return x", "return z"))
    project.config.write_text(FAULTY)
    done = project.run("estimate", project.config)
    assert (done.code, done.err) == (1, "error: h: failed at plant.py line 8: NameError: name 'z' is not defined\n")
    (project.folder / "plant.py").write_text("import no_such_module\n")
    done = project.run("estimate", project.config)
    assert done.code == 2
    assert "plant.py line 1: ModuleNotFoundError: No module named 'no_such_module'" in done.err
    assert project.left == []


def test_a_stop_by_the_user_is_one_line_and_leaves_nothing(project, monkeypatch):
    def stopped(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["gainful.jobs.estimate"], "run", stopped)
    done = project.run("estimate", project.config)
    assert (done.code, done.out, done.err) == (1, "", "stopped; nothing was written\n")
    assert project.left == []


def test_an_output_folder_that_cannot_be_is_told_before_the_run(project, monkeypatch):
    def never(*arguments, **options):
        raise AssertionError("the filter ran")

    monkeypatch.setattr(sys.modules["gainful.jobs.estimate"], "run", never)
    for place in ("drive.csv", "drive.csv/deeper"):
        done = project.run("estimate", project.config, "--out", place)
        assert done.code == 1
        assert f"output folder {place}: a file of that name is in the way" in done.err
    assert project.left == []


def test_a_failure_while_writing_the_last_file_leaves_the_older_result(project, monkeypatch):
    out = project.folder / "out" / "drive"
    out.mkdir(parents=True)
    for name in FILES:
        (out / name).write_text("old")

    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys.modules["gainful.jobs.estimate"], "write_report", full)
    done = project.run("estimate", project.config)
    assert done.code == 1
    assert done.err == (
        "error: output folder out/drive: cannot be written: No space left on device; nothing was left half-written\n"
    )
    assert {path.name: path.read_text() for path in out.iterdir()} == dict.fromkeys(FILES, "old")
    assert project.left == ["out"]


def test_files_that_may_not_grow_are_told_and_the_older_result_survives(project):
    out = project.folder / "out"
    out.mkdir()
    (out / "report.html").write_text("old")

    def small_files_only():
        resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))

    done = command("estimate", project.config, "--out", out, cwd=project.folder, preexec_fn=small_files_only)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "cannot be written: File too large; nothing was left half-written" in done.stderr
    assert [path.name for path in out.iterdir()] == ["report.html"]
    assert (out / "report.html").read_text() == "old"


@pytest.mark.slow
def test_a_disk_that_is_full_is_told_and_the_older_result_survives(project):
    disk = project.folder / "disk"
    disk.mkdir()
    mount = f"mount -t tmpfs -o size=600k tmpfs '{disk}'"
    if subprocess.run(["unshare", "-m", "sh", "-c", mount], capture_output=True, check=False).returncode:
        pytest.skip("a small disk can be mounted by root only")
    job = f"'{sys.executable}' -m gainful.cli estimate drive.toml --out disk/out"
    prepare = f"{mount} && mkdir disk/out && echo old > disk/out/result.nc"
    script = f"{prepare} && {job}; echo code $?; find disk -type f; cat disk/out/*"
    done = subprocess.run(
        ["unshare", "-m", "sh", "-c", script],
        cwd=project.folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert "cannot be written: No space left on device; nothing was left half-written" in done.stderr
    assert done.stdout.splitlines() == ["code 1", "disk/out/result.nc", "old"]


def test_a_message_is_one_line_however_narrow_the_terminal_and_reaches_the_shell(project):
    project.change("filter =", "filtr =")
    done = command("estimate", project.config, cwd=project.folder, env=os.environ | {"COLUMNS": "30"})
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "error: configuration drive.toml: filtr: unknown key; did you mean 'filter'?\n"


# ---------------------------------------------------------------- the command itself


def test_the_version_is_printed(project):
    done = project.run("--version")
    assert (done.code, done.out) == (0, f"gainful {gf.__version__}\n")


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], []])
def test_help_lists_the_commands(project, arguments):
    done = project.run(*arguments)
    assert done.code == (0 if arguments else 2)
    for word in ("estimate", "init", "--version"):
        assert word in done.out + done.err


def test_help_of_a_command_names_its_options(project):
    done = project.run("estimate", "--help")
    assert done.code == 0
    assert "--out" in done.out
    assert "TOML" in done.out


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["estimat"], "estimate"),
        (["estimate"], "Missing argument"),
        (["estimate", "drive.toml", "--otu", "x"], "--out"),
        (["estimate", "drive.toml", "more.toml"], "more.toml"),
        (["init", "a", "b"], "b"),
    ],
)
def test_wrong_usage_is_exit_code_two_with_a_hint(project, arguments, hint):
    done = project.run(*arguments)
    assert done.code == 2
    assert hint in done.err
    assert project.left == []


def test_a_missing_package_of_the_command_line_is_named(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "gainful.cli.app")
    monkeypatch.setitem(sys.modules, "typer", None)
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 1
    assert capsys.readouterr().err == "gainful: the command line needs typer: pip install 'gainful[cli]'\n"
