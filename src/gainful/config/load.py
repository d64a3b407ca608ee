"""A configuration file as validated sections."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import pydantic

from ..errors import ConfigError, did_you_mean
from .identify import IdentifyConfig
from .schema import EstimateConfig
from .wording import misplaced_booleans, sentences

T = TypeVar("T")


def load_config(path: Path | str) -> EstimateConfig:
    """The configuration of `gainful estimate` in a TOML file.

    Raises:
        ConfigError: no such file, not TOML, an unknown key (with the nearest known one) or a value of the wrong kind.
    """
    return _loaded(Path(path), parse_config)


def load_identify_config(path: Path | str) -> IdentifyConfig:
    """The configuration of `gainful identify` in a TOML file.

    Raises:
        ConfigError: no such file, not TOML, an unknown key (with the nearest known one) or a value of the wrong kind.
    """
    return _loaded(Path(path), parse_identify_config)


def _loaded(path: Path, parse: Callable[[dict[str, Any]], T]) -> T:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as problem:
        beside = [p.name for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        hint = f"; {did_you_mean(path.name, beside)}" if beside else ""
        raise ConfigError(f"configuration {path}: not found{hint}") from problem
    except IsADirectoryError as problem:
        beside = sorted(p.name for p in path.glob("*.toml"))
        hint = f"; there is {', '.join(beside)} in it" if beside else ""
        raise ConfigError(f"configuration {path}: expected a file, got a folder{hint}") from problem
    except OSError as problem:
        raise ConfigError(f"configuration {path}: cannot be read: {problem.strerror}") from problem
    except UnicodeDecodeError as problem:
        raise ConfigError(f"configuration {path}: not valid TOML: not UTF-8 text ({problem})") from problem
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise ConfigError(f"configuration {path}: not valid TOML: {problem}") from problem
    try:
        return parse(table)
    except ConfigError as problem:
        raise ConfigError(f"configuration {path.name}: {problem}") from problem


def parse_config(table: dict[str, Any]) -> EstimateConfig:
    """The configuration in a table as `tomllib` gives it."""
    table = copy.deepcopy(table)
    for role in ("outputs", "inputs", "truth"):
        signals = table.get("data", {}).get(role, {}) if isinstance(table.get("data"), dict) else {}
        for name, given in signals.items() if isinstance(signals, dict) else ():
            signals[name] = {"column": given} if isinstance(given, str) else given
    return _validated(table, EstimateConfig)


def parse_identify_config(table: dict[str, Any]) -> IdentifyConfig:
    """The configuration of `gainful identify` in a table as `tomllib` gives it."""
    return _validated(table, IdentifyConfig)


def _validated(table: dict[str, Any], root: type[T]) -> T:
    try:
        config = pydantic.TypeAdapter(root).validate_python(table)
    except pydantic.ValidationError as problem:
        raise ConfigError("; ".join(sentences(problem.errors(), table, root))) from problem
    wrong = misplaced_booleans(table, root)
    if wrong:
        raise ConfigError("; ".join(wrong))
    return config
