"""From a log and a configuration to the noise that fits, and a configuration that has it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..config import (
    EstimateConfig,
    build_faults,
    build_filter,
    build_injections,
    build_model,
    build_parameters,
    build_prior,
    load_config,
)
from ..config.rewriting import Rewriting
from ..diagnostics import NoiseAdvice, Verdict, noise_advice, verdict
from ..errors import ConfigError, did_you_mean
from ..io import check_folder, read_log, whole_folder
from ..models import AbstractModel
from ..running import FittedEntry, NoiseFit, Result, fit_noise, run
from ..running.fitting.entries import Kind, TypicalNoise, noise_entries, typical_noise
from ..version import __version__
from .json_text import json_text

LETTERS: dict[str, Kind] = {"Q": "process", "R": "measurement"}


@dataclasses.dataclass(frozen=True)
class TuneJob:
    """What tuning came to.

    Attributes:
        title: of the configuration.
        config: what was asked.
        model: of the plant, with the noise of the start.
        fit: the fitted noise.
        before: the record under the noise of the start: its verdict, and what its innovations say of the noise.
        after: likewise under the fitted noise.
        changes: keys of the configuration that were given other numbers.
        folder: where `tuned.toml` and `tune.json` lie, or None if nothing was written.
    """

    title: str
    config: EstimateConfig
    model: AbstractModel
    fit: NoiseFit
    before: tuple[Verdict, NoiseAdvice]
    after: tuple[Verdict, NoiseAdvice]
    changes: tuple[str, ...]
    folder: Path | None


def tune(
    path: Path | str,
    folder: Path | str | None = None,
    *,
    method: str = "ml",
    only: Sequence[str] = (),
    freeze: Sequence[str] = (),
    held_out: float = 0.3,
    skip: int = 0,
    floor: float = 1e-3,
    contamination: float | None = None,
) -> TuneJob:
    """Fit the noise of a configuration of `gainful estimate` to its record.

    Args:
        path: of the TOML file; files it names are relative to it.
        folder: where to leave `tuned.toml`, the configuration with the fitted noise, and `tune.json`, both or none; nothing if
            None.
        method: of `fit_noise`.
        only: entries to fit, such as "speed", "Q.speed" or "R.east,north" for two that share a factor; all if empty.
        freeze: names to leave as they are, likewise, in place of `only`.
        held_out: share of the rows at the end by which the fit is judged.
        skip: measured rows at the start that count for nothing.
        floor: smallest factor on a standard deviation.
        contamination: share of readings that may be outliers, see `fit_noise`.

    Raises:
        ConfigError: the configuration is not valid, or an argument is no such thing.
        GainfulError: the data, the model or the filter failed; the message says how.
    """
    path = Path(path)
    config = load_config(path)
    model = build_faults(config, build_parameters(config, build_model(config.model, path.parent)))
    prior, chosen = build_prior(config, model), build_filter(config, model)
    log = build_injections(config, read_log(model, config.data, path.parent), model)
    if folder is not None:
        check_folder(Path(folder))
    typical = typical_noise(model, prior, log)
    process, measurement = _chosen(model, typical, only, freeze)
    before = run(chosen, model, prior, log, throw=config.options.throw)
    fit = fit_noise(
        chosen,
        model,
        prior,
        log,
        method=method,
        process=process,
        measurement=measurement,
        held_out=held_out,
        skip=skip,
        floor=floor,
        contamination=contamination,
    )
    after = run(fit.estimator, model, prior, log, throw=config.options.throw)
    text = Rewriting(path.read_text(encoding="utf-8"), config, model)
    names = model.space.tangent_names
    text.scale_noise(
        fit.states,
        fit.outputs,
        [name for name, variance in zip(names, np.diag(typical.process), strict=True) if variance],
    )
    job = TuneJob(
        config.title or path.stem,
        config,
        model,
        fit,
        _judged(before),
        _judged(after),
        tuple(text.changes),
        None if folder is None else Path(folder),
    )
    if job.folder is not None:
        text.move(path.parent, job.folder)
        with whole_folder(job.folder) as scratch:
            (scratch / "tuned.toml").write_text(text.text, encoding="utf-8")
            (scratch / "tune.json").write_text(json_text(_summary(job)), encoding="utf-8")
    return job


def noise_rows(job: TuneJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of noise: standard deviations before and after, how well known, and what to think."""
    units = dict(zip(job.model.space.tangent_names, job.model.space.tangent_units, strict=True))
    outputs = dict(zip(job.model.output.tangent_names, job.model.output.tangent_units, strict=True))
    rows: list[list[Any]] = []
    for each in job.fit.entries:
        own = units if each.entry.kind == "process" else outputs
        for name, start, fitted in zip(each.entry.names, each.start, each.fitted, strict=True):
            letter = "Q" if each.entry.kind == "process" else "R"
            rows.append(
                [f"{letter}  {name}", own[name], start, _told(each, start, fitted), _error(each, fitted), each.remark]
            )
    heads = ["noise (sigma)", "unit", "start", "fitted", "+-", "remark"]
    return (heads, rows) if any(row[-1] for row in rows) else (heads[:-1], [row[:-1] for row in rows])


