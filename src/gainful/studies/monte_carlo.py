"""An experiment run by run, a few at a time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, Status
from ..filters import Info
from ..running.compiled import compiled_call
from .experiment import Experiment

AT_ONCE = 8
"""Runs of which all results are held at the same time."""


@dataclasses.dataclass(frozen=True)
class Trace:
    """A series over runs.

    Attributes:
        first: of the first run (T, ...).
        mean: over runs (T, ...).
        std: over runs (T, ...); 0 for a single run.
        runs: how many.
    """

    first: Float[np.ndarray, "T ..."]
    mean: Float[np.ndarray, "T ..."]
    std: Float[np.ndarray, "T ..."]
    runs: int


@dataclasses.dataclass(frozen=True)
class Results:
    """All that is kept of an experiment.

    Attributes:
        experiment: that was run.
        values: by contender and quantity, one number per run (n,).
        traces: by contender and name.
        failed: steps that failed, by contender, one number per run (n,); only filters tell.
        record: of the first run.
    """

    experiment: Experiment
    values: dict[str, dict[str, Float[np.ndarray, "n"]]]
    traces: dict[str, dict[str, Trace]]
    failed: dict[str, np.ndarray]
    record: Any

    @property
    def runs(self) -> int:
        """How many there were."""
        return len(next(iter(self.failed.values())))


def run_key(seed: int, index: int) -> Array:
    """The random key of a run: of its own, whatever else is run."""
    return jax.random.fold_in(jax.random.key(seed), index)


def run_experiment(
    experiment: Experiment,
    runs: int,
    seed: int,
    *,
    progress: Callable[[], None] | None = None,
    at_once: int = AT_ONCE,
    together: bool | None = None,
) -> Results:
    """Run an experiment; its numbers depend on the seed, and the first ones not on how many follow.

    Args:
        experiment: to run.
        runs: how many, of which the experiment may make fewer.
        seed: of the random keys.
        progress: called after each run.
        at_once: runs in flight at the same time; more need more memory and change no number.
        together: whether these are stepped as one batch, whose rounding may differ in the last digits; by default only
            on accelerators.

    Raises:
        ModelError: `measure` does not return what the experiment's quantities promise.
    """
    n = experiment.runs(runs)
    values = {
        name: {quantity.name: np.full(n, np.nan) for quantity in experiment.quantities}
        for name in experiment.contenders
    }
    failed = {name: np.zeros(n, int) for name in experiment.contenders}
    sums: dict[str, dict[str, _Sum]] = {name: {} for name in experiment.contenders}
    first = None
    together = jax.default_backend() != "cpu" if together is None else together
    for index, record, found in _each(experiment, n, seed, at_once, together):
        first = record if first is None else first
        for name, (numbers, series, failures) in found.items():
            for quantity, value in numbers.items():
                values[name][quantity][index] = value
            for what, one in series.items():
                sums[name].setdefault(what, _Sum(one)).add(one)
            failed[name][index] = failures
        if progress is not None:
            progress()
    traces = {name: {what: total.trace() for what, total in each.items()} for name, each in sums.items()}
    return Results(experiment, values, traces, failed, first)


class _Sum:
    """Mean and spread of series, added one by one in the order of the runs, so that no chunk changes their rounding."""

    def __init__(self, first: np.ndarray) -> None:
        self.first, self.count = first, 0
        self.mean, self.squares = np.zeros_like(first), np.zeros_like(first)

    def add(self, one: np.ndarray) -> None:
        self.count += 1
        off = one - self.mean
        self.mean = self.mean + off / self.count
        self.squares = self.squares + off * (one - self.mean)

    def trace(self) -> Trace:
        return Trace(self.first, self.mean, np.sqrt(self.squares / max(self.count - 1, 1)), self.count)


_Found = tuple[dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]


def _each(
    experiment: Experiment, runs: int, seed: int, at_once: int, together: bool
) -> Iterator[tuple[int, Any, dict[str, _Found]]]:
    """Run by run: its number, its record if it is the first, and what was found for each contender."""
    judges = {name: (experiment, contender) for name, contender in experiment.contenders.items()}
    for start in range(0, runs, at_once):
        indices = range(start, min(start + at_once, runs))
        if together:
            # The last batch is filled up, so that one program serves all.
            keys = jnp.stack([run_key(seed, min(index, runs - 1)) for index in range(start, start + at_once)])
            records, _ = compiled_call(_simulate_all, experiment.simulate, keys)
            batch = {name: compiled_call(_judge_all, _parts(*judge), records)[0] for name, judge in judges.items()}
            pieces = [
                (_piece(records, k), {name: _piece(found, k) for name, found in batch.items()})
                for k in range(len(indices))
            ]
        else:
            # All are under way before the first is waited for.
            pieces = []
            for index in indices:
                record, _ = compiled_call(_simulate, experiment.simulate, run_key(seed, index))
                pieces.append(
                    (record, {name: compiled_call(_judge, _parts(*judge), record)[0] for name, judge in judges.items()})
                )
        for index, (record, found) in zip(indices, pieces, strict=True):
            yield index, None if index else jax.tree.map(np.asarray, record), jax.tree.map(np.asarray, found)


def _parts(experiment: Experiment, contender: Any) -> Any:
    names = tuple(quantity.name for quantity in experiment.quantities)
    return contender, experiment.measure, experiment.trace, experiment.name, names


def _piece(tree: Any, k: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[k], tree)


def _simulate(simulate: Callable[[Array], Any], key: Array) -> Any:
    return simulate(key)


def _simulate_all(simulate: Callable[[Array], Any], keys: Array) -> Any:
    return jax.vmap(simulate)(keys)


def _judge_all(parts: Any, records: Any) -> Any:
    return jax.vmap(lambda record: _judge(parts, record))(records)


def _judge(parts: Any, record: Any) -> Any:
    contender, measure, trace, experiment, names = parts
    reading = contender(record)
    numbers = {name: jnp.asarray(value, float) for name, value in measure(record, reading).items()}
    if set(numbers) != set(names):
        raise ModelError(f"measure of experiment {experiment!r}: expected {sorted(names)}, got {sorted(numbers)}")
    for name, value in numbers.items():
        if value.shape:
            raise ModelError(
                f"measure of experiment {experiment!r}: {name!r}: expected a single number, got shape {value.shape}"
            )
    series = {} if trace is None else {name: jnp.asarray(one, float) for name, one in trace(record, reading).items()}
    failures = jnp.sum(reading.status >= Status.not_positive) if isinstance(reading, Info) else jnp.zeros((), int)
    return numbers, series, failures
