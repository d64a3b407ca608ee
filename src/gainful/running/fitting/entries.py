"""What of a model's noise is fitted: standard deviations by name, those that belong together as one."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...errors import ConfigError, did_you_mean
from ...estimates import AbstractEstimate
from ...models import AbstractModel, Instant
from ..compiled import compiled_call
from ..log import Log

BELONGS = 0.5
"""Noises correlated beyond this are one noise that enters in two places, and are fitted as one."""

_MOMENTS = 64
"""Noise given as functions is averaged over so many rows of the record."""

Kind = Literal["process", "measurement"]
Names = Sequence[str | Sequence[str]]


@dataclasses.dataclass(frozen=True)
class NoiseEntry:
    """Standard deviations of Q or R that one factor multiplies.

    Attributes:
        kind: "process" for Q, "measurement" for R.
        names: of states, as the covariance writes them, or of outputs.
    """

    kind: Kind
    names: tuple[str, ...]

    @property
    def label(self) -> str:
        """How tables call it."""
        return f"{'Q' if self.kind == 'process' else 'R'} {', '.join(self.names)}"


@dataclasses.dataclass(frozen=True)
class TypicalNoise:
    """Q and R of a model along a record, averaged.

    Attributes:
        process: per step of typical length (dof, dof).
        measurement: covariance of the measurement noise (m, m).
        step: the typical length [s].
    """

    process: np.ndarray
    measurement: np.ndarray
    step: float

    def of(self, entry: NoiseEntry, model: AbstractModel) -> tuple[float, ...]:
        """Standard deviations of an entry."""
        cov, names = self.block(entry.kind, model)
        return tuple(float(np.sqrt(cov[names.index(name), names.index(name)])) for name in entry.names)

    def block(self, kind: Kind, model: AbstractModel) -> tuple[np.ndarray, tuple[str, ...]]:
        """One of the covariances and the names of its rows."""
        if kind == "process":
            return self.process, model.space.tangent_names
        return self.measurement, model.output.tangent_names


def typical_noise(model: AbstractModel, prior: AbstractEstimate, log: Log) -> TypicalNoise:
    """Q over the median step and R, at the prior's mean, averaged along a record."""
    steps = log.dt[log.dt > 0]
    step = float(np.median(steps)) if steps.size else 1.0
    rows = np.linspace(0, len(log) - 1, _MOMENTS).astype(int)
    dtype = prior.mean.dtype
    moments = Instant(
        jnp.asarray(log.t[rows], dtype), jnp.full(len(rows), step, dtype), jnp.asarray(log.u[rows], dtype)
    )
    (process, measurement), _ = compiled_call(_noises, model, prior.mean, moments)
    return TypicalNoise(np.asarray(process), np.asarray(measurement), step)


def _noises(model: AbstractModel, x: Array, moments: Instant) -> tuple[Array, Array]:
    both = jax.vmap(lambda when: (model.process_noise(x, when), model.measurement_noise(x, when)))(moments)
    return jnp.mean(both[0], axis=0), jnp.mean(both[1], axis=0)


def noise_entries(
    model: AbstractModel, typical: TypicalNoise, process: Names | None, measurement: Names | None
) -> tuple[NoiseEntry, ...]:
    """The entries to fit: those named, or all that the model has, correlated ones as one.

    Raises:
        ConfigError: a name that is not the model's, or given twice, or without noise; or nothing to fit.
    """
    given: tuple[tuple[Kind, Names | None], ...] = (("process", process), ("measurement", measurement))
    entries: list[NoiseEntry] = []
    for kind, chosen in given:
        cov, names = typical.block(kind, model)
        groups = _together(cov, names) if chosen is None else [_group(each) for each in chosen]
        _check_names(kind, groups, cov, names)
        entries += [NoiseEntry(kind, group) for group in groups]
    if not entries:
        raise ConfigError("process, measurement: expected at least one entry to fit, got none")
    return tuple(entries)


def _group(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _check_names(kind: Kind, groups: list[tuple[str, ...]], cov: np.ndarray, names: Sequence[str]) -> None:
    seen: set[str] = set()
    for name in (name for group in groups for name in group):
        if name not in names:
            raise ConfigError(f"{kind}: {name!r} is not one of the model's; {did_you_mean(name, names)}")
        if name in seen:
            raise ConfigError(f"{kind}: expected each name once, got {name!r} twice")
        if not cov[names.index(name), names.index(name)] > 0:
            raise ConfigError(f"{kind}: the model has no noise for {name!r}, and a factor on none changes nothing")
        seen.add(name)


def _together(cov: np.ndarray, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Names with noise, in groups that are correlated beyond `BELONGS`, directly or through others."""
    alive = [i for i in range(len(names)) if cov[i, i] > 0]
    size = np.sqrt(np.where(np.diag(cov) > 0, np.diag(cov), 1.0))
    linked = np.abs(cov / np.outer(size, size)) > BELONGS
    groups: list[list[int]] = []
    for i in alive:
        near = [group for group in groups if any(linked[i, j] for j in group)]
        groups = [group for group in groups if group not in near] + [sorted([i, *(j for group in near for j in group)])]
    return [tuple(names[i] for i in group) for group in sorted(groups)]


def factors_of(
    entries: Sequence[NoiseEntry], logs: Float[Array | np.ndarray, " entries"]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Factors by the names of states and of outputs, given the entries' logarithms."""
    out: Mapping[Kind, dict[str, Any]] = {"process": {}, "measurement": {}}
    for i, entry in enumerate(entries):
        out[entry.kind].update(dict.fromkeys(entry.names, jnp.exp(logs[i])))
    return out["process"], out["measurement"]
