"""Equations that are linear in their parameters, and their rows and noise in a record."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from .terms import FUNCTIONS, Piece, Reference, Term, parse_condition, parse_term
from .windows import Window, pointwise

Values = Mapping[str, Float[np.ndarray, "T"]]
"""Signals at equally spaced times, by name."""

Functions = Mapping[str, Callable[..., Any]]
"""What terms may call, by name."""


@dataclasses.dataclass(frozen=True)
class Equation:
    """`z = theta_1 h_1 + ... + theta_n h_n`, with terms of signals on both sides; made by `parse_equation`.

    Attributes:
        regressand: `z`.
        terms: `h`, by the name of the parameter that multiplies it.
        functions: that the terms call.
        where: rows count only where this term is above 0, if there is one.
    """

    regressand: Term
    terms: Mapping[str, Term]
    functions: Functions = dataclasses.field(default_factory=lambda: FUNCTIONS)
    where: Term | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of what is unknown."""
        return tuple(self.terms)

    @property
    def columns(self) -> tuple[Term, ...]:
        """The terms of a row `[h, z]`."""
        return (*self.terms.values(), self.regressand)

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that it needs."""
        every = self.columns if self.where is None else (*self.columns, self.where)
        return tuple(dict.fromkeys(name for term in every for name in term.signals))

    @property
    def order(self) -> int:
        """Of the highest derivative."""
        return max(column.order for column in self.columns)

    @property
    def lag(self) -> int:
        """Rows that it looks back."""
        return max(column.lag for column in self.columns)

    def rows(
        self, signals: Values, dt: float, window: Window, std: Mapping[str, float] | None = None
    ) -> Float[np.ndarray, "T p"]:
        """Rows `[h, z]` at all samples, NaN where anything that they need is missing.

        Args:
            signals: measured.
            dt: time between samples [s].
            window: how values and derivatives are taken.
            std: standard deviations of the signals' noise; what it adds to nonlinear terms on average is taken out, to
                second order.

        Raises:
            ConfigError: a derivative inside a term, where the window wants it in front.
        """
        self.check(window)
        read = _Reader(signals, dt)
        columns = []
        for term in self.columns:
            total = np.zeros(read.length)
            for piece in term.pieces:
                value = read.value(piece, self.functions)
                if std:
                    value = value - _excess(piece, read, std, self.functions)
                total = total + piece.factor * window.apply(value, piece.order)
            columns.append(total)
        if self.where is not None:
            inside = sum((piece.factor * read.value(piece, self.functions) for piece in self.where.pieces), 0.0)
            columns[-1] = np.where(inside > 0, columns[-1], np.nan)
        return np.stack(columns, axis=1)

    def noise(self, signals: Values, dt: float, window: Window, std: Mapping[str, float]) -> Float[np.ndarray, "T p p"]:
        """Covariance of the noise of each row, for independent white noise of the signals, to first order.

        Args:
            signals: measured.
            dt: time between samples [s].
            window: how values and derivatives are taken.
            std: standard deviations of the signals' noise, in their units; of those not named 0.
        """
        self.check(window)
        read = _Reader(signals, dt)
        slopes = [_slopes(term, read, window, self.functions) for term in self.columns]
        p = len(slopes)
        total = np.zeros((read.length, p, p))
        for a, b in itertools.product(range(p), repeat=2):
            for (name, offset), slope in slopes[a].items():
                if (name, offset) in slopes[b] and std.get(name):
                    total[:, a, b] += std[name] ** 2 * slope * slopes[b][name, offset]
        return total

    def check(self, window: Window) -> None:
        """Raise unless the window can take all terms."""
        if not window.weak:
            return
        for name, term in (*self.terms.items(), ("the regressand", self.regressand)):
            if not term.weak:
                raise ConfigError(
                    f"{name}: {term.text!r}: a weak method needs derivatives in front, d(...), not inside a term; "
                    'choose another method, such as "iv" or "ls"'
                )


def parse_equation(
    of: str,
    terms: Mapping[str, str],
    signals: Iterable[str],
    functions: Functions | None = None,
    where: str | None = None,
) -> Equation:
    """An equation from the text of its terms, see `parse_term`.

    Args:
        of: the regressand.
        terms: by the name of the parameter that multiplies it.
        signals: that there are.
        functions: of numbers that terms may call besides those that are known.
        where: a condition such as "abs(pitch) > 0.2"; rows count only where it holds.

    Raises:
        ConfigError: no terms, a name that is none, or a term that is not one.

    Example:
        >>> equation = parse_equation("tau", {"inertia": "d(r)", "drag": "r*abs(r)"}, ["r", "tau"])
        >>> equation.parameters, equation.signals
        (('inertia', 'drag'), ('r', 'tau'))
    """
    known = list(signals)
    if not terms:
        raise ConfigError("terms: expected at least one, got none")
    for name in terms:
        if not str(name).isidentifier():
            raise ConfigError(f"terms: expected names of parameters such as 'drag_2', got {name!r}")
    every = FUNCTIONS | dict(functions or {})
    parsed = {name: parse_term(text, known, every, name) for name, text in terms.items()}
    condition = None if where is None else parse_condition(where, known, every)
    if condition is not None and any(piece.order for piece in condition.pieces):
        raise ConfigError(f"where: {where!r}: expected no derivatives, d(...), in a condition")
    return Equation(parse_term(of, known, every, "of"), parsed, every, condition)


class _Reader:
    """Values of references in a record, each found once."""

    def __init__(self, signals: Values, dt: float) -> None:
        self._signals = {name: np.asarray(values, float) for name, values in signals.items()}
        self._inner = pointwise(dt)
        self._found: dict[Reference, np.ndarray] = {}
        self.length = len(next(iter(self._signals.values())))

    def __call__(self, reference: Reference) -> Float[np.ndarray, "T"]:
        if reference not in self._found:
            values = self._inner.apply(self._signals[reference.signal], reference.order)
            self._found[reference] = later(values, reference.lag)
        return self._found[reference]

    def value(self, piece: Piece, functions: Functions) -> Float[np.ndarray, "T"]:
        return np.broadcast_to(np.asarray(piece.value(self, functions), float), (self.length,))

    def taps(self, reference: Reference) -> dict[int, float]:
        """Weights of the samples that a reference is made of, by their distance in rows."""
        if not reference.order:
            return {-reference.lag: 1.0}
        weights = self._inner.taps[reference.order]
        half = len(weights) // 2
        return {j - half - reference.lag: float(weight) for j, weight in enumerate(weights) if weight}


def later(values: Float[np.ndarray, "T"], rows: int) -> Float[np.ndarray, "T"]:
    """Each sample by so many rows later, earlier if below 0; NaN where there is none."""
    if not rows:
        return values
    gap = np.full(min(abs(rows), len(values)), np.nan)
    return np.concatenate([gap, values[:-rows]]) if rows > 0 else np.concatenate([values[-rows:], gap])


def _partial(piece: Piece, read: _Reader, functions: Functions, *along: Reference) -> Float[np.ndarray, "T"]:
    """The derivative of `f` along references, one after the other, at every sample."""
    if piece.bare is not None and len(along) == 1:
        return np.ones(read.length)
    values = {reference: jnp.asarray(read(reference)) for reference in piece.references}

    def value(point: dict[Reference, Array]) -> Array:
        return jnp.broadcast_to(jnp.asarray(piece.value(point.__getitem__, functions), float), (read.length,))

    found: Callable[[dict[Reference, Array]], Array] = value
    for reference in along:
        found = _derivative(found, reference)
    return np.asarray(found(values))


def _derivative(of: Callable[[dict[Reference, Array]], Array], along: Reference) -> Callable[..., Array]:
    def one(point: dict[Reference, Array]) -> Array:
        def only(x: Array) -> Array:
            return of(point | {along: x})

        return jax.jvp(only, (point[along],), (jnp.ones_like(point[along]),))[1]

    return one


def _excess(piece: Piece, read: _Reader, std: Mapping[str, float], functions: Functions) -> Float[np.ndarray, "T"]:
    """What noise adds to `f` on average: half its second derivatives times the covariances of the references."""
    total = np.zeros(read.length)
    if piece.bare is not None:
        return total
    for a, b in itertools.product(piece.references, repeat=2):
        if a.signal != b.signal or not std.get(a.signal):
            continue
        first, second = read.taps(a), read.taps(b)
        covariance = std[a.signal] ** 2 * sum(weight * second.get(offset, 0.0) for offset, weight in first.items())
        if covariance:
            total = total + 0.5 * covariance * _partial(piece, read, functions, a, b)
    return total


def _slopes(
    term: Term, read: _Reader, window: Window, functions: Functions
) -> dict[tuple[str, int], Float[np.ndarray, "T"]]:
    """The derivative of a column along every sample that it is made of, by signal and distance in rows."""
    found: dict[tuple[str, int], np.ndarray] = {}
    for piece in term.pieces:
        whole = window.weak or piece.order
        taps, half = (window.taps[piece.order], window.width // 2) if whole else ([1.0], 0)
        for reference in piece.references:
            slope = _partial(piece, read, functions, reference)
            inner = read.taps(reference)
            for j, weight in enumerate(taps):
                here = piece.factor * weight * later(slope, half - j)
                for offset, share in inner.items() if weight else ():
                    key = (reference.signal, j - half + offset)
                    found[key] = found.get(key, 0.0) + share * here
    return found
