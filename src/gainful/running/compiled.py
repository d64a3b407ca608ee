"""Compile once per problem shape, and know how long that took."""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax

from ..runtime import compiler_options


class Frozen:
    """The part of a tree that shapes the program (functions, sizes, names), hashed once."""

    __slots__ = ("_hash", "_key", "tree")

    def __init__(self, tree: Any) -> None:
        leaves, structure = jax.tree.flatten(tree)
        self.tree, self._key = tree, (tuple(leaves), structure)
        self._hash = hash(self._key)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frozen) and (self is other or self._key == other._key)


_executables: dict[Any, Any] = {}
_locks: dict[Any, threading.Lock] = {}
_guard = threading.Lock()


def compiled_call(fn: Callable[..., Any], fixed: Any, *moving: Any, quick: bool = False) -> tuple[Any, float]:
    """`fn(fixed, *moving)` through XLA, and the seconds spent compiling (0 when the program is known already).

    Threads may call it at the same time: different programs are compiled side by side, the same one once.

    Args:
        fn: a module-level function.
        fixed: a tree with arrays and non-arrays (estimator, model); programs are shared where the non-arrays are equal.
        moving: trees of arrays.
        quick: compiled three times sooner and run five times slower, for programs that are called a few times; the last
            digits differ.
    """
    arrays, frozen, kind = split((fixed, moving))
    key = (fn, kind, quick)
    with _guard:
        lock = _locks.setdefault(key, threading.Lock())
    with lock:
        seconds = 0.0
        if key not in _executables:
            begin = time.perf_counter()
            program = jax.jit(lambda parts: _apply(fn, parts, frozen), compiler_options=compiler_options(quick=quick))
            _executables[key] = program.lower(arrays).compile()
            seconds = time.perf_counter() - begin
    return _executables[key](arrays), seconds


def forget_programs() -> None:
    """Let go of every compiled program, as after a long job.

    Each maps pieces of memory, and the compiler does not survive the limit that a system sets on their number.
    """
    with _guard:
        _executables.clear()
        _locks.clear()
    jax.clear_caches()
    gc.collect()


def split(tree: Any) -> tuple[Any, Frozen, Any]:
    """A tree's arrays, the rest of it, and what two trees have in common that share a program."""
    arrays, rest = eqx.partition(tree, eqx.is_array)
    frozen = Frozen(rest)
    leaves, structure = jax.tree.flatten(arrays)
    return arrays, frozen, (frozen, structure, tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves))


def _apply(fn: Callable[..., Any], arrays: Any, frozen: Frozen) -> Any:
    fixed, moving = eqx.combine(arrays, frozen.tree)
    return fn(fixed, *moving)
