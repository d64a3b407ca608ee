"""The README keeps its word."""

from __future__ import annotations

import re
import tomllib

import pytest

from gainful.config import parse_config

from .pages import ROOT, Session, blocks

README = ROOT / "README.md"


def test_every_block_runs_and_prints_what_it_says(session: Session) -> None:
    session.play(README)


def test_the_first_python_example_has_at_most_eight_lines() -> None:
    first = next(block for block in blocks(README) if block.language == "python")
    assert len([line for line in first.text.splitlines() if line.strip()]) <= 8


def test_the_table_holds_the_errors_the_commands_print(session: Session) -> None:
    session.play(README)
    text = README.read_text(encoding="utf-8")
    for words, file in (("ranges taken at their word", "rover_without_bias"), ("one bias state per beacon", "rover")):
        given = re.search(rf"^\| {words} \| (.*) \| (.*) \|$", text, re.M)
        printed = session.output(f"gainful estimate examples/rover/{file}.toml --out out/{file}")
        distance = next(line for line in printed.splitlines() if "distance (x, y)" in line)
        assert given is not None
        assert [float(number) for number in given.groups()] == pytest.approx(
            [float(number) for number in re.findall(r"\d+\.\d+", distance)], abs=0.006
        )


def test_the_configuration_it_shows_is_valid() -> None:
    shown = [block for block in blocks(README) if block.language == "toml"]
    assert shown
    for block in shown:
        parse_config(tomllib.loads(block.text))


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "examples/rover/README.md"])
def test_every_file_a_text_links_to_is_there(name: str) -> None:
    path = ROOT / name
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text()):
        assert (path.parent / target).exists(), f"{name}: {target}"
