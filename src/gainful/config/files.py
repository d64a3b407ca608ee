"""A user's Python files."""

from __future__ import annotations

import contextlib
import importlib.util
import sys
import types
from collections.abc import Iterator
from pathlib import Path

from ..errors import ConfigError, GainfulError, did_you_mean
from ..running.checks import place_of


def load_python(path: Path, key: str) -> types.ModuleType:
    """A Python file, run as a module of its own.

    Args:
        path: of the file.
        key: of the configuration that names it, for messages.

    Raises:
        ConfigError: no such file, or it fails.
    """
    if path.suffix != ".py":
        raise ConfigError(f"{key}: expected a Python file (.py), got {str(path)!r}")
    if not path.is_file():
        beside = [p.name for p in path.parent.glob("*.py")] if path.parent.is_dir() else []
        hint = did_you_mean(path.name, beside) if path.parent.is_dir() else f"there is no folder {path.parent}"
        raise ConfigError(f"{key}: {path} not found; {hint}")
    spec = importlib.util.spec_from_file_location(f"_gainful_model_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    folder = str(path.parent.resolve())
    sys.path.insert(0, folder)
    sys.modules[spec.name] = module  # dataclasses look their own module up
    try:
        with own_failures(f"{key}: {path.name} failed"):
            spec.loader.exec_module(module)
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(folder)
    return module


@contextlib.contextmanager
def own_failures(what: str) -> Iterator[None]:
    """Whatever the user's code raises is the user's to read: with its place, but without our frames."""
    try:
        yield
    except GainfulError:
        raise
    except (Exception, SystemExit) as problem:
        raise ConfigError(f"{what}{place_of(problem)}: {type(problem).__name__}: {problem}") from problem
