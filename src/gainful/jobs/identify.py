"""From a log and an equation to parameters with their intervals, held against rows that were kept back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..config import IdentifyConfig, build_equation, build_recordings, load_identify_config
from ..errors import GainfulError, Status
from ..identification import Assessment, Identification, Recording, identify
from ..identification.methods import split
from ..io import check_folder, parameter_units, whole_folder
from ..report import Judgement, Table, write_identification_report
from ..studies import Measured
from ..version import __version__
from .identify_network import NetworkJob, identify_network_log
from .json_text import json_text
from .tellings import FAILS, FILES, HOLDS, percent, rows_table, run_facts, told, where_judged

_APART = 3.0
"""Standard deviations from which parameters of two records are said to differ."""
_FEW = 4
"""Parameters up to which a table has a column for each."""


@dataclasses.dataclass(frozen=True)
class IdentifyJob:
    """What an identification came to.

    Attributes:
        title: of the report.
        config: what was asked.
        found: the parameters and what is known of them.
        units: of the parameters; empty where unknown.
        kept_back: rows that were not used to find them, if any.
        again: the parameters from the rows kept back alone, where these suffice.
        checks: the equation held against the rows kept back, or else against the recording itself, by method.
        folder: where the results lie, or None if nothing was written.
    """

    title: str
    config: IdentifyConfig
    found: Identification
    units: dict[str, str]
    kept_back: Recording | None
    again: Identification | None
    checks: dict[str, Assessment]
    folder: Path | None

    @property
    def check(self) -> Assessment:
        """That of the method chosen."""
        return self.checks[self.found.method]

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader of the parameters should know."""
        return (*self.found.cautions, *self._changed())

    @property
    def told_share(self) -> float:
        """Share of variance that the equation tells: of the signal run by itself, or else of the regressand."""
        share = self.check.simulated_share
        return self.check.explained_share if math.isnan(share) else share

    @property
    def judgement(self) -> Judgement:
        """What it all comes to: "good", "unknown" or "bad"."""
        if self.found.status != Status.ok or not self.told_share >= FAILS:
            return "bad"
        return "good" if not self.cautions and self.kept_back is not None and self.told_share >= HOLDS else "unknown"

    @property
    def verdict(self) -> str:
        """The same in one sentence."""
        if self.found.status != Status.ok:
            return f"{self.found.method} gives no estimate: {self.found.status.sentence}"
        n, check = len(self.found.parameters), self.check
        where = where_judged(self.kept_back)
        words = f"{n} {'parameter' if n == 1 else 'parameters'} by {self.found.method}; {where} the terms explain "
        words += f"{percent(check.explained_share)} of the variance of {self.found.problem.equation.regressand.text}"
        if check.signal:
            words += (
                f", and the equation run by itself tells {percent(check.simulated_share)} of that of {check.signal}"
            )
        return words

    def _changed(self) -> list[str]:
        if self.again is None:
            return []
        spread = np.hypot(self.found.std, self.again.std)
        off = np.abs(self.found.theta - self.again.theta) / np.where(spread > 0, spread, np.inf)
        names = [name for name, size in zip(self.found.parameters, off, strict=True) if size > _APART]
        if not names:
            return []
        return [
            f"{', '.join(names)}: the rows kept back alone differ by up to {np.nanmax(off):.1f} standard deviations: "
            "parameters change, or the equation lacks something"
        ]


def identify_log(
    path: Path | str, folder: Path | str | None = None, *, started: Callable[[Recording], None] | None = None
) -> IdentifyJob | NetworkJob:
    """Run the identification of a configuration file.

    Args:
        path: of the TOML file; files it names are relative to it.
        folder: where to leave `report.html`, `identification.json` (all numbers) and `rows.parquet` (what was measured and
            explained, row by row), all or none; nothing if None.
        started: called with the recording before anything is computed.

    Raises:
        ConfigError: the configuration is not valid.
        GainfulError: the data or the method failed; the message says how.
    """
    path = Path(path)
    config = load_identify_config(path)
    if config.network is not None:
        return identify_network_log(config, path, folder, started=started)
    equation = build_equation(config, path.parent)
    units = parameter_units(equation, config.signals)
    if config.method is not None:
        split(config.method)
    recording, kept_back = build_recordings(config, equation.signals, path.parent)
    if folder is not None:
        check_folder(Path(folder))
    if started is not None:
        started(recording)
    options = dataclasses.asdict(config.options)
    found = identify(equation, recording, config.method, **options)
    judged = recording if kept_back is None else kept_back
    checks = {found.method: found.check(judged)}
    if found.status == Status.ok:
        checks |= {
            name: dataclasses.replace(found, method=name).check(judged, np.asarray(fit.theta))
            for name, fit in found.rivals.items()
            if fit.status == Status.ok
        }
    again = None if kept_back is None else _again(found, kept_back, options)
    title = config.title or path.stem
    job = IdentifyJob(title, config, found, units, kept_back, again, checks, None if folder is None else Path(folder))
    if job.folder is not None:
        _write(job, path, job.folder)
    return job


