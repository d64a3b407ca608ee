"""Contenders that are made, such as by training, when they are first asked for, and what several of them need."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


class Prepared(Mapping[str, Callable[[Any], Any]]):
    """Contenders of an experiment by name, each made once, when it is first wanted.

    What is costly to make, such as a network that must be trained, then costs nothing to those who only look at a study, and
    no trained numbers need to be kept. A maker must depend on nothing but its own random key, unlike those of the runs, or
    the contender has seen the records it is judged on. Different contenders may be made by different threads at the same
    time; what two of them need is found `once`.

    Example:
        >>> made = Prepared({"double": lambda: lambda record: 2 * record})
        >>> list(made), made["double"](3)
        (['double'], 6)
    """

    def __init__(self, makers: Mapping[str, Callable[[], Callable[[Any], Any]]]) -> None:
        self._makers = dict(makers)
        self._make = once(lambda name: self._makers[name]())

    def __getitem__(self, name: str) -> Callable[[Any], Any]:
        return self._make(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)

    def __contains__(self, name: object) -> bool:
        return name in self._makers


def once(fn: Function) -> Function:
    """The function with its results kept; a thread that asks for what another is finding waits for it.

    What it finds may need other such results, but not, by way of them, its own.

    Example:
        >>> square = once(lambda x: x**2)
        >>> square(3), square(3)
        (9, 9)
    """
    found: dict[Any, Any] = {}
    locks: dict[Any, threading.Lock] = {}
    guard = threading.Lock()

    @functools.wraps(fn)
    def kept(*args: Any, **options: Any) -> Any:
        key = (args, tuple(sorted(options.items())))
        with guard:
            lock = locks.setdefault(key, threading.Lock())
        with lock:
            if key not in found:
                found[key] = fn(*args, **options)
            return found[key]

    return cast(Function, kept)
