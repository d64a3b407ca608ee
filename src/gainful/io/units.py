"""Units of columns."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ..errors import MissingExtraError, UnitError

_ALIASES = {"angle": "rad", "": "1"}


@functools.cache
def _registry() -> Any:
    try:
        import pint
    except ImportError as problem:
        raise MissingExtraError("units need pint: pip install 'gainful[io]'") from problem
    return pint.UnitRegistry()


def quantity(size: float, unit: str, signal: str = "") -> Any:
    """A number with its unit.

    Raises:
        UnitError: a unit that does not exist.
    """
    return size * _registry().Quantity(1.0, _parsed(_ALIASES.get(unit, unit), signal))


def base_unit(value: Any) -> str:
    """The unit of a quantity in SI base units, without radians.

    Example:
        >>> base_unit(quantity(1.0, "N*m") / quantity(1.0, "rad/s**2"))
        'kg*m^2'
    """
    powers = {str(name): power for name, power in value.to_base_units().unit_items() if name != "radian"}
    short = {name: f"{_registry().Unit(name):~}" for name in powers}

    def told(name: str, power: float) -> str:
        return short[name] if power == 1 else f"{short[name]}^{power:g}"

    above = "*".join(told(name, power) for name, power in powers.items() if power > 0)
    below = "/".join(told(name, -power) for name, power in powers.items() if power < 0)
    return (above or "1") + (f"/{below}" if below else "")


def _parsed(name: str, signal: str) -> Any:
    registry = _registry()
    try:
        return registry.Unit("dimensionless" if name == "1" else name)
    except Exception as problem:  # pint raises a different class for each way a unit can be wrong
        reason = f": {problem}" if str(problem) else ""
        raise UnitError(f"signal {signal!r}: {name!r} is not a unit{reason}") from problem


def convert(values: np.ndarray, unit: str, target: str, signal: str) -> np.ndarray:
    """Numbers in `unit` as numbers in `target`.

    Args:
        values: any shape.
        unit: as pint spells it: "deg", "km/h", "degC", "1".
        target: the model's unit of the signal.
        signal: its name, for messages.

    Raises:
        UnitError: a unit that does not exist, or two that do not convert.

    Example:
        >>> float(convert(np.array([36.0]), "km/h", "m/s", "speed")[0])
        10.0
    """
    unit, target = _ALIASES.get(unit, unit), _ALIASES.get(target, target)
    if unit == target:
        return values
    given, wanted = (_parsed(name, signal) for name in (unit, target))
    try:
        return np.asarray(_registry().Quantity(values, given).to(wanted).magnitude, dtype=float)
    except Exception as problem:
        raise UnitError(f"signal {signal!r}: expected a unit that converts to {target!r}, got {unit!r}") from problem
