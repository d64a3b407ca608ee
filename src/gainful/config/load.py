"""A configuration file as validated sections."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import pydantic

from ..errors import ConfigError, did_you_mean
from .schema import EstimateConfig
from .wording import misplaced_booleans, sentences


def load_config(path: Path | str) -> EstimateConfig:
    """The configuration in a TOML file.

    Raises:
        ConfigError: no such file, not TOML, an unknown key (with the nearest known one) or a value of the wrong kind.
    """
    path = Path(path)
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
        return parse_config(table)
    except ConfigError as problem:
        raise ConfigError(f"configuration {path.name}: {problem}") from problem


def parse_config(table: dict[str, Any]) -> EstimateConfig:
    """The configuration in a table as `tomllib` gives it."""
    table = copy.deepcopy(table)
    for role in ("outputs", "inputs", "truth"):
        signals = table.get("data", {}).get(role, {}) if isinstance(table.get("data"), dict) else {}
        for name, given in signals.items() if isinstance(signals, dict) else ():
            signals[name] = {"column": given} if isinstance(given, str) else given
    try:
        config = pydantic.TypeAdapter(EstimateConfig).validate_python(table)
    except pydantic.ValidationError as problem:
        raise ConfigError("; ".join(sentences(problem.errors(), table, EstimateConfig))) from problem
    wrong = misplaced_booleans(table, EstimateConfig)
    if wrong:
        raise ConfigError("; ".join(wrong))
    return config
