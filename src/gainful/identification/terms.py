"""Terms of an equation written as text, such as `r*abs(r)`, `d(v)` or `lag(y, 2)`."""

from __future__ import annotations

import ast
import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import jax.numpy as jnp

from ..errors import ConfigError, did_you_mean

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": jnp.abs,
    "acos": jnp.arccos,
    "asin": jnp.arcsin,
    "atan": jnp.arctan,
    "atan2": jnp.arctan2,
    "cos": jnp.cos,
    "exp": jnp.exp,
    "log": jnp.log,
    "max": jnp.maximum,
    "min": jnp.minimum,
    "sign": jnp.sign,
    "sin": jnp.sin,
    "sqrt": jnp.sqrt,
    "tan": jnp.tan,
    "tanh": jnp.tanh,
}
"""Functions of numbers that a term may call."""

OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
CONSTANTS = {"pi": math.pi}
MOST_DERIVATIVES = 2
"""Order up to which signals are differentiated."""


@dataclasses.dataclass(frozen=True)
class Reference:
    """A signal as a term asks for it.

    Attributes:
        signal: its name.
        lag: rows back.
        order: of the derivative.
    """

    signal: str
    lag: int = 0
    order: int = 0


@dataclasses.dataclass(frozen=True)
class Piece:
    """`factor * D^order f(references)`: of such a term is the sum.

    Attributes:
        factor: number in front.
        order: of the derivative in front.
        lag: rows back, of all that `tree` refers to.
        tree: `f`, a function of the references at one moment.
        references: of `f`.
    """

    factor: float
    order: int
    lag: int
    tree: ast.expr
    references: tuple[Reference, ...]

    @property
    def bare(self) -> Reference | None:
        """The signal that the piece is a multiple of, if it is nothing else."""
        if isinstance(self.tree, ast.Name) and self.references:
            return dataclasses.replace(self.references[0], order=self.order)
        return None

    def value(self, resolve: Callable[[Reference], Any], functions: Mapping[str, Callable[..., Any]]) -> Any:
        """`f`, without factor and derivative."""
        return evaluate(self.tree, resolve, functions, self.lag)


