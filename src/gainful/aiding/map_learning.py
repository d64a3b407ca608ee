"""Learning what a sensor does wrong every time, while something better tells."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, DataError, ShapeError
from ..models import AbstractModel, Sample
from ..networks import AbstractTraining, CMACTraining, TrainingReport
from ..running import Log, Result, samples_of
from ..running.compiled import compiled_call
from .sensor_maps import SensorMap, SensorMappedModel, angular, check_signal, context_of

_OVERLAP = 1.3 * math.pi  # rad; angles are learned so far beyond a half turn, so that the map closes


@dataclasses.dataclass(frozen=True)
class SensorMapReport:
    """What learning a sensor's error came to, in the signal's tangent unit.

    Attributes:
        signal: the output that errs.
        before: root mean square of its error on the records held out, or on all if none were.
        after: the same with the map taken off.
        in_sample: what is left on the training records.
        unknown: share of rows held out about which the map says nothing.
        training: of the network.
        warnings: what a reader of the numbers should know.
    """

    signal: str
    before: float
    after: float
    in_sample: float
    unknown: float
    training: TrainingReport
    warnings: tuple[str, ...] = ()


def learn_sensor_map(
    model: AbstractModel,
    logs: Sequence[Log],
    states: Sequence[Result | Float[np.ndarray, "T size"]],
    signal: str,
    context: Sequence[str],
    *,
    key: Array,
    training: AbstractTraining | None = None,
    floor: float = 0.0,
    held_out: int = 0,
    every: int = 1,
    start: float = 0.0,
    end: float = 0.0,
    least_visits: float = 20.0,
) -> tuple[SensorMap, SensorMapReport]:
    """The repeatable error of a signal, learned from what was measured and what should have been.

    ```
    error = y [-] h(x_reference)  as a function of the context at x_reference
    ```

    States may be truth, a better instrument's, or smoothed from the same record. A smoother that believed the sensor has
    taken on part of its error already, which the map then lacks; learning again from a record smoothed with the map
    brings some of it back.

    Args:
        model: of the plant; of one with maps the maps are taken off first.
        logs: records with the signal.
        states: reference states of each, as an array or as a result of the same rows.
        signal: the output, as the covariance has it.
        context: states, inputs, outputs, "t" or "dt" that the error depends on.
        key: random key of the training.
        training: how the map is made; a CMAC of 60 levels and 10 layers without compression by default.
        floor: least sigma to leave the sensor with, in the signal's tangent unit.
        held_out: how many of the records, the last ones, are kept to judge the map.
        every: take each so many rows.
        start: seconds left out at the start of each record.
        end: seconds left out at its end.
        least_visits: visits in training that the map asks for to say anything; each epoch counts.

    Raises:
        ConfigError: an unknown name, or an argument out of its range.
        ShapeError, DataError: records and states that do not fit, or too few samples.
    """
    base = model.base if isinstance(model, SensorMappedModel) else model
    row, context = check_signal(signal, base), tuple(context)
    if not context:
        raise ConfigError("context: expected at least one name, got none")
    angles = angular(context, base)
    if not 0 <= held_out < len(logs):
        raise ConfigError(f"held_out: expected from 0 to {len(logs) - 1} of the records, got {held_out!r}")
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        raise ConfigError(f"every: expected a whole number of at least 1, got {every!r}")
    if not floor >= 0:
        raise ConfigError(f"floor: expected a sigma of at least 0, got {floor!r}")
    if len(states) != len(logs):
        raise ConfigError(f"states: expected one per record, {len(logs)}, got {len(states)}")
    if training is None:
        training = CMACTraining(levels=60, layers=10, compress="none", epochs=2)
    window = (every, start, end)
    found = [_examples(base, log, given, row, context, window) for log, given in zip(logs, states, strict=True)]
    inputs, errors = (np.concatenate(parts) for parts in zip(*found[: len(found) - held_out], strict=True))
    if not len(inputs):
        raise DataError(f"signal {signal!r}: expected rows with both a measurement and a reference, got none")
    more_inputs, more_errors = _closed(inputs, errors, angles)
    network, trained = training(more_inputs, more_errors[:, None], key=key)
    bare = SensorMap(signal, context, network, jnp.asarray(1.0), least_visits)
    left, known = _left(bare, inputs, errors)
    std = math.sqrt(float(np.mean(left[known] ** 2))) if known.any() else math.nan
    learned = SensorMap(signal, context, network, jnp.asarray(max(std, floor)), least_visits)
    judged = [np.concatenate(parts) for parts in zip(*(found[-held_out:] if held_out else found), strict=True)]
    after, there = _left(learned, *judged)
    return learned, SensorMapReport(
        signal=signal,
        before=_rms(judged[1]),
        after=_rms(after),
        in_sample=_rms(left),
        unknown=float(np.mean(~there)),
        training=trained,
        warnings=(*_warnings(signal, row, known, states), *trained.warnings),
    )


def _warnings(signal: str, row: int, known: np.ndarray, states: Sequence[Result | np.ndarray]) -> list[str]:
    told = []
    if any(isinstance(each, Result) and each.log.seen[:, row].any() for each in states):
        told.append(f"the teacher used {signal} itself: the map lacks what the teacher took on of its error")
    if not known.any():
        told.append(f"the map of {signal} says nothing anywhere: more records, or a coarser table, are needed")
    return told


def _examples(
    model: AbstractModel,
    log: Log,
    given: Result | Float[np.ndarray, "T size"],
    row: int,
    context: tuple[str, ...],
    window: tuple[int, float, float],
) -> tuple[Float[np.ndarray, "N d"], Float[np.ndarray, " N"]]:
    """Contexts and errors of one record."""
    states = np.asarray(given.mean if isinstance(given, Result) else given, dtype=float)
    if states.shape != (len(log), model.space.size):
        raise ShapeError(f"states: expected shape ({len(log)}, {model.space.size}), got {states.shape}")
    every, start, end = window
    rows = np.isfinite(states).all(axis=1) & log.seen[:, row]
    rows &= (log.t >= log.t[0] + start) & (log.t <= log.t[-1] - end)
    chosen = np.flatnonzero(rows)[::every]
    samples = jax.tree.map(lambda leaf: jnp.asarray(leaf[chosen]), samples_of(log, float))

    found, _ = compiled_call(_contexts, (model, context, row), jnp.asarray(states[chosen]), samples)
    return np.asarray(found[0]), np.asarray(found[1])


def _contexts(parts: tuple[AbstractModel, tuple[str, ...], int], states: Array, samples: Sample) -> tuple[Array, Array]:
    """Contexts at reference states, and errors of a signal there."""
    model, context, row = parts

    def one(x: Array, sample: Sample) -> tuple[Array, Array]:
        y = model.observe(x, sample.when)
        return context_of(context, model, x, y, sample.when), model.output.minus(sample.y, y)[row]

    return jax.vmap(one)(states, samples)


def _closed(
    inputs: Float[np.ndarray, "N d"], errors: Float[np.ndarray, " N"], angles: tuple[bool, ...]
) -> tuple[Float[np.ndarray, "K d"], Float[np.ndarray, " K"]]:
    """The examples once more a turn on and a turn back, as far as they are near the cut of an angle."""
    for column in np.flatnonzero(angles):
        turned = [inputs + turn * 2 * math.pi * np.eye(inputs.shape[1])[column] for turn in (-1, 0, 1)]
        inputs, errors = np.concatenate(turned), np.tile(errors, 3)
        near = np.abs(inputs[:, column]) <= _OVERLAP
        inputs, errors = inputs[near], errors[near]
    return inputs, errors


def _left(each: SensorMap, inputs: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the map leaves of the errors, and where it says anything."""
    said, _ = compiled_call(_said, each, jnp.asarray(inputs))
    return errors - np.asarray(said[0]), np.asarray(said[1])


def _said(each: SensorMap, inputs: Array) -> tuple[Array, Array]:
    """Errors in many contexts, and whether they are known."""
    return jax.vmap(lambda u: (each.error(u), each.known(u)))(inputs)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan
