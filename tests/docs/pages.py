"""The texts as programs: their blocks found, run and compared with what they print."""

from __future__ import annotations

import contextlib
import dataclasses
import doctest
import io
import re
import shlex
import sys
import types
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]

_FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\w+)(?P<options>[^\n]*)\n(?P<text>.*?)\n(?P=indent)```$", re.M | re.S
)


@dataclasses.dataclass(frozen=True)
class Block:
    """A fenced block of a text.

    Attributes:
        language: the first word after the fence.
        options: the rest of that line.
        text: what it holds.
        line: where it starts, counted from 1.
    """

    language: str
    options: str
    text: str
    line: int

    @property
    def title(self) -> str:
        """The title it is shown under."""
        found = re.search(r'title="([^"]*)"', self.options)
        return found[1] if found else ""

    @property
    def file(self) -> Path | None:
        """The file it is, if its title is a file's name."""
        return Path(self.title) if Path(self.title).suffix else None


def blocks(path: Path) -> list[Block]:
    """All fenced blocks with a language."""
    text = path.read_text(encoding="utf-8")
    found = []
    for match in _FENCE.finditer(text):
        body = re.sub(f"^{match['indent']}", "", match["text"], flags=re.M)
        found.append(Block(match["language"], match["options"].strip(), body, text[: match.start()].count("\n") + 1))
    return found


class Session:
    """Runs the blocks of pages in one folder; a command seen before is not run again."""

    def __init__(self) -> None:
        self._outputs: dict[str, str] = {}
        self._played: set[Path] = set()

    def play(self, path: Path) -> None:
        """Run a page from top to bottom and compare each output block with what the block before it printed.

        A block with a file name for its title is written to that file instead.
        """
        if path in self._played:
            return
        self._played.add(path)
        module = types.ModuleType(f"page_{path.stem.replace('-', '_')}")
        # Classes look for the module they are made in.
        sys.modules[module.__name__] = module
        printed: str | None = None
        for block in blocks(path):
            where = f"{path.name}:{block.line}"
            if block.file is not None:
                block.file.parent.mkdir(parents=True, exist_ok=True)
                block.file.write_text(block.text + "\n", encoding="utf-8")
            elif block.language == "python":
                printed = self._python(block, vars(module), path)
            elif block.language == "sh":
                printed = self._shell(block, where)
            elif block.title == "Output":
                assert printed is not None, f"{where}: an output without a block that prints it"
                _compare(block.text, printed, where)
                printed = None

    def output(self, command: str) -> str:
        """What a command printed."""
        return self._outputs[command]

    def _python(self, block: Block, names: dict[str, Any], path: Path) -> str:
        # Padded so that a traceback names the line of the page.
        source = "\n" * block.line + block.text
        stream = io.StringIO()
        with contextlib.redirect_stdout(stream):
            exec(compile(source, str(path), "exec", dont_inherit=True), names)
        return stream.getvalue()

    def _shell(self, block: Block, where: str) -> str:
        lines = [line.split("  #")[0].strip() for line in block.text.splitlines()]
        return "".join(self._command(line, where) for line in lines if line.startswith("gainful "))

    def _command(self, line: str, where: str) -> str:
        if line not in self._outputs:
            from typer.testing import CliRunner

            from gainful.cli.app import app

            outcome = CliRunner().invoke(app, shlex.split(line)[1:])
            assert outcome.exit_code == 0, f"{where}: {line}\n{outcome.output}\n{outcome.exception!r}"
            self._outputs[line] = outcome.output
        return self._outputs[line]


def _compare(wanted: str, printed: str, where: str) -> None:
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert doctest.OutputChecker().check_output(wanted + "\n", printed, flags), f"{where}: got\n{printed}"


def merged(base: dict[str, Any], extra: dict[str, Any]) -> dict[str, Any]:
    """The tables of two configurations, the second one's keys winning."""
    both = dict(base)
    for key, value in extra.items():
        both[key] = merged(both[key], value) if isinstance(value, dict) and isinstance(both.get(key), dict) else value
    return both
