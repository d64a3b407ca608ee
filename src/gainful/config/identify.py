"""The sections of a configuration of `gainful identify`, and the equation and recordings that they describe."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from ..errors import ConfigError, did_you_mean
from ..identification import Equation, Recording, parse_equation
from ..identification.terms import CONSTANTS, FUNCTIONS
from ..io import Column, Resample, Source, read_recording
from ..io.source import RecordFiles
from ..regression.weak_form import WINDOW
from .files import load_python
from .network import NetworkSection

_STRICT: dict[str, Any] = {"extra": "forbid"}


@dataclasses.dataclass(frozen=True)
class EquationSection:
    """An equation that is linear in its parameters: `of = parameter_1 term_1 + ...`.

    Attributes:
        of: what is explained, a term.
        terms: by the name of the parameter that multiplies it.
        where: a condition such as "abs(pitch) > 0.2"; rows count only where it holds.
        file: Python file, relative to the configuration, whose functions terms may call.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    of: str
    terms: dict[str, str]
    where: str | None = None
    file: str = ""


@dataclasses.dataclass(frozen=True)
class RecordingSection(RecordFiles):
    """The recording.

    Attributes:
        signals: where each signal is found: a column, or a list of them for several sensors of the same motion.
        noise: standard deviation of one sensor's noise by signal, where it is known, in the signal's unit.
        dt: time between rows [s]; by default the file's own.
        resample: "none" where samples are equally spaced but for missing ones, or "linear" interpolation.

    Files, times and rows as `RecordFiles` has them. An empty `time` stands for rows equally spaced by `dt`; of rows at one
    time none can be kept.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    signals: dict[str, str | Column | list[str | Column]]
    noise: dict[str, float] = dataclasses.field(default_factory=dict)
    dt: float | None = None
    resample: Resample = "none"


@dataclasses.dataclass(frozen=True)
class CheckSection:
    """Rows that are kept back, to hold the equation against.

    Attributes:
        share: of the recording, its last rows; 0 for none.
        file: another file with the same columns, in place of a share.
        start: leave out its rows before this time [s].
        stop: leave out its rows after this time [s].
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    share: float | None = None
    file: str = ""
    start: float | None = None
    stop: float | None = None


@dataclasses.dataclass(frozen=True)
class IdentifyOptions:
    """How parameters are found.

    Attributes:
        window: samples of the test function of weak methods, odd.
        lag: rows over which residuals may be correlated; by default about twice what a row reaches over.
        level: of the intervals.
        forgetting: of recursive methods, how much a row counts one row later.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    window: int = WINDOW
    lag: int | None = None
    level: float = 0.95
    forgetting: float = 1.0


@dataclasses.dataclass(frozen=True)
class IdentifyConfig:
    """A whole configuration file of `gainful identify`.

    Attributes:
        signals: names and units of all that is measured.
        data: the recording.
        equation: whose parameters are wanted.
        network: that predicts a signal, in place of an equation.
        method: such as "weak-iv"; by default what fits the recording.
        check: rows that are kept back.
        options: window, level, forgetting.
        title: of the report; the file's name if empty.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = _STRICT

    signals: dict[str, str]
    data: RecordingSection
    equation: EquationSection | None = None
    network: NetworkSection | None = None
    method: str | None = None
    check: CheckSection = dataclasses.field(default_factory=CheckSection)
    options: IdentifyOptions = dataclasses.field(default_factory=IdentifyOptions)
    title: str = ""


_SHARE = 0.3
"""Share of a recording that is kept back unless said otherwise."""


def build_equation(config: IdentifyConfig, base: Path) -> Equation:
    """The equation of a configuration.

    Args:
        config: the configuration.
        base: folder that the file of functions is relative to.

    Raises:
        ConfigError: not an equation, or a file that is not there or fails.
    """
    check_names(config.signals)
    section = config.equation
    if section is None:
        raise ConfigError("equation or network: expected one of the two sections, got neither")
    functions = {}
    if section.file:
        module = load_python(base / section.file, "equation.file")
        functions = {name: one for name, one in vars(module).items() if callable(one) and not name.startswith("_")}
    try:
        return parse_equation(section.of, section.terms, config.signals, functions, section.where)
    except ConfigError as problem:
        raise ConfigError(f"equation.{problem}") from problem


def check_names(signals: Iterable[str]) -> None:
    """Raise unless terms can name the signals."""
    for name in signals:
        if not name.isidentifier() or name in (*CONSTANTS, *FUNCTIONS, "d", "lag"):
            raise ConfigError(f"signals: expected names such as 'rate' that no function has, got {name!r}")


def build_recordings(config: IdentifyConfig, wanted: Iterable[str], base: Path) -> tuple[Recording, Recording | None]:
    """The recording to find parameters in, and the one to hold them against, if any is kept back.

    Args:
        config: the configuration.
        wanted: signals that the equation or the network asks for.
        base: folder that `data.folder` is relative to.

    Raises:
        ConfigError: a signal without a column, or numbers out of their range.
        DataError: a file, column, time or number that cannot be used; the message says which.
    """
    data, check = config.data, config.check
    asking = "equation" if config.network is None else "network"
    for name in wanted:
        if name not in data.signals:
            raise ConfigError(f"data.signals: the {asking}'s {name!r} has no column")
    for role, given in (("data.signals", data.signals), ("data.noise", data.noise)):
        for name in given:
            if name not in config.signals:
                raise ConfigError(f"{role}: {name!r} is not a signal; {did_you_mean(name, config.signals)}")
    whole = _read(config, data, base)
    other = check.file or check.start is not None or check.stop is not None
    if other:
        if check.share is not None:
            raise ConfigError("check: expected a share of the recording or another one, got both")
        second = dataclasses.replace(data, file=check.file or data.file, start=check.start, stop=check.stop)
        return whole, _read(config, second, base)
    share = _SHARE if check.share is None else check.share
    if not 0.0 <= share < 1.0:
        raise ConfigError(f"check.share: expected a number of at least 0 and below 1, got {share!r}")
    kept = round((1.0 - share) * len(whole))
    return (whole, None) if share == 0.0 else (whole.part(0, kept), whole.part(kept, len(whole)))


def _read(config: IdentifyConfig, data: RecordingSection, base: Path) -> Recording:
    listed = {
        name: [
            Column(each) if isinstance(each, str) else each for each in (given if isinstance(given, list) else [given])
        ]
        for name, given in data.signals.items()
    }
    source = Source({}, **{field.name: getattr(data, field.name) for field in dataclasses.fields(RecordFiles)})
    return read_recording(config.signals, listed, source, base, noise=data.noise, dt=data.dt, resample=data.resample)
