"""An equation run by itself: what it makes of a signal from the start of a record, given all the others."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..models import runge_kutta_4
from .equations import Equation, Values, later
from .terms import Piece, Reference
from .windows import pointwise

_START = 5
"""Samples that tell where a differential equation of second order starts."""


@dataclasses.dataclass(frozen=True)
class FreeRun:
    """An equation solved for one signal; made by `free_run_of`.

    Attributes:
        equation: to solve.
        signal: that it is solved for.
        order: of the differential equation, or 0 for a recursion over rows.
    """

    equation: Equation
    signal: str
    order: int

    def __call__(self, theta: Float[Any, " n"], signals: Values, dt: float) -> Float[np.ndarray, "T"]:
        """The signal as the equation has it from the longest stretch of rows in which nothing is missing, else NaN.

        It starts from what was measured. Inputs between samples are interpolated, differential equations stepped by
        Runge-Kutta 4. A run that grows beyond all numbers ends in infinity.

        Args:
            theta: the parameters.
            signals: measured.
            dt: time between samples [s].
        """
        values = {name: np.asarray(each, float) for name, each in signals.items()}
        arrays = self._outside(values, dt)
        start, stop = longest_stretch(np.isfinite(np.stack([*arrays, values[self.signal]])).min(axis=0))
        out = np.full(len(values[self.signal]), np.nan)
        back = (max(self.equation.lag, 1), 1, _START)[self.order]
        if stop - start <= back:
            return out
        rows = np.stack(arrays, axis=1)[start:stop] if arrays else np.zeros((stop - start, 0))
        run = self._recursion if self.order == 0 else self._integral
        found = np.asarray(run(jnp.asarray(theta, float), rows, values[self.signal][start:stop], dt))
        out[start:stop] = np.where(np.isnan(found), np.inf, found)
        return out

    def _outside(self, signals: Values, dt: float) -> list[Float[np.ndarray, "T"]]:
        """Everything that does not depend on the signal, in the order in which `_inside` asks for it."""
        window = pointwise(dt)

        def read(reference: Reference) -> np.ndarray:
            return later(window.apply(signals[reference.signal], reference.order), reference.lag)

        def whole(piece: Piece) -> np.ndarray:
            value = np.asarray(piece.value(read, self.equation.functions), float)
            return window.apply(np.broadcast_to(value, len(signals[self.signal])), piece.order)

        return [*map(whole, self._given_pieces), *map(read, self._given_references)]

    @functools.cached_property
    def _all_pieces(self) -> list[tuple[int, Piece]]:
        """Pieces with the column that they belong to, the regressand last."""
        return [(j, piece) for j, term in enumerate(self.equation.columns) for piece in term.pieces]

    @functools.cached_property
    def _given_pieces(self) -> list[Piece]:
        return [piece for _, piece in self._all_pieces if not _asks(piece, self.signal)]

    @functools.cached_property
    def _given_references(self) -> list[Reference]:
        inside = (piece for _, piece in self._all_pieces if _asks(piece, self.signal))
        found = (each for piece in inside for each in piece.references if each.signal != self.signal)
        return list(dict.fromkeys(found))

    def _solved(self, theta: Array, row: Array, own: Callable[[Reference], Array]) -> Array:
        """The leading derivative, or the next value: that which makes the equation hold."""
        weights = jnp.append(-theta, 1.0)
        lead, rest = jnp.zeros(()), jnp.zeros(())
        given = iter(row[: len(self._given_pieces)])
        known = dict(zip(self._given_references, row[len(self._given_pieces) :], strict=True))

        def read(reference: Reference) -> Array:
            return own(reference) if reference.signal == self.signal else known[reference]

        for j, piece in self._all_pieces:
            factor = weights[j] * piece.factor
            if not _asks(piece, self.signal):
                rest = rest + factor * next(given)
            elif piece.bare == Reference(self.signal, 0, self.order):
                lead = lead + factor
            elif piece.order:
                rest = rest + factor * own(Reference(self.signal, 0, piece.order))
            else:
                rest = rest + factor * piece.value(read, self.equation.functions)
        return -rest / lead

    @functools.cached_property
    def _recursion(self) -> Callable[..., Array]:
        depth = max(self.equation.lag, 1)

        @jax.jit
        def run(theta: Array, rows: Array, measured: Array, dt: Array) -> Array:
            def step(past: Array, row: Array) -> tuple[Array, Array]:
                new = self._solved(theta, row, lambda reference: past[reference.lag - 1])
                return jnp.concatenate([new[None], past[:-1]]), new

            _, found = jax.lax.scan(step, measured[:depth][::-1], rows[depth:])
            return jnp.concatenate([measured[:depth], found])

        return run

    @functools.cached_property
    def _integral(self) -> Callable[..., Array]:
        @jax.jit
        def run(theta: Array, rows: Array, measured: Array, dt: Array) -> Array:
            def rates(before: Array, after: Array) -> Callable[[Array, Array], Array]:
                def at(state: Array, share: Array) -> Array:
                    row = before + share / dt * (after - before)
                    return jnp.append(state[1:], self._solved(theta, row, lambda reference: state[reference.order]))

                return at

            def step(state: Array, both: tuple[Array, Array]) -> tuple[Array, Array]:
                new = runge_kutta_4(rates(*both), state, jnp.zeros(()), dt)
                return new, new[0]

            # A parabola through the first samples: the difference of two would be mostly noise.
            start = jnp.polyfit(dt * jnp.arange(_START), measured[:_START], 2)
            first = measured[:1] if self.order == 1 else jnp.stack([start[2], start[1]])
            _, found = jax.lax.scan(step, first, (rows[:-1], rows[1:]))
            return jnp.concatenate([measured[:1], found])

        return run


def free_run_of(equation: Equation, signal: str | None = None) -> FreeRun | None:
    """The equation solved for a signal, if it can be: the one under its highest derivative, or for its next value.

    Args:
        equation: to solve.
        signal: to solve for; by default whichever it can be solved for.

    Example:
        >>> from .equations import parse_equation
        >>> run = free_run_of(parse_equation("y", {"a": "lag(y)", "b": "u"}, ["y", "u"]))
        >>> run.signal, run([0.5, 1.0], {"y": np.zeros(3), "u": np.ones(3)}, 1.0).tolist()
        ('y', [0.0, 1.0, 1.5])
    """
    for name in [signal] if signal is not None else equation.signals:
        found = _order_of(equation, name)
        if found is not None:
            return FreeRun(equation, name, found)
    return None


def _order_of(equation: Equation, signal: str) -> int | None:
    """The order of the equation in a signal, None if it cannot be solved for it."""
    pieces = [piece for term in equation.columns for piece in term.pieces if _asks(piece, signal)]
    own = [piece.bare or each for piece in pieces for each in piece.references if each.signal == signal]
    if not pieces:
        return None
    lags = max(each.lag for each in own)
    order = max(max(each.order for each in own), max(piece.order for piece in pieces))
    lead = Reference(signal, 0, order)
    solvable = any(piece.bare == lead for piece in pieces)
    # Elsewhere it must be known already: what comes before, or lower derivatives.
    known = all(each == lead or (each.order < order if order else each.lag > 0) for each in own)
    inside = all(piece.bare is not None or (piece.order == 0 and lead not in piece.references) for piece in pieces)
    mixed = bool(lags and order)
    return order if solvable and known and inside and not mixed and (order or lags) else None


def _asks(piece: Piece, signal: str) -> bool:
    return any(reference.signal == signal for reference in piece.references)


def longest_stretch(whole: Any) -> tuple[int, int]:
    """First and one past the last row of the longest stretch of rows that are whole."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
    if not len(edges):
        return 0, 0
    spans = edges.reshape(-1, 2)
    start, stop = spans[int((spans[:, 1] - spans[:, 0]).argmax())]
    return int(start), int(stop)
