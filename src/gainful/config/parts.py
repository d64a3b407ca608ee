"""Parts of filters from tables and back: a table is the part's constructor written down, `kind` its name."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Mapping
from typing import Any

import pydantic

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate, Friedland, Gaussian, SquareRoot, TwoStage
from ..filters import (
    AbstractEstimator,
    GeneralizedLikelihoodRatio,
    InteractingMultipleModel,
    KalmanFilter,
    adaptive_two_stage_unscented_kalman_filter,
    cubature_kalman_filter,
    extended_kalman_filter,
    huber_kalman_filter,
    iterated_extended_kalman_filter,
    kalman_filter,
    maximum_correntropy_kalman_filter,
    robust_extended_kalman_filter,
    robust_unscented_kalman_filter,
    student_t_kalman_filter,
    two_stage_extended_kalman_filter,
    two_stage_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
    weighted_likelihood_kalman_filter,
)
from ..linearization import (
    AbstractLinearization,
    AbstractRule,
    Cubature,
    GaussHermite,
    MarginalSigmaPoints,
    SigmaPoints,
    Taylor,
    Unscented,
)
from ..networks import AbstractTraining, AffineTraining, CMACTraining, HarmonicTraining, PerceptronTraining
from ..noise import AbstractNoise, Capped, InnovationMatching, Nominal, SageHusa, Scaled
from ..regression import (
    AbstractRowNoise,
    ConstantRowNoise,
    DecoupledKalmanTraining,
    KalmanTraining,
    RateRowNoise,
    RayleighTotalLeastSquares,
    RecursiveLeastSquares,
    RecursiveTotalLeastSquares,
)
from ..updates import (
    AbstractFeatures,
    AbstractUpdate,
    ChangeDetection,
    Considered,
    Context,
    Exact,
    Gated,
    HuberReweighted,
    InnovationHistory,
    InnovationScaling,
    Iterated,
    MasreliezMartin,
    MaximumCorrentropy,
    StrongTracking,
    StudentT,
    UpdateFeatures,
    VariationalCovariances,
    VariationalNoise,
    WeightedLikelihood,
)
from .wording import members, mismatch, shown

KINDS: dict[type, dict[str, type]] = {
    AbstractLinearization: {
        "taylor": Taylor,
        "sigma_points": SigmaPoints,
        "marginal_sigma_points": MarginalSigmaPoints,
    },
    AbstractRule: {"unscented": Unscented, "cubature": Cubature, "gauss_hermite": GaussHermite},
    AbstractUpdate: {
        "change_detection": ChangeDetection,
        "considered": Considered,
        "exact": Exact,
        "gated": Gated,
        "huber_reweighted": HuberReweighted,
        "innovation_scaling": InnovationScaling,
        "iterated": Iterated,
        "masreliez_martin": MasreliezMartin,
        "maximum_correntropy": MaximumCorrentropy,
        "strong_tracking": StrongTracking,
        "student_t": StudentT,
        "variational_covariances": VariationalCovariances,
        "variational_noise": VariationalNoise,
        "weighted_likelihood": WeightedLikelihood,
    },
    AbstractNoise: {
        "capped": Capped,
        "innovation_matching": InnovationMatching,
        "nominal": Nominal,
        "sage_husa": SageHusa,
        "scaled": Scaled,
    },
    AbstractEstimate: {
        "friedland": Friedland,
        "gaussian": Gaussian,
        "square_root": SquareRoot,
        "two_stage": TwoStage,
    },
    AbstractRowNoise: {"constant": ConstantRowNoise, "rate": RateRowNoise},
    AbstractTraining: {
        "affine": AffineTraining,
        "cmac": CMACTraining,
        "decoupled_kalman": DecoupledKalmanTraining,
        "harmonic": HarmonicTraining,
        "kalman": KalmanTraining,
        "perceptron": PerceptronTraining,
    },
    AbstractFeatures: {"context": Context, "history": InnovationHistory, "update": UpdateFeatures},
}
"""Every part by what it is and what a table calls it."""

FILTERS: dict[str, Callable[..., AbstractEstimator]] = {
    "kalman_filter": kalman_filter,
    "extended_kalman_filter": extended_kalman_filter,
    "iterated_extended_kalman_filter": iterated_extended_kalman_filter,
    "unscented_kalman_filter": unscented_kalman_filter,
    "cubature_kalman_filter": cubature_kalman_filter,
    "two_stage_kalman_filter": two_stage_kalman_filter,
    "two_stage_extended_kalman_filter": two_stage_extended_kalman_filter,
    "two_stage_unscented_kalman_filter": two_stage_unscented_kalman_filter,
    "adaptive_two_stage_unscented_kalman_filter": adaptive_two_stage_unscented_kalman_filter,
    "robust_extended_kalman_filter": robust_extended_kalman_filter,
    "robust_unscented_kalman_filter": robust_unscented_kalman_filter,
    "huber_kalman_filter": huber_kalman_filter,
    "student_t_kalman_filter": student_t_kalman_filter,
    "maximum_correntropy_kalman_filter": maximum_correntropy_kalman_filter,
    "weighted_likelihood_kalman_filter": weighted_likelihood_kalman_filter,
    "generalized_likelihood_ratio": GeneralizedLikelihoodRatio,
    "interacting_multiple_model": InteractingMultipleModel,
    "recursive_least_squares": RecursiveLeastSquares,
    "recursive_total_least_squares": RecursiveTotalLeastSquares,
    "rayleigh_total_least_squares": RayleighTotalLeastSquares,
    "assembled": KalmanFilter,
}
ACRONYMS = {
    "kf": "kalman_filter",
    "ekf": "extended_kalman_filter",
    "iekf": "iterated_extended_kalman_filter",
    "ukf": "unscented_kalman_filter",
    "ckf": "cubature_kalman_filter",
    "tskf": "two_stage_kalman_filter",
    "tsekf": "two_stage_extended_kalman_filter",
    "tsukf": "two_stage_unscented_kalman_filter",
    "atsukf": "adaptive_two_stage_unscented_kalman_filter",
    "rekf": "robust_extended_kalman_filter",
    "rukf": "robust_unscented_kalman_filter",
    "mckf": "maximum_correntropy_kalman_filter",
    "wolf": "weighted_likelihood_kalman_filter",
    "glr": "generalized_likelihood_ratio",
    "imm": "interacting_multiple_model",
    "rls": "recursive_least_squares",
    "rtls": "recursive_total_least_squares",
    "frtls": "rayleigh_total_least_squares",
}


def make_filter(table: str | Mapping[str, Any], path: str = "filter") -> AbstractEstimator:
    """The filter a table describes: a named one with its options, or `kind = "assembled"` with its parts.

    Args:
        table: a name such as "ukf", or a mapping with `kind` and the constructor's arguments.
        path: where the table stands, for messages.

    Raises:
        ConfigError: an unknown kind or key, or a value of the wrong kind.

    Example:
        >>> make_filter({"kind": "ukf", "alpha": 0.5}).linearization.rule.alpha  # type: ignore[attr-defined]
        0.5
    """
    kind, arguments = _opened(table, path)
    name = ACRONYMS.get(kind, kind)
    if name not in FILTERS:
        raise ConfigError(f"{path}.kind: {kind!r} is not a filter; {did_you_mean(kind, [*FILTERS, *ACRONYMS])}")
    return _construct(FILTERS[name], arguments, path)


def make_part(slot: type, table: str | Mapping[str, Any], path: str) -> Any:
    """The part of a slot (an abstract class of `KINDS`) that a table describes."""
    kind, arguments = _opened(table, path)
    kinds = KINDS[slot]
    if kind not in kinds:
        raise ConfigError(f"{path}.kind: {kind!r} is not known here; {did_you_mean(kind, kinds)}")
    return _construct(kinds[kind], arguments, path)


def dump_part(part: Any) -> dict[str, Any]:
    """The table that `make_part` or `make_filter` turns into an equal part."""
    cls = type(part)
    name = next((k for kinds in (FILTERS, *KINDS.values()) for k, c in kinds.items() if c is cls), None)
    if name is None:
        raise ConfigError(f"{cls.__name__} has no name in configuration files")
    table: dict[str, Any] = {"kind": name}
    for field in inspect.signature(cls).parameters:
        value = getattr(part, field)
        if isinstance(value, type):
            table[field] = next(k for k, c in KINDS[AbstractEstimate].items() if c is value)
        elif isinstance(value, AbstractEstimator) or _slot_of(type(value)) is not None:
            table[field] = dump_part(value)
        elif isinstance(value, tuple) and value and isinstance(value[0], AbstractEstimator):
            table[field] = [dump_part(each) for each in value]
        else:
            table[field] = value
    return table


def _opened(table: str | Mapping[str, Any], path: str) -> tuple[str, dict[str, Any]]:
    if isinstance(table, str):
        return table, {}
    if not isinstance(table, Mapping) or not isinstance(table.get("kind"), str):
        raise ConfigError(f"{path}: expected a name or a table with a kind, got {shown(table)}")
    return table["kind"], {key: value for key, value in table.items() if key != "kind"}


def _construct(make: Callable[..., Any], arguments: dict[str, Any], path: str) -> Any:
    annotations = typing.get_type_hints(make.__init__ if isinstance(make, type) else make)
    known = list(inspect.signature(make).parameters)
    values = {}
    for key, given in arguments.items():
        if key not in known:
            raise ConfigError(f"{path}.{key}: unknown key; {did_you_mean(key, known)}")
        values[key] = _value(annotations.get(key, Any), given, f"{path}.{key}")
    try:
        return make(**values)
    except ConfigError as problem:
        raise ConfigError(f"{path}: {problem}") from problem


def _value(annotation: Any, given: Any, path: str) -> Any:
    if typing.get_origin(annotation) is type:
        kinds = KINDS[AbstractEstimate]
        if not isinstance(given, str) or given not in kinds:
            raise ConfigError(f"{path}: {shown(given)} is not known here; {did_you_mean(str(given), kinds)}")
        return kinds[given]
    if annotation is KalmanFilter:
        return _kalman(given, path)
    if annotation == tuple[KalmanFilter, ...]:
        if not isinstance(given, list | tuple):
            raise ConfigError(f"{path}: expected a list of filters, got {shown(given)}")
        return tuple(_kalman(each, f"{path}[{i}]") for i, each in enumerate(given))
    slot = _slot_of(annotation) if isinstance(annotation, type) else None
    if slot is not None:
        return make_part(slot, given, path)
    try:
        return pydantic.TypeAdapter(annotation).validate_python(_fixed(given), strict=True)
    except pydantic.ValidationError as problem:
        raise ConfigError(f"{path}: {mismatch(members(annotation), given)}") from problem


def _fixed(given: Any) -> Any:
    """Lists, which is how files write them, as tuples, which is what parts hold."""
    return tuple(_fixed(each) for each in given) if isinstance(given, list) else given


def _kalman(given: Any, path: str) -> KalmanFilter:
    return single_filter(make_filter(given, path), path)


def single_filter(made: AbstractEstimator, path: str, purpose: str = "") -> KalmanFilter:
    """The estimator, if it is a single filter.

    Raises:
        ConfigError: it is not, blamed on `path`, which wants it for a purpose.
    """
    if not isinstance(made, KalmanFilter):
        raise ConfigError(f"{path}: expected a single filter{purpose}, got a {type(made).__name__}")
    return made


def _slot_of(cls: type) -> type | None:
    return next((slot for slot in KINDS if issubclass(cls, slot)), None)
