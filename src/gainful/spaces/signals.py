"""Spaces from a list of named signals, as a user writes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import ModelError
from .base import AbstractSpace
from .bounded import Interval, Positive
from .circle import Circle
from .euclidean import Euclidean
from .product import Product
from .quaternion import Quaternion

SpaceLike = AbstractSpace | int | Sequence[str] | Mapping[str, str | tuple[float | None, float | None]]
"""A space, a count, a list of names, or a mapping from name to unit, "angle", "quaternion" or a pair of bounds."""


def make_space(signals: SpaceLike, *, prefix: str = "x") -> AbstractSpace:
    """The space of some named signals.

    Args:
        signals: a space as it is; a count (`3`: names are made up); names (`["x", "y"]`: pure numbers); or a mapping from
            name to unit (`"m/s"`), to `"angle"` (rad, wraps), to `"quaternion"` (four numbers, scalar last), or to a
            pair of bounds (`(0, None)` stays positive, `(0, 1)` stays between).
        prefix: of made-up names.

    Raises:
        ModelError: no signal, a name given twice, or bounds that are not supported.

    Example:
        >>> make_space({"x": "m", "heading": "angle"}).units
        ('m', 'rad')
    """
    if isinstance(signals, AbstractSpace):
        return signals
    if isinstance(signals, int):
        signals = [f"{prefix}{i}" for i in range(signals)]
    if isinstance(signals, str):
        raise ModelError(f"signals: expected a list of names or a mapping from name to unit, got the text {signals!r}")
    kinds = dict(signals) if isinstance(signals, Mapping) else dict.fromkeys(signals, "1")
    if not kinds or (not isinstance(signals, Mapping) and len(kinds) != len(signals)):
        raise ModelError(f"signals: expected at least one name, each once, got {signals!r}")
    product = Product([_single(name, kind) for name, kind in kinds.items()])
    return product.members[0] if len(product.members) == 1 else product


def _single(name: str, kind: str | tuple[float | None, float | None]) -> AbstractSpace:
    if kind == "angle":
        return Circle(name)
    if kind == "quaternion":
        return Quaternion(name)
    if isinstance(kind, str):
        return Euclidean((name,), (kind,))
    lower, upper = kind
    if lower is None and upper is None:
        return Euclidean((name,))
    if lower is not None and upper is not None:
        return Interval(name, lower, upper)
    if lower == 0:
        return Positive(name)
    raise ModelError(f"bounds of {name!r}: expected (0, None), (None, None) or two finite numbers, got {kind!r}")
