"""Trained parts in one file: what they are made of in words, then their numbers."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import ConfigError, DataError
from ..models import AbstractModel

_FORMAT = "gainful part"
_VERSION = 1
_ROOMS = ("aiding", "networks", "updates")
"""Rooms whose public parts a file may name."""


def save_part(path: Path | str, part: eqx.Module, *, model: AbstractModel | None = None) -> None:
    """Write a trained part, such as a `Corrected` update or a `SensorMap`, to one file, whole or not at all.

    Args:
        path: the file.
        part: made of public parts of the library, arrays, numbers and names.
        model: whose states, outputs and inputs the part was trained on; `load_part` compares them.

    Raises:
        ConfigError: something in the part that cannot be written.
        DataError: the file cannot be written.
    """
    path = Path(path)
    header = {"format": _FORMAT, "version": _VERSION, "model": _signals(model), "part": _described(part, "part")}
    scratch = None
    try:
        handle, scratch = tempfile.mkstemp(prefix=".gainful-", dir=path.parent)
        with os.fdopen(handle, "wb") as stream:
            stream.write(json.dumps(header).encode() + b"\n")
            eqx.tree_serialise_leaves(stream, part)
        os.replace(scratch, path)
        scratch = None
    except OSError as problem:
        raise DataError(f"{path}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        if scratch is not None:
            with contextlib.suppress(OSError):
                os.unlink(scratch)


def load_part(path: Path | str, *, model: AbstractModel | None = None, kind: type | None = None) -> Any:
    """Read a part that `save_part` wrote.

    Args:
        path: the file.
        model: the model it is to be used with; its states, outputs and inputs must be those of training.
        kind: the class it must be of.

    Raises:
        DataError: not such a file, of a later version, damaged, of another kind, or trained on other signals.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            header = _header(path, stream.readline())
            _check_signals(path, header["model"], model)
            skeleton = _built(header["part"], path)
            if kind is not None and not isinstance(skeleton, kind):
                raise DataError(f"{path}: expected a {kind.__name__}, got a {type(skeleton).__name__}")
            try:
                return eqx.tree_deserialise_leaves(stream, skeleton)
            except (RuntimeError, ValueError, EOFError) as problem:
                raise DataError(f"{path}: the numbers are damaged or cut short") from problem
    except OSError as problem:
        raise DataError(f"{path}: cannot be read: {problem.strerror or problem}") from problem


def _signals(model: AbstractModel | None) -> dict[str, list[str]] | None:
    if model is None:
        return None
    return {"states": [*model.space.names], "outputs": [*model.output.names], "inputs": [*model.inputs]}


def _check_signals(path: Path, trained: dict[str, list[str]] | None, model: AbstractModel | None) -> None:
    given = _signals(model)
    if trained is None or given is None:
        return
    for kind, names in trained.items():
        if given[kind] != names:
            listed, other = (", ".join(each) or "none" for each in (names, given[kind]))
            raise DataError(f"{path}: trained on the {kind} {listed}; the model has {other}")


def _header(path: Path, line: bytes) -> dict[str, Any]:
    try:
        header = json.loads(line)
        if header["format"] != _FORMAT:
            raise KeyError("format")
    except (ValueError, KeyError, TypeError) as problem:
        raise DataError(f"{path}: expected a file written by save_part, got something else") from problem
    if header["version"] != _VERSION:
        raise DataError(
            f"{path}: expected version {_VERSION} of the file format, got {header['version']!r}; train the part again"
        )
    return header


def _described(value: Any, place: str) -> Any:
    """A part in words: classes, names and shapes, without its numbers."""
    if isinstance(value, eqx.Module) and (name := _public_name(type(value))) is not None:
        fields = [field.name for field in dataclasses.fields(value)]
        return {"kind": name, "fields": {each: _described(getattr(value, each), f"{place}.{each}") for each in fields}}
    if isinstance(value, jax.Array | np.ndarray):
        return {"array": [str(value.dtype), list(value.shape)]}
    if isinstance(value, tuple):
        return {"tuple": [_described(each, f"{place}[{k}]") for k, each in enumerate(value)]}
    if isinstance(value, dict):
        return {"dict": {key: _described(each, f"{place}[{key!r}]") for key, each in value.items()}}
    if value is None or isinstance(value, bool | int | float | str):
        return {"value": value}
    raise ConfigError(f"{place}: a {type(value).__name__} cannot be written to a file")


def _public_name(cls: type) -> str | None:
    for room in _ROOMS:
        if getattr(_room(room), cls.__name__, None) is cls:
            return f"{room}.{cls.__name__}"
    return None


def _room(name: str) -> Any:
    return importlib.import_module(f"..{name}", __package__)


def _built(words: Any, path: Path) -> Any:
    """The part those words describe, with ones for its numbers: a size that must not be 0 may be 1."""
    try:
        if "kind" in words:
            fields = {name: _built(each, path) for name, each in words["fields"].items()}
            return _class_of(words["kind"], path)(**fields)
        if "array" in words:
            dtype, shape = words["array"]
            return jnp.ones(tuple(shape), dtype)
        if "tuple" in words:
            return tuple(_built(each, path) for each in words["tuple"])
        if "dict" in words:
            return {key: _built(each, path) for key, each in words["dict"].items()}
        return words["value"]
    except (TypeError, KeyError, ValueError) as problem:
        if isinstance(problem, DataError):
            raise
        raise DataError(f"{path}: its description does not fit this version of the library: {problem}") from problem


def _class_of(name: str, path: Path) -> type:
    room, _, own = name.partition(".")
    cls = getattr(_room(room), own, None) if room in _ROOMS and own in _room(room).__all__ else None
    if not (isinstance(cls, type) and issubclass(cls, eqx.Module)):
        raise DataError(f"{path}: {name!r} is no part of this version of the library")
    return cls
