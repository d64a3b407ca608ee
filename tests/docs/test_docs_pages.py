"""The pages of the documentation and the README run, keep their word, and leave nothing out.

In one file, so that one process runs all pages and a command that several show is run once.
"""

from __future__ import annotations

import dataclasses
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import gainful as gf
from gainful.config import FILTERS, KINDS, parse_config, parse_identify_config
from gainful.config.identify import (
    CheckSection,
    EquationSection,
    IdentifyConfig,
    IdentifyOptions,
    RecordingSection,
)
from gainful.config.network import NetworkSection
from gainful.config.parts import ACRONYMS
from gainful.config.schema import (
    AugmentSection,
    EstimateConfig,
    MapSection,
    ModelSection,
    OptionsSection,
    ParameterSection,
    PriorSection,
    SensorSection,
    TrainingSection,
)

from .pages import ROOT, Session, blocks, merged

DOCS, README = ROOT / "docs", ROOT / "README.md"
PAGES = sorted(path for path in DOCS.rglob("*.md"))
WITH_BLOCKS = [path for path in PAGES if blocks(path)]
BASE = {
    "model": {"catalogue": "planar_vehicle"},
    "data": {"outputs": {"measured_x": "x"}},
    "prior": {"mean": [0.0], "std": [1.0]},
}
IDENTIFY_BASE = {
    "signals": {"r": "rad/s"},
    "equation": {"of": "r", "terms": {"a": "lag(r)"}},
    "data": {"signals": {"r": "r"}},
}
SECTIONS = {
    "Top level": EstimateConfig,
    "`[model]`": ModelSection,
    "`[model.sensors.NAME]`": SensorSection,
    "`[model.augment]`": AugmentSection,
    "`[data]`": gf.Source,
    "A column": gf.Column,
    "`[[data.local]]`": gf.LocalFrame,
    "`[prior]`": PriorSection,
    "`[parameters.NAME]`": ParameterSection,
    "`[options]`": OptionsSection,
    "`[training]`": TrainingSection,
    "`[training.maps.NAME]`": MapSection,
    "Top level of an identification": IdentifyConfig,
    "`[equation]`": EquationSection,
    "`[network]`": NetworkSection,
    "`[data]` of an identification": RecordingSection,
    "`[check]`": CheckSection,
    "`[options]` of an identification": IdentifyOptions,
}


@pytest.mark.parametrize("path", WITH_BLOCKS, ids=lambda path: path.stem)
def test_every_block_of_a_page_runs_and_prints_what_it_says(path: Path, session: Session) -> None:
    session.play(path)


@pytest.mark.parametrize("path", WITH_BLOCKS, ids=lambda path: path.stem)
def test_every_piece_of_configuration_has_known_keys(path: Path) -> None:
    for block in blocks(path):
        if block.language == "toml":
            table = tomllib.loads(block.text)
            if {"equation", "signals"} & set(table):
                parse_identify_config(merged(IDENTIFY_BASE, table))
            else:
                parse_config(merged(BASE, table))


@pytest.mark.parametrize("heading", SECTIONS)
def test_the_reference_has_every_key_of_a_section_and_no_other(heading: str) -> None:
    rows = _rows(heading)
    fields = {field.name: field for field in dataclasses.fields(SECTIONS[heading])}
    assert set(rows) == set(fields)
    for name, field in fields.items():
        required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if required:
            assert "required" in rows[name], name
        elif isinstance(field.default, (bool, int, float)):
            assert f"`{str(field.default).lower()}`" in rows[name], name
        elif isinstance(field.default, str) and field.default:
            assert f'`"{field.default}"`' in rows[name], name


def test_the_reference_has_every_filter_and_every_kind_of_part() -> None:
    text = (DOCS / "configuration.md").read_text()
    names = [*FILTERS, *ACRONYMS]
    assert [name for name in names if f'`"{name}"`' not in text] == []
    kinds = [kind for slot in KINDS.values() for kind in slot]
    assert [kind for kind in kinds if f"`{kind}`" not in text] == []


def test_the_python_reference_has_every_public_name() -> None:
    text = "".join(path.read_text() for path in (DOCS / "api").glob("*.md"))
    shown = set(re.findall(r"^::: gainful(?:\.\w+)*\.(\w+)$", text, re.M))
    public = {name for name, value in vars(gf).items() if callable(value) and not name.startswith("_")}
    assert sorted(public - shown) == []


def test_every_page_is_in_the_navigation() -> None:
    def leaves(entry: object) -> list[str]:
        if isinstance(entry, dict):
            entry = list(entry.values())
        return [leaf for each in entry for leaf in leaves(each)] if isinstance(entry, list) else [str(entry)]

    class Loader(yaml.SafeLoader):
        """Knows mkdocs' own tags only as names."""

    Loader.add_multi_constructor("tag:yaml.org,2002:python/", lambda loader, suffix, node: suffix)
    given = yaml.load((ROOT / "mkdocs.yml").read_text(), Loader)["nav"]
    assert sorted(leaves(given)) == sorted(str(path.relative_to(DOCS)) for path in PAGES)


def test_every_block_of_the_readme_runs_and_prints_what_it_says(session: Session) -> None:
    session.play(README)


def test_the_readmes_first_python_example_has_at_most_eight_lines() -> None:
    first = next(block for block in blocks(README) if block.language == "python")
    assert len([line for line in first.text.splitlines() if line.strip()]) <= 8


def test_the_readmes_table_holds_the_errors_the_commands_print(session: Session) -> None:
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


def test_the_configuration_the_readme_shows_is_valid() -> None:
    shown = [block for block in blocks(README) if block.language == "toml"]
    assert shown
    for block in shown:
        parse_config(tomllib.loads(block.text))


@pytest.mark.parametrize(
    "name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "examples/rover/README.md", "examples/ship/README.md"]
)
def test_every_file_a_text_links_to_is_there(name: str) -> None:
    path = ROOT / name
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text()):
        assert (path.parent / target).exists(), f"{name}: {target}"


def _rows(heading: str) -> dict[str, str]:
    """The first table under a heading of the configuration reference, by key."""
    text = (DOCS / "configuration.md").read_text()
    section = re.split(r"^#{2,3} ", text, flags=re.M)
    body = next(part for part in section if part.splitlines()[0] == heading)
    return dict(re.findall(r"^\| `(\w+)` \|(.*)\|$", body, re.M))
