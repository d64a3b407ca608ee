"""From validated sections to model, filter, prior and record."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import math
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import jax

from ..aiding import SensorMap, aided_filter, with_sensor_maps
from ..errors import ConfigError, GainfulError, did_you_mean
from ..estimates import Gaussian
from ..faults import (
    AbstractInjection,
    Bias,
    Drift,
    Fault,
    FaultModel,
    Loss,
    NoiseIncrease,
    Outliers,
    Stuck,
    extend_prior,
    inject,
    with_faults,
)
from ..filters import AbstractEstimator
from ..io import load_part
from ..models import AbstractModel, augment, continuous_model, discrete_model, sensor
from ..noise import AbstractNoise, Scaled, with_scaled_noise
from ..plants import CATALOGUE
from ..running import Log, make_prior
from ..updates import AbstractUpdate, Corrected, Gated
from .files import load_python, own_failures
from .parameters import bounds_of, extended_prior, watching, with_parameters
from .parts import make_filter, make_part, single_filter
from .schema import EstimateConfig, FaultSection, InjectSection, ModelSection, Signals

_ALWAYS = {"augment", "sensor_maps"}
_CALLED = {"arguments"}
_FUNCTIONS = {"kind", "f", "h", "states", "outputs", "inputs", "Q", "R", "G", "sensors", "parameters", "substeps"}


def build_model(section: ModelSection, base: Path) -> AbstractModel:
    """The model a section names.

    Args:
        section: of the configuration.
        base: folder that the model's file and the maps of its sensors are relative to.

    Raises:
        ConfigError: no such file, function or catalogue model, a file that fails when run, or functions and matrices of
            the wrong form.
    """
    with _blamed("model"):
        model = _bare_model(section, base)
        if section.sensor_maps:
            maps = [load_part(base / file, model=model, kind=SensorMap) for file in section.sensor_maps]
            model = with_sensor_maps(model, maps)
        if section.augment is None:
            return model
        return augment(model, biases=section.augment.biases)


def build_filter(config: EstimateConfig, model: AbstractModel, base: Path | None = None) -> AbstractEstimator:
    """The filter of a configuration: with its noise law and update, gated and aided where asked, watching the parameters.

    Args:
        config: the configuration.
        model: with the parameters and faults of the configuration.
        base: folder that the file of a trained correction is relative to; the working folder by default.

    Raises:
        ConfigError: an unknown part or option, or options for a single filter where there are several.
        DataError: a correction that cannot be read, or was trained on other signals.
    """
    chosen = make_filter(config.filter)
    if config.noise is not None:
        chosen = _with_noise(chosen, config, make_part(AbstractNoise, config.noise, "noise"))
    if config.update is not None:
        _once(config, "update")
        update = make_part(AbstractUpdate, config.update, "update")
        chosen = dataclasses.replace(single_filter(chosen, "update", " to have it"), update=update)
    if config.options.gate is not None:
        chosen = single_filter(chosen, "options.gate", " to gate")
        try:
            gated = Gated(chosen.update, config.options.gate, config.options.reacquire)
        except ConfigError as problem:
            raise ConfigError(f"options: {str(problem).replace('probability', 'gate', 1)}") from problem
        chosen = dataclasses.replace(chosen, update=gated)
    if config.options.aiding:
        chosen = single_filter(chosen, "options.aiding", " to aid")
        file = (base or Path()) / config.options.aiding
        chosen = aided_filter(chosen, load_part(file, model=model, kind=Corrected))
    return watching(chosen, model, config.parameters)


def _with_noise(chosen: AbstractEstimator, config: EstimateConfig, law: AbstractNoise) -> AbstractEstimator:
    """The filter with the configuration's noise law: in place of its own, or, if it but scales the model's, beneath it."""
    if isinstance(law, Scaled):
        try:
            return with_scaled_noise(chosen, law.states, law.outputs)
        except ConfigError as problem:
            raise ConfigError(f"noise: {str(problem).replace('estimator: ', '', 1)}") from problem
    _once(config, "noise")
    return dataclasses.replace(single_filter(chosen, "noise", " to have it"), noise=law)


def _once(config: EstimateConfig, part: str) -> None:
    """Refuse a part of the filter that is given apart from it and in it."""
    if isinstance(config.filter, Mapping) and part in config.filter:
        raise ConfigError(f"{part}: expected it here or in filter.{part}, got it in both")


def build_parameters(config: EstimateConfig, model: AbstractModel) -> AbstractModel:
    """The model with the parameters of a configuration as further states; itself if there are none.

    Raises:
        ConfigError: not a parameter of the model, or a number that is no such size.
    """
    with _blamed("parameters"):
        return with_parameters(model, config.parameters)


def build_prior(config: EstimateConfig, model: AbstractModel) -> Gaussian:
    """The prior of a configuration; that of its faults is their own.

    Raises:
        ConfigError: values that do not fit the model's states.
    """
    with _blamed(""):
        base = model.base if isinstance(model, FaultModel) else model
        mean, std, cov = extended_prior(config.prior, base, config.parameters)
        prior = make_prior(base, mean, std, cov=cov)
        return extend_prior(model, prior) if isinstance(model, FaultModel) else prior


def build_faults(config: EstimateConfig, model: AbstractModel) -> AbstractModel:
    """The model with the faults of a configuration as further states; itself if there are none.

    Raises:
        ConfigError: an unknown signal, or a number that is no such size.
    """
    section = config.faults
    if section is None:
        return model
    for role, value in (("threshold", section.threshold), ("false_alarms", section.false_alarms)):
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise ConfigError(f"faults.{role}: expected a number above 0, got {value!r}")
    with _blamed("faults"):
        return with_faults(model, [_fault(each) for each in section.states])


def build_injections(config: EstimateConfig, log: Log, model: AbstractModel) -> Log:
    """The record with the faults that a configuration puts into it.

    Raises:
        ConfigError: an unknown signal, or a fault that it cannot have.
    """
    if not config.inject:
        return log
    with _blamed("inject"):
        faults = [_injection(each) for each in config.inject]
        faulty = inject(log, model, faults, jax.random.key(0))
    # How far a record was sound before is not known, so the fault put in is not the whole truth of a fault's state.
    return dataclasses.replace(faulty, truth=log.truth)


def _injection(section: InjectSection) -> AbstractInjection:
    make = {"bias": Bias, "drift": Drift, "stuck": Stuck, "loss": Loss, "noise": NoiseIncrease}
    span = (section.onset, math.inf if section.end is None else section.end)
    if section.kind != "outliers":
        if section.share is not None:
            raise ConfigError(f'inject.share: has no effect with kind = "{section.kind}"')
        return make[section.kind](section.signal, section.size, *span)
    if section.share is None:
        raise ConfigError('inject.share: missing; which share of the values are "outliers"?')
    return Outliers(section.signal, section.share, section.size, *span)


def _fault(section: FaultSection) -> Fault:
    fading = math.inf if section.time_constant is None else section.time_constant
    given: dict[str, Any] = dataclasses.asdict(section) | {"time_constant": fading}
    return Fault(**given)


@contextlib.contextmanager
def _blamed(section: str) -> Iterator[None]:
    """What goes wrong inside is the configuration's fault."""
    try:
        yield
    except ConfigError:
        raise
    except (GainfulError, ValueError) as problem:
        raise ConfigError(f"{section}: {problem}" if section else str(problem)) from problem


