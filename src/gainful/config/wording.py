"""What a configuration expected and what it got, in a user's words."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import did_you_mean
from ..io import Column

_WORDS = {float: "a number", int: "a whole number", str: "text", bool: "true or false", dict: "a table"}


def sentences(errors: Iterable[Any], table: dict[str, Any], root: type) -> list[str]:
    """One sentence per key that pydantic finds fault with.

    Args:
        errors: as pydantic lists them: one per member of a union, with the members' names among the keys.
        table: what was validated.
        root: the dataclass it should have been.
    """
    found: dict[tuple[str | int, ...], str] = {}
    for error in errors:
        keys = _own_keys(error, table)
        name = ".".join(map(str, keys))
        if error["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
            found[keys] = f"{name}: unknown key; {did_you_mean(str(keys[-1]), _fields(_at(root, keys[:-1])))}"
        elif error["type"] in ("missing", "missing_argument"):
            found[keys] = f"{name}: missing"
        else:
            found.setdefault(keys, f"{name}: {mismatch(_at(root, keys), _given(table, keys))}")
    # Of a union, the member that got furthest says most.
    return [text for keys, text in found.items() if not any(k != keys and k[: len(keys)] == keys for k in found)]


def misplaced_booleans(table: Any, root: Any, keys: tuple[str | int, ...] = ()) -> list[str]:
    """A sentence for each true or false where a number is expected: pydantic would take it for 1 or 0."""
    expected = _at(root, keys)
    given = _given(table, keys)
    if isinstance(given, bool):
        fits = not expected or bool in expected or Any in expected
        return [] if fits else [f"{'.'.join(map(str, keys))}: {mismatch(expected, given)}"]
    inside = given if isinstance(given, dict) else range(len(given)) if isinstance(given, list) else ()
    return [text for key in inside for text in misplaced_booleans(table, root, (*keys, key))]


def mismatch(expected: Sequence[Any], given: Any) -> str:
    """What was expected and what came."""
    words = list(dict.fromkeys(word for kind in expected for word in _words(kind)))
    wanted = ", ".join(words[:-1]) + (" or " if words[:-1] else "") + words[-1] if words else "something else"
    names = [name for kind in expected if typing.get_origin(kind) is typing.Literal for name in typing.get_args(kind)]
    hint = did_you_mean(given, names) if isinstance(given, str) and names else ""
    return f"expected {wanted}, got {shown(given)}" + (f"; {hint}" if hint.startswith("did") else "")


def shown(given: Any) -> str:
    """A value as TOML would have it, cut short."""
    text = str(given).lower() if isinstance(given, bool) else repr(given)
    return text if len(text) <= 80 else text[:77] + "..."


def members(annotation: Any) -> list[Any]:
    """The members of a union, or the one type; without None."""
    if isinstance(annotation, types.UnionType) or typing.get_origin(annotation) is typing.Union:
        return [kind for member in typing.get_args(annotation) for kind in members(member)]
    return [] if annotation is type(None) else [annotation]


def _words(kind: Any) -> list[str]:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return [repr(name) for name in arguments if name]
    if origin is list:
        inside = dict.fromkeys(_plural(word) for member in members(arguments[0]) for word in _words(member))
        return [f"a list of {' or '.join(inside)}"]
    if kind is Column:
        return ["a column's name", "a table"]
    return [_WORDS.get(origin or kind, "a table")]


def _plural(word: str) -> str:
    word = word.removeprefix("a ")
    return f"lists{word.removeprefix('list')}" if word.startswith("list") else f"{word}s"


def _own_keys(error: Any, table: Any) -> tuple[str | int, ...]:
    """The keys of an error that are the user's: those that lead somewhere in the table, and a missing one."""
    keys: list[str | int] = []
    for part in error["loc"]:
        if (isinstance(table, dict) and part in table) or (isinstance(table, list) and isinstance(part, int)):
            keys.append(part)
            table = table[part]
    if error["type"] in ("missing", "missing_argument"):
        keys.append(error["loc"][-1])
    return tuple(keys)


def _given(table: Any, keys: Iterable[str | int]) -> Any:
    for key in keys:
        table = table[key]
    return table


def _at(root: Any, keys: Iterable[str | int]) -> list[Any]:
    """The types that may stand at a path of keys."""
    current = members(root)
    for key in keys:
        following: list[Any] = []
        for kind in current:
            if dataclasses.is_dataclass(kind):
                following += members(typing.get_type_hints(kind).get(str(key), type(None)))
            elif typing.get_origin(kind) is (list if isinstance(key, int) else dict):
                following += members(typing.get_args(kind)[-1])
        current = following
    return current


def _fields(kinds: Iterable[Any]) -> list[str]:
    return [field.name for kind in kinds if dataclasses.is_dataclass(kind) for field in dataclasses.fields(kind)]
