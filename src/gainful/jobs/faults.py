"""What a run found of the faults it was asked to look for."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..config import EstimateConfig
from ..errors import ConfigError
from ..faults import (
    FaultModel,
    alarms,
    calibrate_threshold,
    detection_delay,
    explain,
    fault_free_statistics,
    fault_scores,
    isolability,
    single_fault_scores,
)
from ..filters import Info, JumpReport
from ..running import Result

EVENTS = 10
"""False alarms that a calibrated threshold rests on: its rate is then known to about a third."""
MERGED = 20
"""Exceedances at most so many steps apart are one alarm."""


@dataclasses.dataclass(frozen=True)
class FaultFinding:
    """One fault.

    Attributes:
        name: of its state.
        unit: of its size.
        times: when alarms were raised [s].
        size: estimate at the end.
        sigma: its standard deviation there.
        largest: the largest estimate in the record.
        explained: the faults that explain the record best at the first alarm; more than one where they cannot be told apart.
        delay: from a known onset to the first alarm [s]; None where no onset is known, NaN where it was missed.
    """

    name: str
    unit: str
    times: tuple[float, ...]
    size: float
    sigma: float
    largest: float
    explained: tuple[str, ...]
    delay: float | None


@dataclasses.dataclass(frozen=True)
class FaultFindings:
    """All faults, and what could be found at all.

    Attributes:
        faults: one by one.
        isolability: which faults the record can tell, and which pass for one another.
        limit: the threshold in words.
    """

    faults: tuple[FaultFinding, ...]
    isolability: str
    limit: str


def find_faults(config: EstimateConfig, result: Result) -> FaultFindings:
    """Alarms with their times, sizes and delays, of a run whose model has faults.

    Alarms are a jump bank's own where the filter is one; else they are raised where the filtered estimate of a fault
    exceeds its standard deviation by the configured threshold.

    Raises:
        ConfigError: no alarm can be raised, since the hold-off is longer than the record.
    """
    section, model = config.faults, result.model
    assert section is not None
    assert isinstance(model, FaultModel)
    filtered = result if result.filtered is None else result.filtered
    above, raised, limit = _alarms(config, filtered)
    count, kept = len(model.fault_names), result.log.kept
    explained = np.asarray(single_fault_scores(jnp.asarray(filtered.mean), jnp.asarray(filtered.cov), count))
    base, means, sigmas = model.base.space, result.mean[kept], result.std[kept]
    found = []
    for k, name in enumerate(model.fault_names):
        rows = np.flatnonzero(raised[:, k] & kept)
        estimate = means[:, base.size + k]
        # Where the time of an alarm is the first row that can tell, the scores a little later tell more.
        at = min(rows[0] + MERGED, len(explained) - 1) if rows.size else 0
        found.append(
            FaultFinding(
                name,
                model.space.units[base.size + k],
                tuple(float(t) for t in result.t[rows]),
                float(estimate[-1]),
                float(sigmas[-1, base.dof + k]),
                float(estimate[np.argmax(np.abs(estimate))]),
                _explained(model, explained[at]) if rows.size else (),
                _delay(config, name, result.t, above[:, k]),
            )
        )
    able = isolability(model, result.prior, result.log)
    return FaultFindings(tuple(found), able.sentence, limit)


def fault_rows_of(findings: FaultFindings) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of faults."""
    heads = ["fault", "unit", "at the end", "sigma", "largest", "alarms [s]", "explained by"]
    known = any(each.delay is not None for each in findings.faults)
    rows: list[list[Any]] = []
    for each in findings.faults:
        times = ", ".join(f"{t:.6g}" for t in each.times[:3]) + (", ..." if len(each.times) > 3 else "")
        row: list[Any] = [
            each.name,
            each.unit,
            each.size,
            each.sigma,
            each.largest,
            times or None,
            " or ".join(each.explained) or None,
        ]
        if known:
            row.append("missed" if each.delay is not None and math.isnan(each.delay) else each.delay)
        rows.append(row)
    return heads + (["delay [s]"] if known else []), rows


def _explained(model: FaultModel, scores: np.ndarray) -> tuple[str, ...]:
    found = explain(model.fault_names, jnp.asarray(scores))
    return (found.fault, *found.rivals)


def _alarms(config: EstimateConfig, result: Result) -> tuple[np.ndarray, np.ndarray, str]:
    """Rows above the threshold and rows in which an alarm is raised, per fault, and the threshold in words."""
    section, model = config.faults, result.model
    assert section is not None
    assert isinstance(model, FaultModel)
    if isinstance(result.memories, JumpReport):
        report = result.memories
        # The bank counts all added states; the faults are the last of them.
        which = model.space.added - len(model.fault_names) + np.arange(len(model.fault_names))
        raised = np.asarray(report.alarm)[:, None] & (np.asarray(report.bias)[:, None] == which)
        words = f"{result.estimator.threshold:g} of the jump bank's likelihood ratio"  # type: ignore[attr-defined]
        return raised, raised, words
    count, t = len(model.fault_names), result.t
    scores = np.abs(np.asarray(fault_scores(jnp.asarray(result.mean), jnp.asarray(result.cov), count)))
    merge = MERGED * float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    value, words = section.threshold, f"{section.threshold:g} standard deviations"
    if section.false_alarms is not None:
        value, words = _calibrated(config, result, merge)
    times, by_fault = jnp.asarray(t), jnp.asarray(scores)
    raised = [alarms(times, by_fault[:, k], value, merge=merge, hold_off=section.hold_off) for k in range(count)]
    above = (scores > value) & (t - t[0] >= section.hold_off)[:, None]
    return above, np.stack([np.asarray(each) for each in raised], axis=1), words


def _calibrated(config: EstimateConfig, result: Result, merge: float) -> tuple[float, str]:
    """The threshold of a stated rate of false alarms, from simulated runs without faults."""
    section, model, log = config.faults, result.model, result.log
    assert section is not None
    assert section.false_alarms is not None
    rate = section.false_alarms / 1000.0  # 1/s
    length = float(log.t[-1] - log.t[0]) - section.hold_off
    if not length > 0:
        raise ConfigError(f"faults.hold_off: expected less than the record's length, got {section.hold_off!r} s")
    runs = math.ceil(EVENTS / (rate * length))
    statistics = fault_free_statistics(
        _Largest(model.space.added),
        result.estimator,
        model,
        result.prior,
        log.t,
        log.u,
        runs=runs,
        key=jax.random.key(0),
    )
    found = calibrate_threshold(statistics, log.t, rate, merge=merge, hold_off=section.hold_off)
    return found.value, f"{found.value:.3g} standard deviations ({found.sentence})"


@dataclasses.dataclass(frozen=True)
class _Largest:
    """The largest score of all faults along a run."""

    count: int

    def __call__(self, info: Info) -> Any:
        cov = jax.vmap(lambda estimate: estimate.cov)(info.estimate)
        return jnp.max(jnp.abs(fault_scores(info.estimate.mean, cov, self.count)), axis=-1)


def _delay(config: EstimateConfig, name: str, t: np.ndarray, above: np.ndarray) -> float | None:
    """From the onset of the fault put into this signal until it is above the threshold; None if none was put there."""
    onsets = [each for each in config.inject if name.endswith(f"_{each.signal}")]
    if not onsets:
        return None
    end = math.inf if onsets[0].end is None else onsets[0].end
    return float(detection_delay(t, above, onsets[0].onset, end))
