"""Messages about what is missing around the library: packages, and folders that can be written."""

import errno
import sys

import numpy as np
import pytest

import gainful as gf
from gainful.errors import (
    DataError,
    MissingExtraError,
)
from gainful.io import check_folder, convert, whole_folder
from gainful.jobs import write_starter

from .problems import run_breakable, walk


@pytest.mark.parametrize(
    ("missing", "extra", "attempt"),
    [
        ("pandas", "to_pandas needs pandas", lambda: run_breakable().to_pandas()),
        ("xarray", "to_xarray needs xarray", lambda: run_breakable().to_xarray()),
        ("pint", "units need pint", lambda: convert(np.ones(1), "deg", "rad", "angle")),
    ],
)
def test_a_missing_package_is_named_with_the_extra_that_brings_it(monkeypatch, missing, extra, attempt):
    gf.io.units._registry.cache_clear()
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(MissingExtraError) as caught:
        attempt()
    assert str(caught.value) == f"{extra}: pip install 'gainful[io]'"


def test_a_missing_package_for_latitudes_is_named(monkeypatch, tmp_path):
    (tmp_path / "log.csv").write_text("t,lat,lon\n0,45,9\n")
    monkeypatch.setitem(sys.modules, "pymap3d", None)
    source = gf.Source({"y": "east"}, file="log.csv", local=[gf.LocalFrame("lat", "lon")])
    with pytest.raises(MissingExtraError, match=r"latitudes need pymap3d: pip install 'gainful\[io\]'"):
        gf.read_log(walk(), source, tmp_path)


def test_folders_that_cannot_be_written_are_named(tmp_path, as_nobody):
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", tmp_path / "file" / "deeper"):
        with pytest.raises(DataError, match=r"output folder .*: a file of that name is in the way"):
            check_folder(folder)
    tmp_path.chmod(0o555)
    with as_nobody(), pytest.raises(DataError, match=r"output folder .*out: cannot be written: Permission denied"):
        check_folder(tmp_path / "out")
    tmp_path.chmod(0o755)
    check_folder(tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file"]


def fill(folder, text, problem=None):
    """Write a file per name, then fail if asked to."""
    with whole_folder(folder) as new:
        for name in ("a.txt", "b.txt", "z"):
            (new / name).write_text(text)
        if problem is not None:
            raise problem


def test_new_files_replace_old_ones_together_or_not_at_all(tmp_path):
    out = tmp_path / "out"
    (out / "z").mkdir(parents=True)
    (out / "a.txt").write_text("old")
    (out / "z" / "precious").write_text("mine")
    with pytest.raises(DataError, match=r"output folder .*out: a folder called 'z' is in the way"):
        fill(out, "new")
    assert (out / "a.txt").read_text() == "old"
    assert (out / "z" / "precious").read_text() == "mine"
    assert sorted(path.name for path in out.iterdir()) == ["a.txt", "z"]
    (out / "z" / "precious").unlink()
    (out / "z").rmdir()
    fill(out, "new")
    assert {path.name: path.read_text() for path in out.iterdir()} == dict.fromkeys(("a.txt", "b.txt", "z"), "new")


def test_a_full_disk_in_the_middle_leaves_everything_as_it_was(tmp_path):
    (tmp_path / "a.txt").write_text("old")
    full = OSError(errno.ENOSPC, "whatever the library says")
    with pytest.raises(DataError, match=r"cannot be written: No space left on device; nothing was left half-written"):
        fill(tmp_path, "new", full)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old"}


@pytest.mark.parametrize("problem", [KeyboardInterrupt, MemoryError])
def test_a_stop_in_the_middle_leaves_nothing(tmp_path, problem):
    with pytest.raises(problem):
        fill(tmp_path / "out", "new", problem())
    assert list(tmp_path.iterdir()) == []


def test_a_starter_does_not_overwrite(tmp_path):
    (tmp_path / "model.py").write_text("mine")
    with pytest.raises(DataError, match=r"model.py is there already; choose another folder"):
        write_starter(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["model.py"]
