"""A configuration names the files of what was trained, relative to itself."""

import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.aiding import SensorMap, SensorMappedModel, unaided_filter
from gainful.config import build_filter, build_model, parse_config
from gainful.errors import ConfigError, DataError
from gainful.jobs import estimate
from gainful.networks import AffineMap
from gainful.plants import CATALOGUE
from gainful.updates import Corrected

TEXT = """
filter = "ekf"
[model]
catalogue = "constant_velocity"
arguments = { axes = 1 }
sensor_maps = ["bias.part"]
[data]
file = "log.csv"
outputs.measured_x = "x"
[prior]
mean = { x = 0, vx = 0.5 }
std = [1.0, 2]
[options]
gate = 0.999
aiding = "aiding.part"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    model = CATALOGUE["constant_velocity"](axes=1)
    network = AffineMap(jnp.zeros((2, 5)), jnp.array([0.0, 0.25]))
    aiding = Corrected(network, covariance=jnp.diag(jnp.array([0.1, 0.2])), gate=None)
    gf.save_part(tmp_path / "aiding.part", aiding, model=model)
    bias = SensorMap("measured_x", ("x",), AffineMap(jnp.zeros((1, 1)), jnp.array([3.0])), jnp.asarray(0.5))
    gf.save_part(tmp_path / "bias.part", bias, model=model)
    rows = "\n".join(f"{k},{0.5 * k + 3.0}" for k in range(40))
    (tmp_path / "log.csv").write_text(f"t,x\n{rows}\n")
    (tmp_path / "config.toml").write_text(TEXT)
    return tmp_path


def test_trained_parts_are_read_and_put_around_what_is_there(folder: Path) -> None:
    config = parse_config(tomllib.loads(TEXT))
    model = build_model(config.model, folder)
    assert isinstance(model, SensorMappedModel)
    chosen = build_filter(config, model, folder)
    assert isinstance(chosen.update, Corrected)
    assert chosen.update.inner == gf.Gated(gf.Exact(), 0.999, 10)
    assert unaided_filter(chosen) == gf.extended_kalman_filter(update=gf.Gated(gf.Exact(), 0.999, 10))


def test_a_whole_job_shows_the_corrected_estimate(folder: Path) -> None:
    job = estimate(folder / "config.toml", folder / "out")
    assert job.result.mean[-1] == pytest.approx([0.5 * 39, 0.5 + 0.25], abs=0.05)
    np.testing.assert_allclose(job.result.cov[-1], np.diag([0.1, 0.2]))
    assert (folder / "out" / "report.html").exists()


def test_a_file_that_is_not_there_or_does_not_fit_is_named(folder: Path) -> None:
    config = parse_config(tomllib.loads(TEXT))
    model = build_model(config.model, folder)
    with pytest.raises(DataError, match=r"aiding\.part: cannot be read"):
        build_filter(config, model, folder / "out")
    with pytest.raises(DataError, match=r"trained on the states x, vx; the model has x, y, vx, vy"):
        build_filter(config, CATALOGUE["constant_velocity"](axes=2), folder)
    (folder / "bias.part").unlink()
    with pytest.raises((ConfigError, DataError), match=r"bias\.part: cannot be read"):
        build_model(config.model, folder)
