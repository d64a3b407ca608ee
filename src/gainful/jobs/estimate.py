"""From a log and a model to estimates, a verdict and a report."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..aiding import unaided_filter, unmapped
from ..config import (
    EstimateConfig,
    build_faults,
    build_filter,
    build_injections,
    build_model,
    build_parameters,
    build_prior,
    dump_part,
    load_config,
)
from ..diagnostics import Verdict, aiding_use, coverage, rmse, verdict
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..io import check_folder, read_log, whole_folder
from ..models import AbstractModel
from ..report import Table, write_report
from ..report.trajectory import position_pairs
from ..running import Log, Result, run, smooth
from ..spaces import AbstractSpace, Quaternion
from ..version import __version__
from .aiding import aiding_gain_rows
from .faults import FaultFindings, fault_rows_of, find_faults
from .parameters import parameter_rows
from .provenance import made_with

ARCSECONDS = 180.0 / math.pi * 3600.0
"""Per radian."""


@dataclasses.dataclass(frozen=True)
class EstimateJob:
    """What a job came to.

    Attributes:
        title: of the report.
        config: what was asked.
        result: the filter's, or the smoother's where the configuration asks for it.
        verdict: whether its numbers can be believed.
        folder: where the results lie, or None if nothing was written.
        faults: what was found of the faults, if any were looked for.
        unaided: the filter's result without trained networks and maps of sensors, if it has any.
    """

    title: str
    config: EstimateConfig
    result: Result
    verdict: Verdict
    folder: Path | None
    faults: FaultFindings | None = None
    unaided: Result | None = None

    @property
    def timing(self) -> tuple[float, float]:
        """Seconds spent compiling and running, filter and smoother together."""
        parts = [self.result, self.result.filtered]
        times = [part.timing for part in parts if part is not None]
        return sum(t.compile for t in times), sum(t.run for t in times)


def estimate(
    path: Path | str,
    folder: Path | str | None = None,
    *,
    started: Callable[[Log], None] | None = None,
    progress: Callable[[int], None] | None = None,
) -> EstimateJob:
    """Run the job of a configuration file.

    Args:
        path: of the TOML file; files it names are relative to it.
        folder: where to leave `estimates.parquet`, `result.nc` and `report.html`, all or none; nothing if None.
        started: called with the record before the filter runs.
        progress: called with the number of rows done.

    Raises:
        ConfigError: the configuration is not valid.
        GainfulError: the data, the model or the filter failed; the message says how.
    """
    path = Path(path)
    config = load_config(path)
    model = build_faults(config, build_parameters(config, build_model(config.model, path.parent)))
    prior = build_prior(config, model)
    chosen = build_filter(config, model, path.parent)
    log = build_injections(config, read_log(model, config.data, path.parent), model)
    if folder is not None:
        check_folder(Path(folder))
    if started is not None:
        started(log)
    result = run(chosen, model, prior, log, throw=config.options.throw, progress=progress)
    without = _unaided(config, chosen, model, prior, log)
    if config.options.smooth or config.options.lag is not None:
        result = smooth(result, lag=config.options.lag)
    found = find_faults(config, result) if config.faults is not None else None
    title, place = config.title or path.stem, None if folder is None else Path(folder)
    job = EstimateJob(title, config, result, verdict(result), place, found, without)
    if job.folder is not None:
        _write(job, path)
    return job


def _unaided(
    config: EstimateConfig, chosen: AbstractEstimator, model: AbstractModel, prior: AbstractEstimate, log: Log
) -> Result | None:
    """The same record without what was trained, where anything was."""
    if not config.options.aiding and not config.model.sensor_maps:
        return None
    return run(unaided_filter(chosen), unmapped(model), prior, log, throw=False)


def state_rows(job: EstimateJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of states: last value and sigma, and RMSE and coverage where there is truth."""
    result = job.result
    space, filtered = result.model.space, result.filtered
    errors, shares = rmse(result), coverage(result)
    before = rmse(filtered) if filtered is not None else {}
    heads = ["state", "unit", "last sigma"]
    if errors:
        heads += (["RMSE filtered", "RMSE smoothed"] if before else ["RMSE"]) + ["inside 95 % band"]
    scales = _display(space)
    rows: list[list[Any]] = []
    for j, name in enumerate(space.tangent_names):
        unit, scale = scales[j]
        row: list[Any] = [name, unit, float(result.std[-1, j]) * scale]
        if errors:
            row += [_scaled(before.get(name), scale)] if before else []
            row += [_scaled(errors.get(name), scale), shares.get(name)]
        rows.append(row)
    for first, second in position_pairs(space) if errors else ():
        both = [[_length(table, first, second)] for table in (before, errors) if table]
        if all(value is not None for (value,) in both):
            rows.append([f"distance ({first}, {second})", "m", None, *(value for (value,) in both), None])
    return heads, rows


