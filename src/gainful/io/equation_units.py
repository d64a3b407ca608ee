"""Units of the parameters of an equation."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Any

from ..errors import ConfigError
from ..identification import Equation, Reference, Term
from ..identification.terms import FUNCTIONS, evaluate
from .units import base_unit, quantity


def parameter_units(equation: Equation, units: Mapping[str, str]) -> dict[str, str]:
    """The unit of each parameter: the regressand's over its term's.

    Empty where a term calls a function of the user's, or adds a number that has a unit in its author's mind only.

    Args:
        equation: with the terms.
        units: of the signals, by name.

    Raises:
        ConfigError: a term that adds what cannot be added, or takes the sine of what is no angle.
        UnitError: a unit that does not exist.

    Example:
        >>> from gainful.identification import parse_equation
        >>> parameter_units(parse_equation("F", {"mass": "d(v)", "drag": "v"}, ["F", "v"]), {"F": "N", "v": "m/s"})
        {'mass': 'kg', 'drag': 'kg/s'}
    """
    whole = _unit_of(equation.regressand, "of", units)
    out = {}
    for name, term in equation.terms.items():
        own = _unit_of(term, name, units)
        out[name] = "" if whole is None or own is None else base_unit(whole / own)
    return out


def _unit_of(term: Term, name: str, units: Mapping[str, str]) -> Any:
    """The unit of a term as a quantity of size 1, None if a user's function hides it."""
    total: Any = None
    seconds = quantity(1.0, "s")
    values = {reference: k for k, reference in enumerate(term.references)}

    def read(reference: Reference) -> Any:
        # Values of no special size: a difference of two signals is not to vanish.
        size = 1.0 + 0.17 * (1 + values.get(reference, len(values)))
        return quantity(size, units[reference.signal], reference.signal) / seconds**reference.order

    for piece in term.pieces:
        try:
            value = evaluate(piece.tree, read, _OF_UNITS, piece.lag) / seconds**piece.order
            value = quantity(1.0, "1") * value
            # Adding refuses what does not convert.
            total = value if total is None else total + value
        except _Hidden:
            return None
        except Exception as problem:  # pint raises a different class for each way units do not fit
            if _adds_number(piece.tree):
                return None
            raise ConfigError(f"{name}: {term.text!r}: units do not fit: {problem}") from problem
    return None if total is None else total / total.magnitude


def _adds_number(tree: ast.expr) -> bool:
    """Whether a bare number is added, whose unit its author knows."""
    sums = (node for node in ast.walk(tree) if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)))
    return any(isinstance(side, ast.Constant) for node in sums for side in (node.left, node.right))


class _Hidden(Exception):
    """A function whose unit nobody knows."""


class _Functions(dict[str, Any]):
    def __missing__(self, name: str) -> Any:
        def hidden(*_: Any) -> Any:
            raise _Hidden

        return hidden


def _of_angle(*arguments: Any) -> Any:
    for each in arguments:
        (quantity(1.0, "1") * each).to("rad")
    return quantity(0.7, "1")


def _same(first: Any, second: Any) -> Any:
    return first + 0.0 * second


_OF_UNITS = _Functions(
    dict.fromkeys(FUNCTIONS, _of_angle)
    | {
        "abs": abs,
        "atan2": lambda a, b: _of_angle(_same(a, b) / b),
        "max": _same,
        "min": _same,
        "sign": lambda x: quantity(0.7, "1"),
        "sqrt": lambda x: x**0.5,
    }
)
