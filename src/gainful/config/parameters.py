"""Parameters estimated together with the states, as a configuration names them."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ..errors import ConfigError, did_you_mean
from ..filters import AbstractEstimator
from ..models import AbstractModel, AugmentedModel, augment
from ..models.extended import layers
from ..noise import Capped
from ..running.prior import tangent_scale
from ..updates import ChangeDetection
from .parts import single_filter
from .schema import ParameterSection, PriorSection


def bounds_of(path: str, values: list[float]) -> tuple[float | None, float | None]:
    """Lower and upper bound, the upper one left open where there is one number.

    Raises:
        ConfigError: another count of numbers.
    """
    if len(values) not in (1, 2):
        raise ConfigError(f"{path}: expected one or two numbers, got {values}")
    return values[0], values[1] if len(values) == 2 else None


def with_parameters(model: AbstractModel, sections: dict[str, ParameterSection]) -> AbstractModel:
    """The model with its uncertain parameters as states; itself if there are none.

    Raises:
        ConfigError: not a parameter of the model, or a number that is no such size.
    """
    if not sections:
        return model
    for name, section in sections.items():
        if name not in model.parameters:
            raise ConfigError(
                f"parameters: {name!r} is not a parameter of the model; {did_you_mean(name, model.parameters)}"
            )
        for key in ("sigma", "walk", "jump", "limit"):
            value = getattr(section, key)
            least = "at least 0" if key == "walk" else "above 0"
            if value is not None and not (math.isfinite(value) and (value > 0 or (key == "walk" and value == 0))):
                raise ConfigError(f"parameters.{name}.{key}: expected a number {least}, got {value!r}")
    bounds = {
        name: bounds_of(f"parameters.{name}.bounds", section.bounds)
        for name, section in sections.items()
        if section.bounds is not None
    }
    return augment(model, parameters={name: each.walk for name, each in sections.items()}, bounds=bounds)


def extended_prior(
    prior: PriorSection, model: AbstractModel, sections: dict[str, ParameterSection]
) -> tuple[Any, Any, Any]:
    """Mean, standard deviations and covariance of a prior with the parameters' own added.

    Raises:
        ConfigError: a parameter that has an entry in the prior already.
    """
    if not sections:
        return prior.mean, prior.std, prior.cov
    starts, sigmas = _starts(model, sections), {name: each.sigma for name, each in sections.items()}
    if prior.cov is not None:
        raise ConfigError('prior.cov: expected "std" where there are [parameters], which bring their own sigma')
    return _joined(prior.mean, starts, "mean"), _joined(prior.std, sigmas, "std"), None


def watching(
    chosen: AbstractEstimator, model: AbstractModel, sections: dict[str, ParameterSection]
) -> AbstractEstimator:
    """The filter, told how parameters may jump and how uncertain they may become.

    Raises:
        ConfigError: jumps or limits with an estimator that is not a single filter.
    """
    limits = {name: each.sigma if each.limit is None else each.limit for name, each in sections.items() if each.walk}
    jumps = {name: each.jump for name, each in sections.items() if each.jump is not None}
    if not limits and not jumps:
        return chosen
    chosen = single_filter(chosen, "parameters", " to watch them")
    scale = _tangent(model, sections)
    noise, update = chosen.noise, chosen.update
    if limits:
        noise = Capped({scale[name][0]: limit * scale[name][1] for name, limit in limits.items()}, noise)
    if jumps:
        update = ChangeDetection({scale[name][0]: jump * scale[name][1] for name, jump in jumps.items()}, update)
    return dataclasses.replace(chosen, noise=noise, update=update)


def _starts(model: AbstractModel, sections: dict[str, ParameterSection]) -> dict[str, float]:
    base = _joint(model).base.parameters
    return {name: float(base[name]) if each.start is None else each.start for name, each in sections.items()}


def _joint(model: AbstractModel) -> AugmentedModel:
    return next(each for each in layers(model) if isinstance(each, AugmentedModel) and each.parameter_names)


def _tangent(model: AbstractModel, sections: dict[str, ParameterSection]) -> dict[str, tuple[str, float]]:
    """What the covariance calls each parameter, and its units per unit of the parameter, at the start."""
    joint, starts = _joint(model), _starts(model, sections)
    point = np.array([starts[name] for name in joint.parameter_names])
    space, scale = joint.extra, tangent_scale(joint.extra, point)
    return {name: (space.tangent_names[i], float(scale[i])) for i, name in enumerate(joint.parameter_names)}


def _joined(given: Any, more: dict[str, float], role: str) -> Any:
    if isinstance(given, dict):
        for name in more:
            if name in given:
                raise ConfigError(f"prior.{role}.{name}: expected it in [parameters] alone, got it in both")
        return given | more
    return given if given is None else [*given, *more.values()]