def _display(space: AbstractSpace) -> list[tuple[str, float]]:
    """Unit and scale in which each degree of freedom is shown: attitudes in arcseconds, the rest as they are."""
    out = []
    for part in space.parts:
        if isinstance(part, Quaternion):
            out += [("arcsec", ARCSECONDS)] * part.dof
        else:
            out += [(unit, 1.0) for unit in part.tangent_units]
    return out


def _scaled(value: float | None, scale: float) -> float | None:
    return None if value is None else value * scale


def _length(table: dict[str, float], first: str, second: str) -> float | None:
    """Root mean square distance, where both coordinates have a truth."""
    return math.hypot(table[first], table[second]) if first in table and second in table else None


def _facts(job: EstimateJob, path: Path) -> list[tuple[str, str]]:
    result, (compiling, running) = job.result, job.timing
    kind = job.config.filter if isinstance(job.config.filter, str) else job.config.filter["kind"]
    facts = [
        ("Configuration", path.name),
        ("Filter", kind + (", smoothed" if result.smoothed else "") + _lag(result)),
        ("Rows", f"{int(result.log.kept.sum())} from {result.t[0]:.6g} s to {result.t[-1]:.6g} s"),
        ("Time", f"{compiling:.2f} s compiling, {running:.3f} s running"),
        made_with(),
    ]
    if job.faults is not None:
        facts += [("Isolability", job.faults.isolability), ("Alarm above", job.faults.limit)]
    facts += [
        (
            "Aiding",
            f"let through in {100 * each.passed:.1f} % of measured rows, unknown to the network in {100 * each.unknown:.1f} %",
        )
        for each in aiding_use(result)
    ]
    facts += [(name[0].upper() + name[1:], str(count)) for name, count in result.log.counts.items()]
    return facts


def _lag(result: Result) -> str:
    return "" if result.lag is None else f" with a lag of {result.lag:g} s"


def _write(job: EstimateJob, path: Path) -> None:
    assert job.folder is not None
    result = job.result
    heads, rows = state_rows(job)
    tables = [Table("States", tuple(heads), tuple(tuple(row) for row in rows))]
    heads, rows = parameter_rows(result)
    if rows:
        tables.append(Table("Parameters", tuple(heads), tuple(tuple(row) for row in rows)))
    heads, rows = aiding_gain_rows(job)
    if rows:
        tables.append(Table("Aiding", tuple(heads), tuple(tuple(row) for row in rows)))
    if job.faults is not None:
        fault_heads, fault_rows = fault_rows_of(job.faults)
        tables.append(Table("Faults", tuple(fault_heads), tuple(tuple(row) for row in fault_rows)))
    attributes = {
        "title": job.title,
        "gainful_version": __version__,
        "config": path.read_text(encoding="utf-8"),
        "filter": json.dumps(dump_part(unaided_filter(result.estimator))),
        "verdict": str(job.verdict),
    }
    judgement = {True: "good", False: "bad", None: "unknown"}[job.verdict.consistent]
    table = result.to_pandas()
    table.attrs = attributes | {"units": _units(job)}
    # Through memory: HDF5 leaves the process unsound when it runs out of disk in the middle of a file.
    bundle = result.to_xarray(attributes).to_netcdf(engine="h5netcdf")
    with whole_folder(job.folder) as scratch:
        table.to_parquet(scratch / "estimates.parquet")
        (scratch / "result.nc").write_bytes(bundle)
        write_report(
            result,
            scratch / "report.html",
            title=job.title,
            facts=_facts(job, path),
            verdict=str(job.verdict),
            judgement=judgement,  # type: ignore[arg-type]  # one of the three words
            tables=tables,
            alarms=None if job.faults is None else {each.name: each.times for each in job.faults.faults},
        )


def _units(job: EstimateJob) -> dict[str, str]:
    """Units of the columns of the table of estimates."""
    space = job.result.model.space
    own = dict(zip(space.names, space.units, strict=True))
    sigmas = {f"std_{name}": unit for name, unit in zip(space.tangent_names, space.tangent_units, strict=True)}
    return {"t": "s"} | own | sigmas | {f"true_{name}": own[name] for name in job.result.log.truth}
