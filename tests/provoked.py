"""Every message of the library is provoked by some test: a run of all tests fails if one is not."""

import ast
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gainful as gf
from gainful.errors import GainfulError

LIBRARY = Path(gf.__file__).parent
Place = tuple[str, int]
"""File and line."""


class Provoked:
    """Notes where errors of the library are made, in all processes of a run, and holds that against its source."""

    def __init__(self) -> None:
        self._places: set[Place] = set()
        self._whole = False
        self._left: list[str] = []
        places = self._places

        def noting(self: GainfulError, *arguments: Any, **named: Any) -> None:
            frame = sys._getframe(1)
            places.add((frame.f_code.co_filename, frame.f_lineno))
            super(GainfulError, self).__init__(*arguments, **named)

        GainfulError.__init__ = noting  # type: ignore[method-assign]

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        config = session.config
        chosen = any(config.getoption(name, None) for name in ("keyword", "markexpr", "lf", "deselect"))
        self._whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not chosen

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        self._places.update(map(tuple, getattr(node, "workeroutput", {}).get("provoked", ())))

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if hasattr(session.config, "workeroutput"):
            session.config.workeroutput["provoked"] = sorted(self._places)
        elif self._whole and exitstatus == pytest.ExitCode.OK:
            self._left = list(unprovoked(self._places))
            if self._left:
                session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if self._left:
            terminalreporter.section("messages that no test provokes", red=True)
            terminalreporter.write_line("\n".join(self._left))


def unprovoked(places: set[Place]) -> Iterator[str]:
    """The statements that make one of the library's errors, of which no line is among some places."""
    errors = {name for name, each in vars(gf.errors).items() if inspect.isclass(each)}
    for path in sorted(LIBRARY.rglob("*.py")):
        text = path.read_text()
        for node in ast.walk(ast.parse(text)):
            if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)):
                continue
            made = node.exc.func
            if not (isinstance(made, ast.Name) and made.id in errors):
                continue
            if not any((str(path), line) in places for line in range(node.lineno, (node.end_lineno or 0) + 1)):
                words = " ".join((ast.get_source_segment(text, node) or "").split())
                yield f"{path.relative_to(LIBRARY)}:{node.lineno}: {words}"
