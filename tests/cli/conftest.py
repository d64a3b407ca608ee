"""A small project to run the command in, and what `gainful init` makes."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from gainful.cli.app import app

CONFIG = """
title = "a drive"
filter = "ekf"

[model]
catalogue = "planar_vehicle"
arguments = { position_sigma = 0.5 }

[data]
file = "drive.csv"
outputs.measured_x = { column = "x_km", unit = "km" }
outputs.measured_y = "y_m"
inputs.speed = { column = "speed_kmh", unit = "km/h" }
inputs.turn_rate = { column = "turn_deg", unit = "deg/s" }
truth.heading = { column = "heading_deg", unit = "deg" }

[prior]
mean = { x = 0.0, y = 0.0, heading = 0.0 }
std = { x = 1.0, y = 1.0, heading = 0.5 }
"""


def drive():
    """A circle of 10 m at 1 m/s with fixes of half a metre, as a CSV in everyday units."""
    rng = np.random.default_rng(3)
    rows = ["t,x_km,y_m,speed_kmh,turn_deg,heading_deg"]
    for t in np.arange(0, 30, 0.25):
        angle = 0.1 * t
        x, y = 10 * np.sin(angle), 10 * (1 - np.cos(angle))
        fix = f"{(x + 0.5 * rng.normal()) / 1000},{y + 0.5 * rng.normal()}" if t % 5 else ","
        rows.append(f"{t},{fix},3.6,{np.degrees(0.1)},{np.degrees(angle)}")
    return "\n".join(rows) + "\n"


class Project:
    """A folder with a configuration, in which the command is run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.config = folder / "drive.toml"
        self.config.write_text(CONFIG)
        (folder / "drive.csv").write_text(drive())

    def change(self, old: str, new: str) -> None:
        """Replace a piece of the configuration."""
        text = self.config.read_text()
        assert old in text
        self.config.write_text(text.replace(old, new))

    def run(self, *arguments: object) -> SimpleNamespace:
        """The command in this process: exit code, standard output and standard error."""
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return SimpleNamespace(code=result.exit_code, out=result.stdout, err=result.stderr)

    @property
    def left(self) -> list[str]:
        """What lies in the folder besides the project itself."""
        own = {"drive.toml", "drive.csv", "plant.py", "__pycache__"}
        return sorted(path.name for path in self.folder.iterdir() if path.name not in own)


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Project:
    """A project of this test's own, with the working directory in it."""
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "home")
    return Project(tmp_path / "home")


def command(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    line = [sys.executable, "-m", "gainful.cli", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, check=False, **options)  # type: ignore[call-overload]


@pytest.fixture(scope="session")
def starter(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> SimpleNamespace:
    """What a newcomer gets: `gainful init`, then the command that it prints, each in a process of its own."""
    home = tmp_path_factory.mktemp("newcomer")
    environment = dict(os.environ)
    if hasattr(request.config, "cache"):
        environment["JAX_COMPILATION_CACHE_DIR"] = str(request.config.cache.mkdir("jax"))
        environment["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0.3"
    init = command("init", "first", cwd=home, env=environment)
    estimate = command("estimate", "first/estimate.toml", cwd=home, env=environment)
    return SimpleNamespace(home=home, init=init, estimate=estimate, out=home / "out" / "estimate")
