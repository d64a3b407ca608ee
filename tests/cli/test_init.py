"""The first minutes: `gainful init`, then what it says to run."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gainful as gf
from gainful.config import make_filter


def test_init_writes_three_files_and_says_how_to_run_them(project):
    done = project.run("init", "new place")
    assert done.code == 0
    assert sorted(path.name for path in (project.folder / "new place").iterdir()) == [
        "estimate.toml",
        "log.csv",
        "model.py",
    ]
    assert "wrote new place/estimate.toml" in done.out
    assert done.out.rstrip().endswith("gainful estimate 'new place/estimate.toml'")


def test_init_does_not_overwrite(project):
    (project.folder / "model.py").write_text("mine")
    done = project.run("init")
    assert done.code == 1
    assert done.err == "error: model.py is there already; choose another folder\n"
    assert project.left == ["model.py"]
    assert (project.folder / "model.py").read_text() == "mine"


def test_init_into_a_file_is_refused(project):
    done = project.run("init", "drive.csv")
    assert done.code == 1
    assert "output folder drive.csv: a file of that name is in the way" in done.err
    assert project.left == []


@pytest.mark.slow
def test_what_init_wrote_runs_as_it_says(starter):
    assert starter.init.returncode == 0, starter.init.stderr
    assert starter.init.stdout.rstrip().endswith("gainful estimate first/estimate.toml")
    assert starter.estimate.returncode == 0, starter.estimate.stderr
    assert starter.estimate.stderr == ""
    assert "consistent: NIS" in starter.estimate.stdout
    assert "wrote out/estimate/report.html, estimates.parquet, result.nc" in starter.estimate.stdout
    assert sorted(path.name for path in starter.out.iterdir()) == ["estimates.parquet", "report.html", "result.nc"]
    assert [path.name for path in (starter.home / "out").iterdir()] == ["estimate"]


@pytest.mark.slow
def test_the_starters_table_opens_with_named_states_units_configuration_and_version(starter):
    table = pd.read_parquet(starter.out / "estimates.parquet")
    assert table.index.name == "t"
    assert list(table) == ["angle", "rate", "std_angle", "std_rate", "true_angle", "status"]
    assert table.attrs["units"] == {
        "t": "s",
        "angle": "rad",
        "rate": "rad/s",
        "std_angle": "rad",
        "std_rate": "rad/s",
        "true_angle": "rad",
    }
    assert table.attrs["config"] == (starter.home / "first" / "estimate.toml").read_text()
    assert table.attrs["gainful_version"] == gf.__version__
    assert np.sqrt(np.mean((table["angle"] - table["true_angle"]) ** 2)) < 0.015
    assert len(table) == 500


@pytest.mark.slow
def test_the_starters_data_set_opens_with_named_states_units_configuration_and_version(starter):
    with xr.open_dataset(starter.out / "result.nc", engine="h5netcdf") as data:
        assert data["state"].values.tolist() == ["angle", "rate"]
        assert data["state_unit"].values.tolist() == ["rad", "rad/s"]
        assert data["signal"].values.tolist() == ["measured_angle"]
        assert data["signal_unit"].values.tolist() == ["rad"]
        assert data["t"].attrs["units"] == "s"
        assert data.attrs["estimates"] == "smoothed"
        assert data.attrs["gainful_version"] == gf.__version__
        assert data.attrs["config"] == (starter.home / "first" / "estimate.toml").read_text()
        written = make_filter(json.loads(data.attrs["filter"]))
        assert written == make_filter(
            {"kind": "ukf", "square_root": True, "update": {"kind": "gated", "probability": 0.9999}}
        )
        table = pd.read_parquet(starter.out / "estimates.parquet")
        np.testing.assert_array_equal(data["mean"].sel(state="angle"), table["angle"])
        np.testing.assert_allclose(
            np.sqrt(data["covariance"].sel(tangent="rate", tangent_column="rate")), table["std_rate"], rtol=1e-12
        )


@pytest.mark.slow
def test_the_starters_report_carries_title_and_verdict(starter):
    text = (starter.out / "report.html").read_text(encoding="utf-8")
    assert "<title>Pendulum" in text
    assert "NIS" in text