def _bare_model(section: ModelSection, base: Path) -> AbstractModel:
    if bool(section.catalogue) == bool(section.file):
        given = "both" if section.file else "neither"
        raise ConfigError(f"model: expected either a catalogue name or a file, got {given}")
    if section.catalogue:
        _only(section, {"catalogue"} | _CALLED, "has no effect on a model of the catalogue")
        if section.catalogue not in CATALOGUE:
            raise ConfigError(
                f"model.catalogue: {section.catalogue!r} is not known; {did_you_mean(section.catalogue, CATALOGUE)}"
            )
        model = _call(CATALOGUE[section.catalogue], section.arguments, f"model.catalogue {section.catalogue!r}")
    elif section.kind:
        idle = {"substeps"} if section.kind == "discrete" else set()
        _only(section, {"file"} | _FUNCTIONS - idle, f'has no effect with kind = "{section.kind}"')
        return _from_functions(section, load_python(base / section.file, "model.file"))
    else:
        _only(section, {"file", "function"} | _CALLED, 'needs kind = "continuous" or "discrete"')
        module, name = load_python(base / section.file, "model.file"), section.function or "model"
        model = _call(_attribute(module, name, "model.function"), section.arguments, f"model.function {name!r}")
    if not isinstance(model, AbstractModel):
        raise ConfigError(f"model: expected the function to return a model, got {type(model).__name__}")
    return model


def _only(section: ModelSection, used: set[str], why: str) -> None:
    """Refuse keys that would be ignored."""
    bare = ModelSection()
    for field in dataclasses.fields(section):
        if field.name not in used | _ALWAYS and getattr(section, field.name) != getattr(bare, field.name):
            raise ConfigError(f"model.{field.name}: {why}")


def _signals(given: Signals | None, key: str) -> Any:
    if not isinstance(given, Mapping):
        return given
    return {
        name: bounds_of(f"model.{key}.{name}", value) if isinstance(value, list) else value
        for name, value in given.items()
    }


def _from_functions(section: ModelSection, module: types.ModuleType) -> AbstractModel:
    def named(value: Any, key: str) -> Any:
        return _attribute(module, value, f"model.{key}") if isinstance(value, str) else value

    if section.states is None:
        raise ConfigError("model.states: missing")
    if section.Q is None:
        raise ConfigError("model.Q: missing")
    sensors = [
        sensor(
            name,
            named(part.h, f"sensors.{name}.h"),
            outputs=_signals(part.outputs, f"sensors.{name}.outputs"),
            R=named(part.R, f"sensors.{name}.R"),
        )
        for name, part in section.sensors.items()
    ]
    h = section.h or ("" if sensors else "h")
    make = continuous_model if section.kind == "continuous" else discrete_model
    steps = {"substeps": section.substeps} if section.kind == "continuous" else {}
    return make(
        named(section.f, "f"),
        named(h, "h") if h else None,
        states=_signals(section.states, "states"),
        outputs=_signals(section.outputs, "outputs"),
        inputs=_signals(section.inputs, "inputs") or (),
        Q=named(section.Q, "Q"),
        R=named(section.R, "R"),
        G=named(section.G, "G"),
        sensors=sensors or None,
        parameters=section.parameters,
        **steps,
    )


def _attribute(module: types.ModuleType, name: str, key: str) -> Any:
    functions = [n for n, value in vars(module).items() if callable(value) and not n.startswith("_")]
    if not callable(getattr(module, name, None)):
        raise ConfigError(
            f"{key}: {Path(str(module.__file__)).name} has no function {name!r}; {did_you_mean(name, functions)}"
        )
    return getattr(module, name)


def _call(make: Any, arguments: dict[str, Any], role: str) -> Any:
    known = inspect.signature(make).parameters
    if not any(parameter.kind is parameter.VAR_KEYWORD for parameter in known.values()):
        for key in arguments:
            if key not in known:
                raise ConfigError(f"model.arguments.{key}: {role} has no such argument; {did_you_mean(key, known)}")
    with own_failures(f"{role} failed"):
        return make(**arguments)
