"""Permissions mean nothing to root: run as somebody who has none. And: which messages have been provoked."""

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import Any

import pytest

from gainful.errors import GainfulError

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


@pytest.fixture(scope="session", autouse=True)
def raised() -> Iterator[set[tuple[str, int]]]:
    """File and line of every place that has made one of the library's errors so far."""
    places: set[tuple[str, int]] = set()

    def noting(self: GainfulError, *arguments: Any, **named: Any) -> None:
        frame = sys._getframe(1)
        places.add((frame.f_code.co_filename, frame.f_lineno))
        super(GainfulError, self).__init__(*arguments, **named)

    GainfulError.__init__ = noting  # type: ignore[method-assign]
    yield places
    del GainfulError.__init__


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The test that looks at what all others have provoked comes last."""
    items.sort(key=lambda item: item.name == "test_every_message_of_the_library_is_provoked_here")