def likelihood_rows(job: TuneJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of likelihoods and innovations, before and after."""
    fit, rows = job.fit, []
    rows.append([f"log likelihood per row, {fit.rows} fitted", fit.start, fit.fitted])
    if fit.held_rows:
        rows.append([f"log likelihood per row, {fit.held_rows} held out", fit.held_start, fit.held_fitted])
    advice = job.before[1], job.after[1]
    rows.append(["NIS per degree", *(each.nis.mean for each in advice)])
    for tests in zip(*(each.whiteness for each in advice), strict=True):
        rows.append([f"correlation of neighbours, {tests[0].signal}", *(_first(test) for test in tests)])
    return ["", "before", "after"], rows


def _told(each: FittedEntry, start: float, fitted: float) -> float | str:
    """A fitted deviation; where the record does not tell it, only what it is below, or that nothing is known."""
    if each.bound == "ceiling":
        return f"> {fitted:.3g}"
    if each.flat or each.bound == "floor":
        return f"< {each.limit * start:.3g}" if each.limit is not None else "?"
    return fitted


def _error(each: FittedEntry, fitted: float) -> float | None:
    known = each.standard_error
    return None if known is None or each.flat or each.bound else known * fitted


def _first(test: Any) -> float | None:
    return float(test.autocorrelation[0]) if test.autocorrelation.size else None


def _judged(result: Result) -> tuple[Verdict, NoiseAdvice]:
    return verdict(result), noise_advice(result)


def _chosen(
    model: AbstractModel, typical: TypicalNoise, only: Sequence[str], freeze: Sequence[str]
) -> tuple[list[tuple[str, ...]], list[tuple[str, ...]]]:
    """Names of states and of outputs to fit, in groups that share a factor.

    Raises:
        ConfigError: both given, or a name that is not the model's, or that is of a state and of an output.
    """
    if only and freeze:
        raise ConfigError("only, freeze: expected one of them, got both")
    groups: dict[Kind, list[tuple[str, ...]]] = {"process": [], "measurement": []}
    if only:
        for given in only:
            kinds, names = zip(*(_named(model, each.strip()) for each in given.split(",")), strict=True)
            if len(set(kinds)) > 1:
                raise ConfigError(f"only: expected names of states or of outputs, got both in {given!r}")
            groups[kinds[0]].append(names)
        return groups["process"], groups["measurement"]
    left = {_named(model, each) for each in freeze}
    for entry in noise_entries(model, typical, None, None):
        names = tuple(name for name in entry.names if (entry.kind, name) not in left)
        if names:
            groups[entry.kind].append(names)
    return groups["process"], groups["measurement"]


def _named(model: AbstractModel, given: str) -> tuple[Kind, str]:
    """Whether a name is of a state or of an output; "Q." or "R." before it says so."""
    own: dict[Kind, tuple[str, ...]] = {
        "process": model.space.tangent_names,
        "measurement": model.output.tangent_names,
    }
    head, _, tail = given.partition(".")
    if head in LETTERS and tail in own[LETTERS[head]]:
        return LETTERS[head], tail
    kinds: list[Kind] = [kind for kind, names in own.items() if given in names]
    if len(kinds) > 1:
        raise ConfigError(f"{given!r} is a state and an output; write Q.{given} or R.{given}")
    if not kinds:
        known = [*own["process"], *own["measurement"]]
        raise ConfigError(f"{given!r} is no state or output of the model; {did_you_mean(given, known)}")
    return kinds[0], given


def _summary(job: TuneJob) -> dict[str, Any]:
    fit = job.fit
    return {
        "title": job.title,
        "gainful_version": __version__,
        "method": fit.method,
        "entries": [
            {
                "kind": each.entry.kind,
                "names": each.entry.names,
                "start": each.start,
                "fitted": each.fitted,
                "factor": each.factor,
                "relative_standard_error": each.standard_error,
                "largest_factor": each.limit,
                "bound": each.bound,
                "remark": each.remark,
            }
            for each in fit.entries
        ],
        "step": fit.step,
        "contamination": fit.contamination,
        "log_likelihood_per_row": {
            "fitted": {"rows": fit.rows, "before": fit.start, "after": fit.fitted},
            "held_out": {"rows": fit.held_rows, "before": fit.held_start, "after": fit.held_fitted},
        },
        "iterations": fit.iterations,
        "converged": fit.converged,
        "verdict": {"before": str(job.before[0]), "after": str(job.after[0])},
        "advice": {"before": job.before[1].sentences, "after": job.after[1].sentences},
        "warnings": fit.warnings,
        "changes": job.changes,
    }