@dataclasses.dataclass(frozen=True)
class Term:
    """A term of an equation; made by `parse_term`.

    Attributes:
        text: as it was written.
        pieces: whose sum it is.
    """

    text: str
    pieces: tuple[Piece, ...]

    @property
    def references(self) -> tuple[Reference, ...]:
        """All of its pieces, each once; with the derivative in front of the piece where that is all there is to it."""
        found = [piece.bare or each for piece in self.pieces for each in piece.references]
        return tuple(dict.fromkeys(found))

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals it needs."""
        return tuple(dict.fromkeys(each.signal for each in self.references))

    @property
    def lag(self) -> int:
        """Rows it looks back."""
        return max((each.lag for piece in self.pieces for each in piece.references), default=0)

    @property
    def order(self) -> int:
        """Of its highest derivative."""
        inner = (each.order for piece in self.pieces for each in piece.references)
        return max((*inner, *(piece.order for piece in self.pieces)), default=0)

    @property
    def weak(self) -> bool:
        """Whether all of its derivatives can be handed to a test function: they stand in front, not inside."""
        return all(each.order == 0 for piece in self.pieces for each in piece.references)


def parse_term(
    text: str, signals: Iterable[str], functions: Mapping[str, Callable[..., Any]] = FUNCTIONS, name: str = "term"
) -> Term:
    """A term from its text.

    It may hold numbers, `pi`, signals, `+ - * / **`, brackets, functions, `d(x)` or `d(x, 2)` for derivatives in time, and
    `lag(x, n)` for what was n rows before.

    Args:
        text: of the term.
        signals: that there are.
        functions: of numbers that it may call.
        name: of the term, for messages.

    Raises:
        ConfigError: not such an expression, or an unknown name.

    Example:
        >>> parse_term("d(r) + 2*r*abs(r)", ["r"]).references
        (Reference(signal='r', lag=0, order=1), Reference(signal='r', lag=0, order=0))
    """
    tree = _tree(text, name)
    grammar = _Grammar(frozenset(signals), functions, f"{name}: {text!r}")
    pieces = tuple(grammar.pieces(tree))
    for piece in pieces:
        if piece.order and not piece.references:
            raise ConfigError(f"{grammar.where}: expected d(...) of something with a signal in it")
        if max((piece.order, *(each.order for each in piece.references))) > MOST_DERIVATIVES:
            raise ConfigError(f"{grammar.where}: expected derivatives up to the second, got a higher one")
    return Term(str(text).strip(), pieces)


def _tree(text: str, name: str) -> ast.expr:
    try:
        return ast.parse(str(text).strip(), mode="eval").body
    except (SyntaxError, ValueError) as problem:
        raise ConfigError(f"{name}: {text!r} is not an expression") from problem


def parse_condition(
    text: str, signals: Iterable[str], functions: Mapping[str, Callable[..., Any]] = FUNCTIONS, name: str = "where"
) -> Term:
    """A term that is above 0 where a condition holds, such as `abs(pitch) > 0.2`.

    Args:
        text: of the condition.
        signals: that there are.
        functions: of numbers that it may call.
        name: of the condition, for messages.

    Raises:
        ConfigError: not one comparison by < or >, or no terms on its sides.

    Example:
        >>> parse_condition("v < 2", ["v"]).text
        '2 - v'
    """
    tree = _tree(text, name)
    if not isinstance(tree, ast.Compare) or len(tree.ops) != 1 or not isinstance(tree.ops[0], (ast.Lt, ast.Gt)):
        raise ConfigError(f"{name}: expected one comparison by < or >, such as 'abs(pitch) > 0.2', got {text!r}")
    sides = (tree.left, tree.comparators[0])
    more, less = sides if isinstance(tree.ops[0], ast.Gt) else sides[::-1]
    return parse_term(ast.unparse(ast.BinOp(more, ast.Sub(), less)), signals, functions, name)


def evaluate(
    tree: ast.expr,
    resolve: Callable[[Reference], Any],
    functions: Mapping[str, Callable[..., Any]],
    lag: int = 0,
    order: int = 0,
) -> Any:
    """The value of an expression for whatever its signals are: numbers, arrays, quantities with units.

    Args:
        tree: of a parsed term.
        resolve: from a reference to its value.
        functions: by name.
        lag: rows back of all that is referred to.
        order: derivative of all that is referred to.
    """

    def value(part: ast.expr) -> Any:
        return evaluate(part, resolve, functions, lag, order)

    match tree:
        case ast.Constant(value=number):
            return number
        case ast.Name(id=name):
            return CONSTANTS[name] if name in CONSTANTS else resolve(Reference(name, lag, order))
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -value(inner)
        case ast.UnaryOp(operand=inner):
            return value(inner)
        case ast.BinOp(left=left, op=operator, right=right):
            return OPERATORS[type(operator)](value(left), value(right))
        case ast.Call(func=ast.Name(id="lag"), args=[inner, *_]):
            return evaluate(inner, resolve, functions, lag + _whole(tree), order)
        case ast.Call(func=ast.Name(id="d"), args=[inner, *_]):
            return evaluate(inner, resolve, functions, lag, order + _whole(tree))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return functions[name](*map(value, arguments))
    raise AssertionError(f"not a parsed term: {ast.dump(tree)}")


def _whole(call: ast.Call) -> int:
    """The second argument of `d` or `lag`, 1 if there is none."""
    if len(call.args) == 1:
        return 1
    last = call.args[1]
    return last.value if isinstance(last, ast.Constant) and isinstance(last.value, int) else 0


@dataclasses.dataclass(frozen=True)
class _Grammar:
    """What may stand in a term, and how it falls into pieces."""

    signals: frozenset[str]
    functions: Mapping[str, Callable[..., Any]]
    where: str

    def pieces(self, tree: ast.expr, factor: float = 1.0, order: int = 0, lag: int = 0) -> Iterator[Piece]:
        """Sums, multiples, derivatives and lags taken apart; what is left is a function of one moment."""
        match tree:
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as operator, right=right):
                yield from self.pieces(left, factor, order, lag)
                yield from self.pieces(right, -factor if isinstance(operator, ast.Sub) else factor, order, lag)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                yield from self.pieces(inner, -factor, order, lag)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                yield from self.pieces(inner, factor, order, lag)
            case ast.BinOp(left=left, op=ast.Mult(), right=right) if self.number(left) is not None:
                yield from self.pieces(right, factor * (self.number(left) or 0.0), order, lag)
            case ast.BinOp(left=left, op=ast.Mult(), right=right) if self.number(right) is not None:
                yield from self.pieces(left, factor * (self.number(right) or 0.0), order, lag)
            case ast.BinOp(left=left, op=ast.Div(), right=right) if self.number(right):
                yield from self.pieces(left, factor / (self.number(right) or 1.0), order, lag)
            case ast.Call(func=ast.Name(id="d")):
                yield from self.pieces(self.inner(tree), factor, order + _whole(tree), lag)
            case ast.Call(func=ast.Name(id="lag")):
                yield from self.pieces(self.inner(tree), factor, order, lag + _whole(tree))
            case _:
                found = tuple(dict.fromkeys(self.references(tree, lag, 0)))
                yield Piece(factor, order, lag, tree, found)

    def number(self, tree: ast.expr) -> float | None:
        """The value of an expression without a signal in it."""
        if any(isinstance(node, (ast.Name, ast.Call)) and getattr(node, "id", "") != "pi" for node in ast.walk(tree)):
            return None
        list(self.references(tree, 0, 0))
        try:
            return float(evaluate(tree, _no_signal, {}))
        except (ArithmeticError, TypeError, ValueError) as problem:
            raise ConfigError(f"{self.where}: {ast.unparse(tree)!r} is not a number: {problem}") from problem

    def references(self, tree: ast.expr, lag: int, order: int) -> Iterator[Reference]:
        """All that a function of one moment refers to; raises at what no term may hold."""
        match tree:
            case ast.Constant(value=value) if isinstance(value, (int, float)) and not isinstance(value, bool):
                return
            case ast.Name(id=name):
                if name in self.signals:
                    yield Reference(name, lag, order)
                elif name not in CONSTANTS:
                    raise ConfigError(f"{self.where}: {name!r} is not a signal; {did_you_mean(name, self.signals)}")
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=inner):
                yield from self.references(inner, lag, order)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
                if order and not isinstance(operator, (ast.Add, ast.Sub)):
                    raise self.refused(tree, "expected d(...) of a product to stand alone or multiplied by a number")
                yield from self.references(left, lag, order)
                yield from self.references(right, lag, order)
            case ast.Call(func=ast.Name(id="lag")):
                yield from self.references(self.inner(tree), lag + _whole(tree), order)
            case ast.Call(func=ast.Name(id="d")):
                yield from self.references(self.inner(tree), lag, order + _whole(tree))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                if name not in self.functions:
                    known = [*self.functions, "d", "lag"]
                    raise ConfigError(f"{self.where}: {name!r} is not a function; {did_you_mean(name, known)}")
                if order:
                    raise self.refused(tree, "expected d(...) of a function to stand alone or multiplied by a number")
                for each in arguments:
                    yield from self.references(each, lag, order)
            case _:
                raise self.refused(tree, "expected numbers, signals, + - * / **, brackets and functions")

    def inner(self, call: ast.Call) -> ast.expr:
        """What `d` or `lag` is applied to."""
        name = call.func.id  # type: ignore[attr-defined]  # of a call by name
        if call.keywords or len(call.args) not in (1, 2) or _whole(call) < 1:
            raise self.refused(call, f"expected {name}(x) or {name}(x, n) with a whole number n of at least 1")
        return call.args[0]

    def refused(self, tree: ast.expr, expected: str) -> ConfigError:
        return ConfigError(f"{self.where}: {expected}, got {ast.unparse(tree)!r}")


def _no_signal(reference: Reference) -> Any:
    raise ValueError(f"{reference.signal} is no number")
