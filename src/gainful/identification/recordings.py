"""Signals of one motion, each measured by one sensor or several."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from ..errors import ConfigError, DataError, ShapeError, did_you_mean
from ..regression import sensor_lag

_UNEVEN = 1e-3
"""Share of a step by which a time may be off."""
_REACH = 5
"""Samples of lag between sensors that are looked for, either way."""


@dataclasses.dataclass(frozen=True)
class Recording:
    """Signals at equally spaced times; missing values are NaN.

    Attributes:
        t: times [s] (T,).
        values: by signal, one column per sensor (T, s) or (T,). Signals have one sensor, which all others share, or as many
            as each other.
        std: standard deviation of a sensor's noise by signal, where it is known, in the signal's unit.

    Raises:
        ShapeError: times and values that do not fit each other.
        DataError: times that are not equally spaced, or one sensor that is there twice.
        ConfigError: noise of a signal that is not there or is no size.

    Example:
        >>> both = Recording(np.arange(3.0), {"r": np.ones((3, 2)) + np.eye(3, 2), "tau": np.arange(3.0)})
        >>> both.sensors, both.mean()["r"].tolist()
        (2, [1.5, 1.5, 1.0])
    """

    t: Float[np.ndarray, "T"]
    values: Mapping[str, Float[np.ndarray, "T s"]]
    std: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        t = np.asarray(self.t, float)
        if t.ndim != 1 or len(t) < 3:
            raise ShapeError(f"t: expected at least 3 times, got shape {t.shape}")
        steps = np.diff(t)
        off = np.abs(steps - steps.mean()) > _UNEVEN * abs(steps.mean())
        if off.any() or steps.mean() <= 0:
            k = int(off.argmax())
            raise DataError(
                f"t: expected equal steps, got {steps[k]:.6g} s after t = {t[k]:.9g} s where the mean is {steps.mean():.6g} s"
            )
        columns = {name: _columns(name, each, len(t)) for name, each in self.values.items()}
        counts = {name: each.shape[1] for name, each in columns.items() if each.shape[1] > 1}
        if len(set(counts.values())) > 1:
            told = ", ".join(f"{name} {count}" for name, count in counts.items())
            raise ShapeError(f"values: expected one sensor of a signal or as many as of the others, got {told}")
        for name, std in self.std.items():
            if name not in columns:
                raise ConfigError(f"std: {name!r} is not a signal; {did_you_mean(name, columns)}")
            if not (std >= 0 and math.isfinite(std)):
                raise ConfigError(f"std: expected a number of at least 0 for {name!r}, got {std!r}")
        for name in counts:
            _own_sensors(name, columns[name])
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "values", columns)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    @property
    def sensors(self) -> int:
        """How many there are of the signals that have several."""
        return max(each.shape[1] for each in self.values.values())

    def mean(self, half: int | None = None) -> dict[str, Float[np.ndarray, "T"]]:
        """The mean of all sensors; of those that measured, where some did not.

        Args:
            half: 0 or 1 for every other sensor only, beginning with the first or the second.
        """
        out = {}
        for name, table in self.values.items():
            each = table if half is None or table.shape[1] == 1 else table[:, half::2]
            seen = np.isfinite(each)
            total = np.where(seen, each, 0.0).sum(axis=1)
            out[name] = np.where(seen.any(axis=1), total / np.maximum(seen.sum(axis=1), 1), np.nan)
        return out

    @property
    def noise(self) -> dict[str, float]:
        """Standard deviation of one sensor's noise by signal: as given, else from the differences of sensors.

        Signals of which neither is known are left out.
        """
        out = {name: float(std) for name, std in self.std.items()}
        for name, each in self.values.items():
            if name not in out and each.shape[1] > 1:
                out[name] = float(np.sqrt(np.nanmean(np.nanvar(each, axis=1, ddof=1))))
        return out

    def mean_noise(self, half: int | None = None) -> dict[str, float]:
        """The same of the mean of all sensors, or of every other."""
        counts = {name: each.shape[1] for name, each in self.values.items()}
        if half is not None:
            counts = {name: len(range(count)[half::2]) if count > 1 else 1 for name, count in counts.items()}
        return {name: std / math.sqrt(counts[name]) for name, std in self.noise.items()}

    @property
    def lags(self) -> dict[str, float]:
        """By how many samples the second sensor of a signal is late, where there is one and the record is long enough."""
        out = {}
        for name, each in self.values.items():
            whole = np.isfinite(each[:, :2]).all(axis=1) if each.shape[1] > 1 else np.zeros(0, bool)
            if whole.sum() > 4 * _REACH:
                first, second = each[:, 0], each[:, 1]
                out[name] = sensor_lag(first, second, self.dt, _REACH * self.dt) / self.dt
        return out

    def part(self, start: int, stop: int) -> Recording:
        """Samples from one to before another."""
        return Recording(self.t[start:stop], {name: each[start:stop] for name, each in self.values.items()}, self.std)


def _columns(name: str, values: Float[np.ndarray, "T *s"], length: int) -> Float[np.ndarray, "T s"]:
    table = np.asarray(values, float)
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2 or len(table) != length or not table.shape[1]:
        raise ShapeError(f"values: expected shape ({length},) or ({length}, sensors) for {name!r}, got {table.shape}")
    if not np.isfinite(table).any():
        raise DataError(f"values: expected numbers for {name!r}, got none")
    return table


def _own_sensors(name: str, values: Float[np.ndarray, "T s"]) -> None:
    """Raise if two sensors say the same all the time."""
    for j in range(values.shape[1]):
        for i in range(j):
            both = np.isfinite(values[:, i]) & np.isfinite(values[:, j])
            if both.any() and np.array_equal(values[both, i], values[both, j]):
                raise DataError(
                    f"values: sensors {i + 1} and {j + 1} of {name!r} are one and the same: expected sensors with noise of "
                    "their own"
                )
