"""Records to fit and records to judge the fit by, all of one length so that one program serves them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool

from ...errors import ConfigError
from ...estimates import AbstractEstimate
from ...filters import AbstractEstimator
from ...models import AbstractModel, Sample
from ..checks import check_problem
from ..log import Log
from ..run import samples_of

LEAST_ROWS = 10
"""Fewer rows with a measurement tell nothing of noise."""


@dataclasses.dataclass(frozen=True)
class Record:
    """A record padded with rows in which nothing happens.

    Attributes:
        log: as it was given.
        prior: the estimate before its first row.
        samples: stacked along time, padded.
        fitted: rows that are fitted.
        held: rows that are kept apart to judge the fit by.
    """

    log: Log
    prior: AbstractEstimate
    samples: Sample
    fitted: Bool[np.ndarray, " T"]
    held: Bool[np.ndarray, " T"]


def make_records(
    parts: tuple[AbstractEstimator, AbstractModel],
    prior: AbstractEstimate | Sequence[AbstractEstimate],
    logs: Log | Sequence[Log],
    held_out: float | Log | Sequence[Log],
    skip: int,
) -> tuple[Record, ...]:
    """The records, each with the rows to fit and those held out.

    Args:
        parts: estimator and model.
        prior: before the first row of every record, or one each, held-out records last.
        logs: to fit.
        held_out: share of the rows (of one record) or of the records (of several) at the end, or other records.
        skip: measured rows at the start of each record that count for nothing.

    Raises:
        ConfigError: a share or a number that is none, or too little left.
        ShapeError, CovarianceError, ModelError, DataError: parts that do not fit each other.
    """
    given = [logs] if isinstance(logs, Log) else list(logs)
    if not given:
        raise ConfigError("logs: expected at least one record, got none")
    if isinstance(skip, bool) or not isinstance(skip, int) or skip < 0:
        raise ConfigError(f"skip: expected a whole number of at least 0, got {skip!r}")
    share, others = 0.0, []
    if isinstance(held_out, (int, float)):
        share = float(held_out)
        if not 0 <= share < 1:
            raise ConfigError(f"held_out: expected a share from 0 to below 1, or records, got {held_out!r}")
    else:
        others = [held_out] if isinstance(held_out, Log) else list(held_out)
    everything = given + others
    priors = [prior] * len(everything) if isinstance(prior, AbstractEstimate) else list(prior)
    if len(priors) != len(everything):
        raise ConfigError(f"prior: expected one, or one for each of {len(everything)} records, got {len(priors)}")
    length = max(map(len, everything))
    apart = len(given) - math.ceil(share * len(given)) if share and len(given) > 1 else len(given)
    out = []
    for i, (log, start) in enumerate(zip(everything, priors, strict=True)):
        check_problem(*parts, start, log)
        counted = log.seen.any(axis=1)
        counted &= np.cumsum(counted) > skip
        held = np.full(len(log), i >= apart)
        if share and len(given) == 1:
            held = np.cumsum(counted) > round((1 - share) * counted.sum())
        pad = length - len(log)
        rows = [np.concatenate([mask, np.zeros(pad, bool)]) for mask in (counted & ~held, counted & held)]
        out.append(Record(log, start, padded(samples_of(log, start.mean.dtype), pad), *rows))
    fitted = sum(int(record.fitted.sum()) for record in out)
    if fitted < LEAST_ROWS:
        raise ConfigError(f"logs: expected at least {LEAST_ROWS} measured rows to fit, got {fitted}")
    return tuple(out)


def padded(samples: Sample, after: int, before: int = 0) -> Sample:
    """The samples with rows before and after in which nothing happens."""

    def pad(values: Any) -> np.ndarray:
        values = np.asarray(values)
        head, tail = np.repeat(values[:1], before, axis=0), np.repeat(values[-1:], after, axis=0)
        return np.concatenate([head, values, tail])

    whole = jax.tree.map(pad, samples)
    for part in (slice(0, before), slice(len(whole.when.t) - after, None)):
        whole.when.dt[part] = 0
        whole.seen[part] = False
    return whole
