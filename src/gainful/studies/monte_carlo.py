"""An experiment run by run, a few at a time."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, Status, did_you_mean
from ..filters import Info
from ..running.compiled import compiled_call
from .experiment import Experiment

AT_ONCE = 8
"""Runs of which all results are held at the same time."""
FEW = 5
"""Experiments that are never run more often than that are compiled quickly."""


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
        every: by contender and name, the traces that the experiment keeps of every run (n, T, ...).
    """

    experiment: Experiment
    values: dict[str, dict[str, Float[np.ndarray, "n"]]]
    traces: dict[str, dict[str, Trace]]
    failed: dict[str, np.ndarray]
    record: Any
    every: dict[str, dict[str, Float[np.ndarray, "n ..."]]] = dataclasses.field(default_factory=dict)

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
    workers: int | None = None,
    quick: bool | None = None,
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
        workers: contenders that are made, compiled and run at the same time, in threads; one per core by default. They
            change no number.
        quick: compile without optimising, which changes the last digits; by default for experiments that are never run more
            than a few times.

    Raises:
        ModelError: `measure` does not return what the experiment's quantities promise, or there is no trace of a name that
            is to be kept.
    """
    n = experiment.runs(runs)
    values = {
        name: {quantity.name: np.full(n, np.nan) for quantity in experiment.quantities}
        for name in experiment.contenders
    }
    failed = {name: np.zeros(n, int) for name in experiment.contenders}
    sums: dict[str, dict[str, _Sum]] = {name: {} for name in experiment.contenders}
    every: dict[str, dict[str, list[np.ndarray]]] = {
        name: {what: [] for what in experiment.kept} for name in experiment.contenders
    }
    first = None
    together = jax.default_backend() != "cpu" if together is None else together
    quick = experiment.runs(FEW + 1) <= FEW if quick is None else quick
    for index, record, found in _each(experiment, n, seed, _How(at_once, together, workers or cores(), quick)):
        first = record if first is None else first
        for name, (numbers, series, failures) in found.items():
            for quantity, value in numbers.items():
                values[name][quantity][index] = value
            for what, one in series.items():
                sums[name].setdefault(what, _Sum(one)).add(one)
                if what in experiment.kept:
                    every[name][what].append(one)
            failed[name][index] = failures
        if progress is not None:
            progress()
    traces = {name: {what: total.trace() for what, total in each.items()} for name, each in sums.items()}
    stacked = {name: {what: np.stack(series) for what, series in each.items()} for name, each in every.items()}
    return Results(experiment, values, traces, failed, first, stacked)


def cores() -> int:
    """How many cores this process may use."""
    with contextlib.suppress(AttributeError):  # not on every system
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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


@dataclasses.dataclass(frozen=True)
class _How:
    """How runs are scheduled, see `run_experiment`."""

    at_once: int
    together: bool
    workers: int
    quick: bool


def _each(experiment: Experiment, runs: int, seed: int, how: _How) -> Iterator[tuple[int, Any, dict[str, _Found]]]:
    """Run by run: its number, its record if it is the first, and what was found for each contender."""
    pool = ThreadPoolExecutor(how.workers)
    make = _batch if how.together else _one_by_one
    try:
        for start in range(0, runs, how.at_once):
            indices = range(start, min(start + how.at_once, runs))
            records, found = make(experiment, indices, seed, how, pool)
            for k, index in enumerate(indices):
                yield index, None if index else records(k), {name: pieces(k) for name, pieces in found.items()}
    finally:
        # What has not begun is not waited for when a run fails or is stopped.
        pool.shutdown(wait=False, cancel_futures=True)


_Pieces = Callable[[int], Any]
"""From the place of a run in a batch to what belongs to it."""


def _batch(
    experiment: Experiment, indices: range, seed: int, how: _How, pool: ThreadPoolExecutor
) -> tuple[_Pieces, dict[str, _Pieces]]:
    # The last batch is filled up, so that one program serves all.
    keys = jnp.stack([run_key(seed, min(indices[0] + k, indices[-1])) for k in range(how.at_once)])
    records, _ = compiled_call(_simulate_all, experiment.simulate, keys, quick=how.quick)

    def judge(name: str) -> Any:
        found, _ = compiled_call(_judge_all, _parts(experiment, name), records, quick=how.quick)
        numbers, series, _ = found = jax.tree.map(np.asarray, found)
        _check(experiment, {what: value[0] for what, value in numbers.items()}, series)
        return found

    def pieces(tree: Any) -> _Pieces:
        return lambda k: jax.tree.map(lambda leaf: np.asarray(leaf[k]), tree)

    found = zip(experiment.contenders, pool.map(judge, experiment.contenders), strict=True)
    return pieces(records), {name: pieces(each) for name, each in found}


def _one_by_one(
    experiment: Experiment, indices: range, seed: int, how: _How, pool: ThreadPoolExecutor
) -> tuple[_Pieces, dict[str, _Pieces]]:
    def simulate(index: int) -> Any:
        return compiled_call(_simulate, experiment.simulate, run_key(seed, index), quick=how.quick)[0]

    records = list(pool.map(simulate, indices))

    def judge(name: str) -> list[Any]:
        # All runs of a contender in one thread: another contender may be made and compiled beside it.
        parts, out = _parts(experiment, name), []
        for record in records:
            found = jax.tree.map(np.asarray, compiled_call(_judge, parts, record, quick=how.quick)[0])
            _check(experiment, *found[:2])
            out.append(found)
        return out

    found = zip(experiment.contenders, pool.map(judge, experiment.contenders), strict=True)
    return lambda k: jax.tree.map(np.asarray, records[k]), {name: each.__getitem__ for name, each in found}


def _parts(experiment: Experiment, name: str) -> Any:
    return experiment.contenders[name], experiment.measure, experiment.trace


def _simulate(simulate: Callable[[Array], Any], key: Array) -> Any:
    return simulate(key)


def _simulate_all(simulate: Callable[[Array], Any], keys: Array) -> Any:
    return jax.vmap(simulate)(keys)


def _judge_all(parts: Any, records: Any) -> Any:
    return jax.vmap(lambda record: _judge(parts, record))(records)


def _judge(parts: Any, record: Any) -> Any:
    contender, measure, trace = parts
    reading = contender(record)
    numbers = {name: jnp.asarray(value, float) for name, value in measure(record, reading).items()}
    series = {} if trace is None else {name: jnp.asarray(one, float) for name, one in trace(record, reading).items()}
    failures = jnp.sum(reading.status >= Status.not_positive) if isinstance(reading, Info) else jnp.zeros((), int)
    return numbers, series, failures


def _check(experiment: Experiment, numbers: dict[str, np.ndarray], series: dict[str, np.ndarray]) -> None:
    """Whether a run has what the experiment promises; outside the program, which experiments may then share."""
    names = {quantity.name for quantity in experiment.quantities}
    if set(numbers) != names:
        raise ModelError(f"measure of experiment {experiment.name!r}: expected {sorted(names)}, got {sorted(numbers)}")
    for name, value in numbers.items():
        if value.shape:
            raise ModelError(
                f"measure of experiment {experiment.name!r}: {name!r}: expected a single number, got shape {value.shape}"
            )
    for name in experiment.kept:
        if name not in series:
            raise ModelError(
                f"experiment {experiment.name!r}: kept: {name!r} is no trace; {did_you_mean(name, series)}"
            )
