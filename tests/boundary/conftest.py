"""What several files share: records in a test's own folder, and somebody without permissions (root has them all)."""

import contextlib
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import pytest

import gainful as gf

from .problems import walk

NOBODY = 65534


@pytest.fixture
def as_nobody() -> Callable[[], AbstractContextManager[None]]:
    """A context in which the process has no special rights."""

    @contextlib.contextmanager
    def switch() -> Iterator[None]:
        if os.geteuid() != 0:
            yield
            return
        os.seteuid(NOBODY)
        try:
            yield
        finally:
            os.seteuid(0)

    return switch


@pytest.fixture
def put(tmp_path):
    """Writes a file into the test's folder and returns its name."""

    def write(text, name="log.csv"):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    return write


@pytest.fixture
def read(tmp_path):
    """Reads a record of the one-number model, `y` from column `x`, unless told otherwise."""

    def log(model=None, **given):
        source = {"outputs": {"y": "x"}, "file": "log.csv"} | given
        return gf.read_log(walk() if model is None else model, gf.Source(**source), tmp_path)

    return log
