"""From validated sections to model, filter, prior and record."""

from __future__ import annotations

import importlib.util
import inspect
import sys
import traceback
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import equinox as eqx

from ..errors import ConfigError, GainfulError, did_you_mean
from ..estimates import Gaussian
from ..filters import KalmanFilter
from ..models import AbstractModel, augment, continuous_model, discrete_model, sensor
from ..plants import CATALOGUE
from ..running import make_prior
from ..updates import Gated
from .parts import make_filter
from .schema import EstimateConfig, ModelSection, Signals

_FUNCTION_KEYS = ("kind", "h", "states", "outputs", "inputs", "Q", "R", "G", "sensors", "parameters")


def build_model(section: ModelSection, base: Path) -> AbstractModel:
    """The model a section names.

    Args:
        section: of the configuration.
        base: folder that the model's file is relative to.

    Raises:
        ConfigError: no such file, function or catalogue model, or a file that fails when run.
        ModelError: functions or matrices of the wrong form.
    """
    if bool(section.catalogue) == bool(section.file):
        given = "both" if section.file else "neither"
        raise ConfigError(f"model: expected either a catalogue name or a file, got {given}")
    if section.catalogue:
        if section.catalogue not in CATALOGUE:
            raise ConfigError(f"model.catalogue: {section.catalogue!r} is not known; {did_you_mean(section.catalogue, CATALOGUE)}")
        model = _call(CATALOGUE[section.catalogue], section.arguments, "model.catalogue")
    else:
        module = _load(base / section.file)
        if section.kind:
            model = _from_functions(section, module)
        else:
            stray = [key for key in _FUNCTION_KEYS if getattr(section, key)]
            if stray:
                raise ConfigError(f"model.{stray[0]}: needs kind = \"continuous\" or \"discrete\"")
            name = section.function or "model"
            model = _call(_attribute(module, name, "model.function"), section.arguments, f"model.function {name!r}")
    if not isinstance(model, AbstractModel):
        raise ConfigError(f"model: expected the function to return a model, got {type(model).__name__}")
    if section.augment is not None:
        bounds = {name: _bounds(name, values) for name, values in section.augment.bounds.items()}
        model = augment(model, parameters=section.augment.parameters, biases=section.augment.biases, bounds=bounds)
    return model


def build_filter(config: EstimateConfig) -> KalmanFilter:
    """The filter of a configuration, gated where the options ask for it."""
    chosen = make_filter(config.filter)
    if config.options.gate is None:
        return chosen
    gated = Gated(chosen.update, config.options.gate, config.options.reacquire)
    return eqx.tree_at(lambda part: part.update, chosen, gated)


def build_prior(config: EstimateConfig, model: AbstractModel) -> Gaussian:
    """The prior of a configuration."""
    return make_prior(model, config.prior.mean, config.prior.std, cov=config.prior.cov)


def _bounds(name: str, values: list[float]) -> tuple[float | None, float | None]:
    if len(values) not in (1, 2):
        raise ConfigError(f"model.augment.bounds.{name}: expected one or two numbers, got {values}")
    return (values[0], values[1] if len(values) == 2 else None)


def _signals(given: Signals | None) -> Any:
    if not isinstance(given, Mapping):
        return given
    return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


def _from_functions(section: ModelSection, module: types.ModuleType) -> AbstractModel:
    def named(value: Any, key: str) -> Any:
        return _attribute(module, value, f"model.{key}") if isinstance(value, str) else value

    if section.states is None:
        raise ConfigError("model.states: missing")
    if section.Q is None:
        raise ConfigError("model.Q: missing")
    sensors = [
        sensor(name, named(part.h, f"sensors.{name}.h"), outputs=_signals(part.outputs), R=named(part.R, f"sensors.{name}.R"))
        for name, part in section.sensors.items()
    ]
    h = section.h or ("" if sensors else "h")
    make = continuous_model if section.kind == "continuous" else discrete_model
    steps = {"substeps": section.substeps} if section.kind == "continuous" else {}
    return make(
        named(section.f, "f"),
        named(h, "h") if h else None,
        states=_signals(section.states),
        outputs=_signals(section.outputs),
        inputs=_signals(section.inputs) or (),
        Q=named(section.Q, "Q"),
        R=named(section.R, "R"),
        G=named(section.G, "G"),
        sensors=sensors or None,
        parameters=section.parameters,
        **steps,
    )


def _load(path: Path) -> types.ModuleType:
    """The user's Python file, run as a module of its own."""
    if not path.is_file():
        beside = [p.name for p in path.parent.glob("*.py")] if path.parent.is_dir() else []
        raise ConfigError(f"model.file: {path} not found; {did_you_mean(path.name, beside)}")
    spec = importlib.util.spec_from_file_location(f"_gainful_model_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    except GainfulError:
        raise
    except Exception as problem:  # whatever the user's file raises is the user's to read
        where = [frame for frame in traceback.extract_tb(problem.__traceback__) if frame.filename == str(path)]
        line = f" line {where[-1].lineno}" if where else ""
        raise ConfigError(f"model.file: {path.name}{line} failed: {type(problem).__name__}: {problem}") from problem
    finally:
        sys.path.remove(str(path.parent))
    return module


def _attribute(module: types.ModuleType, name: str, key: str) -> Any:
    functions = [n for n, value in vars(module).items() if callable(value) and not n.startswith("_")]
    if not callable(getattr(module, name, None)):
        raise ConfigError(f"{key}: {Path(str(module.__file__)).name} has no function {name!r}; {did_you_mean(name, functions)}")
    return getattr(module, name)


def _call(make: Any, arguments: dict[str, Any], role: str) -> Any:
    known = list(inspect.signature(make).parameters)
    for key in arguments:
        if key not in known:
            raise ConfigError(f"model.arguments.{key}: {role} has no such argument; {did_you_mean(key, known)}")
    try:
        return make(**arguments)
    except TypeError as problem:
        raise ConfigError(f"{role}: {problem}") from problem
