"""Contenders that are made, such as by training, when they are first asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any


class Prepared(Mapping[str, Callable[[Any], Any]]):
    """Contenders of an experiment by name, each made once, when it is first wanted.

    What is costly to make, such as a network that must be trained, then costs nothing to those who only look at a study, and
    no trained numbers need to be kept. A maker must depend on nothing but its own random key, unlike those of the runs, or
    the contender has seen the records it is judged on.

    Example:
        >>> made = Prepared({"double": lambda: lambda record: 2 * record})
        >>> list(made), made["double"](3)
        (['double'], 6)
    """

    def __init__(self, makers: Mapping[str, Callable[[], Callable[[Any], Any]]]) -> None:
        self._makers = dict(makers)
        self._made: dict[str, Callable[[Any], Any]] = {}
        self._lock = threading.RLock()

    def __getitem__(self, name: str) -> Callable[[Any], Any]:
        with self._lock:
            if name not in self._made:
                self._made[name] = self._makers[name]()
            return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)

    def __contains__(self, name: object) -> bool:
        return name in self._makers