def parameter_table(job: IdentifyJob) -> Table:
    """The parameters with their intervals, and what the rows kept back give alone."""
    found, again = job.found, job.again
    heads = ["parameter", "unit", f"value, {100 * found.level:.4g} %"]
    columns = [_intervals(found.theta, found.std, found.reach)]
    if again is not None:
        heads.append("rows kept back alone")
        columns.append(_intervals(again.theta, again.std, again.reach))
    rows = zip(found.parameters, (job.units[name] or None for name in found.parameters), *columns, strict=True)
    return Table("Parameters", tuple(heads), tuple(rows))


def _intervals(theta: Any, std: Any, reach: float) -> list[Measured]:
    half = reach * np.asarray(std)
    ends = zip(theta, theta - half, theta + half, strict=True)
    return [Measured(float(value), float(low), float(high), 1) for value, low, high in ends]


def method_table(job: IdentifyJob, *, narrow: bool = False) -> Table:
    """How far the parameters of all methods that apply differ, and how well each tells what was kept back.

    Args:
        job: the identification.
        narrow: in place of all parameters tell only the one that is furthest off, as is done where there are many.
    """
    found = job.found
    few = len(found.parameters) <= _FEW and not narrow
    where = "itself" if job.kept_back is None else "kept back"
    heads = ["method", *(found.parameters if few else ["furthest off", "in sigmas"]), f"explained, {where} %"]
    if job.check.signal:
        heads.append(f"{job.check.signal} run by itself, {where} %")
    estimates = {found.method: (found.theta, found.std)}
    estimates |= {name: (np.asarray(fit.theta), np.asarray(fit.std)) for name, fit in found.rivals.items()}
    rows = []
    for name, (theta, std) in estimates.items():
        own = name == found.method
        cells = _intervals(theta, std, found.reach) if few else [None, None] if own else _furthest(found, theta)
        check = job.checks.get(name)
        shares = [None, None] if check is None else [check.explained_share, check.simulated_share]
        rows.append((f"{name} (chosen)" if own else name, *cells, *shares[: len(heads) - 1 - len(cells)]))
    return Table("Methods side by side", tuple(heads), tuple(rows))


def _furthest(found: Identification, theta: Any) -> list[Any]:
    """The parameter that another method sees most differently, and by how many standard deviations."""
    off = (theta - found.theta) / np.where(found.std > 0, found.std, np.nan)
    if np.isnan(off).all():
        return [None, None]
    worst = int(np.nanargmax(np.abs(off)))
    return [found.parameters[worst], float(off[worst])]


def _again(found: Identification, kept_back: Recording, options: dict[str, Any]) -> Identification | None:
    """The parameters from the rows kept back alone, if they give any."""
    try:
        again = identify(found.problem.equation, kept_back, found.method, **options)
    except GainfulError:
        return None
    return again if again.status == Status.ok else None


def _write(job: IdentifyJob, path: Path, folder: Path) -> None:
    summary = _summary(job) | {"config": path.read_text(encoding="utf-8")}
    with whole_folder(folder) as scratch:
        (scratch / FILES[1]).write_text(json_text(summary), encoding="utf-8")
        rows_table(
            job.found.assessment, None if job.kept_back is None else job.check, job.title, job.found.method
        ).to_parquet(scratch / FILES[2])
        write_identification_report(
            job.found,
            scratch / FILES[0],
            title=job.title,
            facts=_facts(job, path),
            verdict=job.verdict,
            judgement=job.judgement,
            cautions=job.cautions,
            tables=(parameter_table(job), method_table(job)),
            checks=job.checks,
        )


def _facts(job: IdentifyJob, path: Path) -> list[tuple[str, str]]:
    recording = job.found.problem.recording
    own = [("Sensors", str(recording.sensors))]
    return run_facts(path, job.found.identifiability.rows, recording, job.kept_back, own)


def _summary(job: IdentifyJob) -> dict[str, Any]:
    found = job.found
    low, high = found.interval
    known = found.identifiability
    return {
        "title": job.title,
        "gainful_version": __version__,
        "equation": {
            "of": found.problem.equation.regressand.text,
            "terms": {name: term.text for name, term in found.problem.equation.terms.items()},
            "where": None if found.problem.equation.where is None else found.problem.equation.where.text + " > 0",
        },
        "method": found.method,
        "status": found.status.name,
        "verdict": job.verdict,
        "judgement": job.judgement,
        "cautions": job.cautions,
        "assumptions": found.assumptions,
        "parameters": {
            name: {
                "value": found.theta[j],
                "std": found.std[j],
                "low": low[j],
                "high": high[j],
                "unit": job.units[name],
                "kept_back": None if job.again is None else {"value": job.again.theta[j], "std": job.again.std[j]},
            }
            for j, name in enumerate(found.parameters)
        },
        "level": found.level,
        "covariance": found.cov,
        "noise": found.problem.noise,
        "identifiability": {
            "rows": known.rows,
            "condition": known.condition,
            "gap": known.gap,
            "noise_gap": known.noise_gap,
            "noise_ratio": known.noise_ratio,
            "correlations": known.correlations,
        },
        "methods": {
            name: {
                "theta": np.asarray(fit.theta),
                "std": np.asarray(fit.std),
                "status": Status(int(fit.status)).name,
            }
            for name, fit in found.rivals.items()
        },
        "checks": {name: told(check) for name, check in job.checks.items()},
    }
