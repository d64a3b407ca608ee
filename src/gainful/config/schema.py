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
    """Parameters and biases estimated as states.

    Attributes:
        parameters: names, each with its random walk per square root of a second.
        biases: names of outputs or inputs, likewise.
        bounds: lower and upper bound of a parameter; one bound alone must be 0 below, written [0.0].
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    parameters: dict[str, float] = dataclasses.field(default_factory=dict)
    biases: dict[str, float] = dataclasses.field(default_factory=dict)
    bounds: dict[str, list[float]] = dataclasses.field(default_factory=dict)


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
        augment: parameters and biases estimated as states.
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
class OptionsSection:
    """What to do besides filtering.

    Attributes:
        smooth: also estimate each state from the whole record.
        gate: share of good measurements that pass a chi-square gate, such as 0.999; no gate if absent.
        reacquire: rejections in a row before a gated sensor is believed again.
        throw: stop at the first failed step; otherwise carry the last good estimate on and say so.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    smooth: bool = False
    gate: float | None = None
    reacquire: int = 10
    throw: bool = True


@dataclasses.dataclass(frozen=True)
class EstimateConfig:
    """A whole configuration file of `gainful estimate`.

    Attributes:
        model: how the state moves and is measured.
        data: the record.
        prior: the estimate before the first row.
        filter: a name such as "ukf", or a table with `kind` and options.
        options: smoothing, gating.
        title: of the report; the file's name if empty.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    model: ModelSection
    data: Source
    prior: PriorSection
    filter: str | dict[str, Any] = "ekf"
    options: OptionsSection = dataclasses.field(default_factory=OptionsSection)
    title: str = ""
