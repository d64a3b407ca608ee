"""Where each signal of a record is found."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Literal

Hold = Literal["previous", "next", "linear"]
Late = Literal["refuse", "sort"]
Duplicates = Literal["refuse", "keep", "first", "last"]


@dataclasses.dataclass(frozen=True)
class Column:
    """Where one signal is found, and how to read it.

    Attributes:
        column: its column, or four for a quaternion (scalar last).
        file: its file; the record's default file if empty.
        unit: of the numbers in the file; the model's own if empty. Of an increment, that of the change: "deg", not
            "deg/s".
        time: its time column; the record's if empty.
        where: take only rows in which these columns have these values.
        increment: the numbers are changes since the last row that has one; they are divided by the time since then.
        hold: for inputs: "previous" holds a value until the next one, "next" applies it to the interval that ends at
            its time, "linear" interpolates. An increment is always "next".
        missing: numbers that stand for a missing value.
        scale: factor applied before anything else.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    column: str | list[str]
    file: str = ""
    unit: str = ""
    time: str = ""
    where: dict[str, Any] = dataclasses.field(default_factory=dict)
    increment: bool = False
    hold: Hold = "previous"
    missing: list[float] = dataclasses.field(default_factory=list)
    scale: float = 1.0


@dataclasses.dataclass(frozen=True)
class LocalFrame:
    """Columns `east`, `north`, `up` [m] made from geodetic ones in some files.

    Attributes:
        files: the files; the record's default file if empty.
        latitude: column [deg].
        longitude: column [deg].
        height: column [m above the ellipsoid]; 0 if empty.
        origin: latitude [deg], longitude [deg], height [m] of the origin; the first row's if empty.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    latitude: str
    longitude: str
    height: str = ""
    files: list[str] = dataclasses.field(default_factory=list)
    origin: list[float] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class Outage:
    """A time in which some outputs are left out on purpose, to see how far the estimates get without.

    Attributes:
        outputs: names of the outputs.
        start: first time without them [s].
        stop: first time with them again [s]; the record's end if none.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    outputs: list[str]
    start: float
    stop: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class RecordFiles:
    """Where the files of a record are, what their times mean, and which rows count.

    Attributes:
        folder: of the files, relative to the configuration.
        file: default file.
        time: default time column.
        time_unit: its unit; dates (also written out, ISO 8601, UTC) are read as seconds since 1970.
        late: "refuse" rows whose time goes back, or "sort" them.
        duplicates: rows of one signal at one time: "refuse", "keep" as separate measurements, or take the "first" or
            the "last". Rows in which a signal is missing do not count; of an input's values kept, the last holds.
        start: leave out rows before this time [s].
        stop: leave out rows after this time [s].
    """

    folder: str = "."
    file: str = ""
    time: str = "t"
    time_unit: str = "s"
    late: Late = "refuse"
    duplicates: Duplicates = "refuse"
    start: float | None = None
    stop: float | None = None


@dataclasses.dataclass(frozen=True)
class Source(RecordFiles):
    """A record in files.

    Attributes:
        outputs: where each measured signal is found, a `Column` or just its name; one left out is never measured.
        inputs: where each input is found.
        truth: reference values of states, for comparison only.
        max_step: longest interval predicted in one go [s]; longer ones are split.
        local: geodetic columns turned into metres.
        outages: times in which outputs are left out on purpose.

    By name, files, times and rows as `RecordFiles` has them.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    outputs: dict[str, Column]
    inputs: dict[str, Column] = dataclasses.field(default_factory=dict)
    truth: dict[str, Column] = dataclasses.field(default_factory=dict)
    max_step: float | None = None
    local: list[LocalFrame] = dataclasses.field(default_factory=list)
    outages: list[Outage] = dataclasses.field(default_factory=list)

    def __post_init__(self) -> None:
        for role in ("outputs", "inputs", "truth"):
            columns = {name: Column(c) if isinstance(c, str) else c for name, c in getattr(self, role).items()}
            object.__setattr__(self, role, columns)
