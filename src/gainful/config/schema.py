"""The sections of a configuration file, as dataclasses."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Literal

from ..io import Source

_STRICT: dict[str, Any] = {"extra": "forbid"}

Signals = int | list[str] | dict[str, str | list[float]]
"""A count, names, or names with units, "angle", "quaternion" or two bounds."""


@dataclasses.dataclass(frozen=True)
class SensorSection:
    """One sensor of a model with several.

    Attributes:
        h: name of its function in the model's file.
        R: covariance: a number, variances, a matrix, or the name of a function in the file.
        outputs: its signals; by default one called as the sensor.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    h: str
    R: float | list[float] | list[list[float]] | str
    outputs: Signals | None = None


@dataclasses.dataclass(frozen=True)
class AugmentSection:
    """Biases estimated as states.

    Attributes:
        biases: names of outputs or inputs, each with its random walk per square root of a second.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    biases: dict[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class ParameterSection:
    """A parameter of the model estimated as a state.

    Attributes:
        sigma: standard deviation before the first row, in the parameter's own unit.
        walk: how fast it may change: sigma per square root of a second; 0 for constant.
        start: value before the first row; the model's own if absent.
        bounds: lower and upper bound; one bound alone must be 0 below, written [0.0].
        jump: standard deviation of a sudden change to look for; none is looked for if absent.
        limit: largest standard deviation the walk may lead to; `sigma` if absent.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    sigma: float
    walk: float = 0.0
    start: float | None = None
    bounds: list[float] | None = None
    jump: float | None = None
    limit: float | None = None


@dataclasses.dataclass(frozen=True)
class ModelSection:
    """The model: from the catalogue, from a function in a Python file that returns one, or from plain functions in it.

    Attributes:
        catalogue: name of a ready model.
        file: Python file, relative to the configuration.
        function: function in the file that returns a model.
        arguments: of the catalogue model or of the function.
        kind: "continuous" or "discrete" for plain functions.
        f: name of the rate or transition function.
        h: name of the measurement function.
        states: names and units.
        outputs: names and units.
        inputs: names and units.
        Q: process noise: numbers or the name of a function.
        R: measurement noise, likewise.
        G: where the process noise enters, likewise.
        sensors: several sensors in place of h, outputs and R.
        parameters: values the functions reach as `p`.
        substeps: Runge-Kutta steps per interval, for continuous models.
        augment: biases estimated as states.
        sensor_maps: files of learned sensor errors, relative to the configuration.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    catalogue: str = ""
    file: str = ""
    function: str = ""
    arguments: dict[str, Any] = dataclasses.field(default_factory=dict)
    kind: Literal["", "continuous", "discrete"] = ""
    f: str = "f"
    h: str = ""
    states: Signals | None = None
    outputs: Signals | None = None
    inputs: Signals | None = None
    Q: float | list[float] | list[list[float]] | str | None = None
    R: float | list[float] | list[list[float]] | str | None = None
    G: list[list[float]] | str | None = None
    sensors: dict[str, SensorSection] = dataclasses.field(default_factory=dict)
    parameters: dict[str, float] = dataclasses.field(default_factory=dict)
    substeps: int = 1
    augment: AugmentSection | None = None
    sensor_maps: list[str] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class PriorSection:
    """The estimate before the first row.

    Attributes:
        mean: value of each state by name (a quaternion: four numbers, scalar last), or all in order.
        std: standard deviation of each state by name, or one per degree of freedom in order.
        cov: covariance in place of `std`.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    mean: dict[str, float | list[float]] | list[float]
    std: dict[str, float | list[float]] | list[float] | None = None
    cov: list[list[float]] | None = None


@dataclasses.dataclass(frozen=True)
class FaultSection:
    """A fault estimated as a state, see `gainful.faults.Fault`.

    Attributes:
        kind: "offset" or "loss" of an input, "bias" or "scale" of an output.
        signal: name of the input or output.
        walk: how fast it may change: sigma per square root of a second.
        sigma: standard deviation before the first row.
        bound: largest physical size.
        time_constant: of a fault that fades out [s].
        per_step: whether `walk` is per step.
        rate_sigma: of a fault that drifts, standard deviation of its rate before the first row, per second.
        rate_walk: how fast that rate may change: sigma per square root of a second.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    kind: Literal["offset", "loss", "bias", "scale"]
    signal: str
    sigma: float
    walk: float = 0.0
    bound: float | None = None
    time_constant: float | None = None
    per_step: bool = False
    rate_sigma: float | None = None
    rate_walk: float = 0.0


@dataclasses.dataclass(frozen=True)
class FaultsSection:
    """Faults to look for, and when to raise an alarm.

    Attributes:
        states: the faults.
        threshold: an alarm is raised where a fault's estimate exceeds so many of its standard deviations.
        false_alarms: in place of `threshold`, false alarms per 1000 s, for which it is found by simulation.
        hold_off: no alarm within so long of the first row [s].
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    states: list[FaultSection]
    threshold: float = 5.0
    false_alarms: float | None = None
    hold_off: float = 0.0


@dataclasses.dataclass(frozen=True)
class InjectSection:
    """A fault put into the record, to see whether it is found.

    Attributes:
        kind: "bias", "drift", "stuck", "loss", "noise" or "outliers".
        signal: name of the input or output.
        size: bias, drift per second, level of a stuck signal, lost share, or sigma of the noise or the outliers.
        onset: first time it is there [s].
        end: time from which it is gone [s].
        share: of values that are outliers.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    kind: Literal["bias", "drift", "stuck", "loss", "noise", "outliers"]
    signal: str
    size: float
    onset: float
    end: float | None = None
    share: float | None = None


@dataclasses.dataclass(frozen=True)
class OptionsSection:
    """What to do besides filtering.

    Attributes:
        smooth: also estimate each state from the whole record.
        lag: smooth with what was measured until so many seconds after each row only.
        gate: share of good measurements that pass a chi-square gate, such as 0.999; no gate if absent.
        reacquire: rejections in a row before a gated sensor is believed again.
        aiding: file of a trained correction of the estimates, relative to the configuration.
        throw: stop at the first failed step; otherwise carry the last good estimate on and say so.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    smooth: bool = False
    lag: float | None = None
    gate: float | None = None
    reacquire: int = 10
    aiding: str = ""
    throw: bool = True


@dataclasses.dataclass(frozen=True)
class EstimateConfig:
    """A whole configuration file of `gainful estimate`.

    Attributes:
        model: how the state moves and is measured.
        data: the record.
        prior: the estimate before the first row.
        filter: a name such as "ukf", or a table with `kind` and options.
        update: of the filter: a name such as "masreliez_martin", or a table with `kind` and options.
        noise: law of Q and R in the filter: a name such as "sage_husa", or a table with `kind` and options; "scaled" goes
            beneath the filter's own, and into every filter of a bank.
        parameters: of the model, estimated as states.
        faults: faults estimated as states, with alarms.
        inject: faults put into the record on purpose.
        options: smoothing, gating.
        title: of the report; the file's name if empty.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    model: ModelSection
    data: Source
    prior: PriorSection
    filter: str | dict[str, Any] = "ekf"
    update: str | dict[str, Any] | None = None
    noise: str | dict[str, Any] | None = None
    parameters: dict[str, ParameterSection] = dataclasses.field(default_factory=dict)
    faults: FaultsSection | None = None
    inject: list[InjectSection] = dataclasses.field(default_factory=list)
    options: OptionsSection = dataclasses.field(default_factory=OptionsSection)
    title: str = ""
