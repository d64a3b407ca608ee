"""A configuration file as validated sections."""

from __future__ import annotations

import copy
import dataclasses
import tomllib
import types
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pydantic

from ..errors import ConfigError, did_you_mean
from .schema import EstimateConfig


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
    except (OSError, UnicodeDecodeError) as problem:
        raise ConfigError(f"configuration {path}: cannot be read: {problem}") from problem
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
        return pydantic.TypeAdapter(EstimateConfig).validate_python(table)
    except pydantic.ValidationError as problem:
        raise ConfigError("; ".join(dict.fromkeys(_sentence(error) for error in problem.errors()))) from problem


def _sentence(error: Any) -> str:
    keys = [str(part) for part in error["loc"]]
    if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        owner = _section(EstimateConfig, keys[:-1])
        known = [f.name for f in dataclasses.fields(owner)] if owner else []
        return f"{'.'.join(keys)}: unknown key; {did_you_mean(keys[-1], known)}"
    if error["type"] in ("missing", "missing_argument"):
        return f"{'.'.join(keys)}: missing"
    # A union reports each of its members; the member's name at the end of the path says nothing to a user.
    shown = [key for key in keys if key.isidentifier() or key.isdigit()]
    return f"{'.'.join(shown)}: {error['msg'].lower()}, got {error['input']!r}"


def _section(current: Any, keys: Sequence[str]) -> type | None:
    """The dataclass that a path of keys leads to."""
    for key in keys:
        if dataclasses.is_dataclass(current):
            current = typing.get_type_hints(current).get(key)
        elif typing.get_origin(current) in (dict, list):
            current = typing.get_args(current)[-1]
        if isinstance(current, types.UnionType):
            current = next((m for m in typing.get_args(current) if dataclasses.is_dataclass(m)), None)
    return current if isinstance(current, type) and dataclasses.is_dataclass(current) else None
