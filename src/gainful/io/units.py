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
    registry = _registry()
    parsed = []
    for name in (unit, target):
        try:
            parsed.append(registry.Unit("dimensionless" if name == "1" else name))
        except Exception as problem:  # pint raises a different class for each way a unit can be wrong
            reason = f": {problem}" if str(problem) else ""
            raise UnitError(f"signal {signal!r}: {name!r} is not a unit{reason}") from problem
    try:
        return np.asarray(registry.Quantity(values, parsed[0]).to(parsed[1]).magnitude, dtype=float)
    except Exception as problem:
        raise UnitError(f"signal {signal!r}: expected a unit that converts to {target!r}, got {unit!r}") from problem
