"""A configuration's text with other noise in it, its comments and its order kept."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from ..models import AbstractModel, Model
from ..models.extended import layers
from .schema import EstimateConfig

DIGITS = 6
"""Of the numbers written: a noise is not known better."""


class Rewriting:
    """A configuration's text on the way to another one.

    Attributes:
        changes: what was changed, as paths of keys.
    """

    def __init__(self, text: str, config: EstimateConfig, model: AbstractModel) -> None:
        self._document: Any = tomlkit.parse(text)
        self._config = config
        self._bare = list(layers(model))[-1]
        self.changes: list[str] = []

    @property
    def text(self) -> str:
        """The text as it is now."""
        return tomlkit.dumps(self._document)

    def move(self, old: Path, new: Path) -> None:
        """Make paths that are relative to one folder relative to another."""
        if self._config.model.file:
            self._document["model"]["file"] = _relative(old / self._config.model.file, new)
        folder = _relative(old / self._config.data.folder, new)
        if "folder" not in self._document["data"]:
            # At the head of its section: what is appended comes after the comment on the next one.
            text, count = re.subn(
                r"^\s*\[data\][^\n]*\n", lambda head: f'{head[0]}folder = "{folder}"\n', self.text, flags=re.M
            )
            if count:
                self._document = tomlkit.parse(text)
                return
        self._document["data"]["folder"] = folder

    def scale_noise(self, states: Mapping[str, float], outputs: Mapping[str, float], alive: Sequence[str]) -> None:
        """Multiply standard deviations of the noise.

        Numbers of the configuration are changed where that is exactly the same; all else goes into its `noise`.

        Args:
            states: factors by the name of a state, as the covariance writes it.
            outputs: factors by the name of an output.
            alive: states that have noise.
        """
        states, outputs = dict(states), dict(outputs)
        self._scale_outputs(outputs)
        self._scale_states(states, alive)
        for name, section in self._config.parameters.items():
            if name in states and section.walk:
                self._set(("parameters", name, "walk"), section.walk * states.pop(name))
        left = [{name: _short(factor) for name, factor in each.items()} for each in (states, outputs)]
        if any(left):
            given: Any = self._config.noise
            table = scaled_beneath(given, *left)
            inline = _inline(table)
            self._document["noise"] = inline if isinstance(given, str) else _table(table)
            self.changes.append("noise")

    def _scale_outputs(self, factors: dict[str, float]) -> None:
        section = self._config.model
        if not section.kind:
            return
        if isinstance(self._bare, Model) and section.sensors:
            for part in self._bare.sensor_parts:
                value = section.sensors[part.name].R
                self._scale(("model", "sensors", part.name, "R"), value, part.output.tangent_names, factors)
        else:
            self._scale(("model", "R"), section.R, self._bare.output.tangent_names, factors)

    def _scale_states(self, factors: dict[str, float], alive: Sequence[str]) -> None:
        section, names = self._config.model, self._bare.space.tangent_names
        if not section.kind:
            return
        own = [factors.get(name, 1.0) for name in names if name in alive]
        if section.kind == "discrete" and section.G is None:
            self._scale(("model", "Q"), section.Q, names, factors)
        elif own and len(set(own)) == 1:  # a density, or noise that enters through G, can be scaled as a whole
            everywhere = dict.fromkeys(names, own[0])
            self._scale(("model", "Q"), section.Q, names, everywhere)
            if not everywhere:
                for name in names:
                    factors.pop(name, None)

    def _scale(self, path: tuple[str, ...], value: Any, names: Sequence[str], factors: dict[str, float]) -> None:
        """Scale a covariance given as numbers, and take its factors off those that are left."""
        if value is None or isinstance(value, str):
            return
        if all(factors.get(name, 1.0) == 1.0 for name in names):
            return
        self._set(path, _scaled(value, [factors.pop(name, 1.0) for name in names]))

    def _set(self, path: tuple[str, ...], value: Any) -> None:
        table = self._document
        for key in path[:-1]:
            table = table[key]
        table[path[-1]] = _rounded(value)
        self.changes.append(".".join(path))


def scaled_beneath(
    noise: str | Mapping[str, Any] | None, states: Mapping[str, float], outputs: Mapping[str, float]
) -> dict[str, Any]:
    """The table of a noise law with the model's noise scaled beneath it."""
    table: dict[str, Any] = {"kind": noise} if isinstance(noise, str) else dict(noise or {"kind": "nominal"})
    if table["kind"] == "nominal":
        return {"kind": "scaled"} | {
            key: dict(each) for key, each in (("states", states), ("outputs", outputs)) if each
        }
    if table["kind"] == "scaled":
        return table | {
            key: _product(table.get(key, {}), each) for key, each in (("states", states), ("outputs", outputs)) if each
        }
    return table | {"inner": scaled_beneath(table.get("inner"), states, outputs)}


def _product(own: Mapping[str, float], more: Mapping[str, float]) -> dict[str, float]:
    return {name: _short(own.get(name, 1.0) * more.get(name, 1.0)) for name in {**own, **more}}


def _scaled(value: Any, factors: Sequence[float]) -> Any:
    """A covariance as a configuration writes it (a number, variances, a matrix) with its deviations multiplied."""
    if not isinstance(value, list):
        same = len(set(factors)) == 1
        return value * factors[0] ** 2 if same else [value * factor**2 for factor in factors]
    if value and isinstance(value[0], list):
        return [[x * a * b for x, b in zip(row, factors, strict=True)] for row, a in zip(value, factors, strict=True)]
    spread = value if len(value) == len(factors) else value * len(factors)
    return [x * factor**2 for x, factor in zip(spread, factors, strict=True)]


def _rounded(value: Any) -> Any:
    return [_rounded(each) for each in value] if isinstance(value, list) else _short(value)


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def _inline(table: Mapping[str, Any]) -> Any:
    out = tomlkit.inline_table()
    for key, value in table.items():
        out[key] = _inline(value) if isinstance(value, Mapping) else value
    return out


def _table(table: Mapping[str, Any]) -> Any:
    out = tomlkit.table()
    for key, value in table.items():
        out[key] = _inline(value) if isinstance(value, Mapping) else value
    return out
