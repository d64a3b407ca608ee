"""A trained part comes back from its file as it was, and a file that does not fit says why."""

import json
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import pytest

import gainful as gf
from gainful.aiding import SensorMap
from gainful.errors import ConfigError, DataError
from gainful.networks import zero_map
from gainful.updates import Corrected, InnovationHistory, JoinedFeatures, UpdateFeatures

MODEL = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"], outputs=["y"])
OTHER = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["z"], outputs=["y"])
PARTS = [
    Corrected(
        zero_map(10, 1),
        JoinedFeatures((UpdateFeatures(), InnovationHistory())),
        gf.Gated(gf.ChangeDetection({"x": 0.3}), reacquire=4),
        feedback=True,
        components=("x",),
        covariance=jnp.array([[0.25]]),
    ),
    SensorMap("y", ("x", "t"), zero_map(2, 1), jnp.asarray(0.5)),
]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    gf.save_part(tmp_path / "part", PARTS[0], model=MODEL)
    return tmp_path / "part"


@pytest.mark.parametrize("part", PARTS, ids=lambda part: type(part).__name__)
def test_a_part_read_from_its_file_is_the_same(part: eqx.Module, tmp_path: Path) -> None:
    gf.save_part(tmp_path / "part", part)
    assert bool(eqx.tree_equal(gf.load_part(tmp_path / "part", kind=type(part)), part))
    assert [path.name for path in tmp_path.iterdir()] == ["part"]


def rewritten(file: Path, **changed: object) -> None:
    """The file with another header before the same numbers."""
    line, numbers = file.read_bytes().split(b"\n", 1)
    file.write_bytes(json.dumps(json.loads(line) | changed).encode() + b"\n" + numbers)


def message(file: Path, **options: object) -> str:
    with pytest.raises(DataError) as caught:
        gf.load_part(file, **options)
    return str(caught.value)


def test_a_file_of_other_signals_is_refused(file: Path) -> None:
    assert gf.load_part(file, model=MODEL) is not None
    assert "trained on the states x; the model has z" in message(file, model=OTHER)


def test_a_file_of_another_kind_or_version_is_refused(file: Path) -> None:
    assert "expected a SensorMap, got a Corrected" in message(file, kind=SensorMap)
    rewritten(file, version=2)
    assert "expected version 1 of the file format, got 2; train the part again" in message(file)


def test_a_damaged_file_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    file.write_bytes(whole[:-30])
    assert "the numbers are damaged or cut short" in message(file)
    file.write_bytes(b"t,y\n0,1\n")
    assert "expected a file written by save_part" in message(file)
    file.unlink()
    assert "cannot be read: No such file" in message(file)


@pytest.mark.parametrize("kind", ["updates.Corected", "os.system", "updates.np", "testing.check_update"])
def test_a_file_can_name_nothing_but_public_parts(file: Path, kind: str) -> None:
    rewritten(file, part={"kind": kind, "fields": {}})
    assert f"{kind!r} is no part of this version" in message(file)


def test_a_part_with_fields_of_another_version_is_refused(file: Path) -> None:
    rewritten(file, part={"kind": "updates.Exact", "fields": {"strength": {"value": 1.0}}})
    assert "does not fit this version of the library" in message(file)


class Own(eqx.Module):
    """A part of somebody else's."""


def test_what_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="part: a Own cannot be written to a file"):
        gf.save_part(tmp_path / "part", Own())
    with pytest.raises(DataError, match="cannot be written"):
        gf.save_part(tmp_path / "missing" / "part", PARTS[1])
    assert list(tmp_path.iterdir()) == []
