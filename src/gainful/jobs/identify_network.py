"""From a log to a network that predicts a signal, held against linear equations on rows that were kept back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..config import IdentifyConfig, build_network, build_recordings
from ..config.identify import check_names
from ..errors import ConfigError
from ..identification import Assessment, NetworkIdentification, Recording, identify_network
from ..io import check_folder, whole_folder
from ..report import Judgement, Table, write_network_report
from ..version import __version__
from .json_text import json_text
from .tellings import FAILS, FILES, HOLDS, percent, rows_table, run_facts, told, where_judged

_OUTSIDE = 0.01
"""Share of rows kept back with something the network was not trained on, from which that is said."""
_METHODS = {"ls": "linear, least squares", "tls": "linear, total least squares"}


@dataclasses.dataclass(frozen=True)
class NetworkJob:
    """What the identification of a network came to.

    Attributes:
        title: of the report.
        config: what was asked.
        found: the network and what is known of it.
        kept_back: rows that were not used to find it, if any.
        check: the network held against the rows kept back, or else against the recording itself.
        adapted: one row ahead on the same rows while learning goes on; None where weights do not change.
        linear: the linear equation of the same rows and lags, likewise, by method.
        folder: where the results lie, or None if nothing was written.
    """

    title: str
    config: IdentifyConfig
    found: NetworkIdentification
    kept_back: Recording | None
    check: Assessment
    adapted: Assessment | None
    linear: dict[str, Assessment]
    folder: Path | None

    @property
    def kind(self) -> str:
        """Of the network."""
        return self.found.recipe.kind

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a reader of the numbers should know."""
        cautions = list(self.found.cautions)
        judged = self.found.recording if self.kept_back is None else self.kept_back
        outside = self.found.outside(judged)
        if outside > _OUTSIDE:
            cautions.append(f"in {percent(outside)} of the rows the network is told what it was not trained on")
        line = self.linear.get("ls")
        if self.kind != "affine" and line is not None and not self._better(line):
            cautions.append(
                "the linear equation of the same rows does as well by least squares: nothing here asks for a network"
            )
        return tuple(cautions)

    def _better(self, line: Assessment) -> bool:
        """Whether the network errs less than the linear equation, in either way of being asked."""
        return self.check.residual < 0.95 * line.residual or self.check.simulation_error < 0.95 * line.simulation_error

    @property
    def judgement(self) -> Judgement:
        """What it all comes to: "good", "unknown" or "bad"."""
        share = self.check.simulated_share
        if not share >= FAILS:
            return "bad"
        return "good" if not self.cautions and self.kept_back is not None and share >= HOLDS else "unknown"

    @property
    def verdict(self) -> str:
        """The same in one sentence."""
        check, line = self.check, self.linear.get("ls")
        where = where_judged(self.kept_back)
        words = (
            f"{self.kind} of {self.found.weights} weights; {where} it explains {percent(check.explained_share)} of the "
        )
        words += f"variance of {check.signal} one row ahead and, run by itself, tells {percent(check.simulated_share)}"
        if line is not None:
            words += f"; the linear equation {percent(line.explained_share)} and {percent(line.simulated_share)}"
        return words


def identify_network_log(
    config: IdentifyConfig,
    path: Path,
    folder: Path | str | None = None,
    *,
    started: Callable[[Recording], None] | None = None,
) -> NetworkJob:
    """Run the identification of a configuration with a `[network]`; see `identify_log`.

    Args:
        config: the configuration.
        path: of its file; files it names are relative to it.
        folder: where to leave the results, or None.
        started: called with the recording before anything is computed.

    Raises:
        ConfigError: the configuration is not valid.
        GainfulError: the data or the training failed; the message says how.
    """
    if config.equation is not None or config.network is None:
        raise ConfigError("equation or network: expected one of the two sections, got both")
    if config.method is not None:
        raise ConfigError(f"method: expected none beside a network, whose kind says it, got {config.method!r}")
    check_names(config.signals)
    lags, recipe = build_network(config.network, config.signals)
    recording, kept_back = build_recordings(config, lags.signals, path.parent)
    if folder is not None:
        check_folder(Path(folder))
    if started is not None:
        started(recording)
    found = identify_network(lags, recording, recipe)
    judged = recording if kept_back is None else kept_back
    job = NetworkJob(
        config.title or path.stem,
        config,
        found,
        kept_back,
        found.check(judged),
        found.adapted(judged),
        found.linear_checks(judged),
        None if folder is None else Path(folder),
    )
    if job.folder is not None:
        _write(job, path, job.folder)
    return job


def model_table(job: NetworkJob) -> Table:
    """How well the network and the linear equations of the same rows tell what was kept back."""
    where = "itself" if job.kept_back is None else "kept back"
    heads = ("model", "weights", f"explained, {where} %", f"fit, {where} %", "run by itself %", "fit by itself %")
    count = len(job.found.equation.parameters)
    rows = [(f"{job.kind} (chosen)", job.found.weights, *_shares(job.check))]
    if job.adapted is not None:
        rows.append((f"{job.kind}, learning on", job.found.weights, *_shares(job.adapted)))
    rows += [(_METHODS[name], count, *_shares(check)) for name, check in job.linear.items()]
    return Table("Models side by side", heads, tuple(rows))


def _shares(check: Assessment) -> tuple[float, float, float, float]:
    return (check.explained_share, check.fit, check.simulated_share, check.simulated_fit)


def _write(job: NetworkJob, path: Path, folder: Path) -> None:
    summary = _summary(job) | {"config": path.read_text(encoding="utf-8")}
    with whole_folder(folder) as scratch:
        (scratch / FILES[1]).write_text(json_text(summary), encoding="utf-8")
        check = None if job.kept_back is None else job.check
        rows_table(job.found.assessment, check, job.title, job.kind).to_parquet(scratch / FILES[2])
        write_network_report(
            job.found,
            scratch / FILES[0],
            title=job.title,
            facts=_facts(job, path),
            verdict=job.verdict,
            judgement=job.judgement,
            cautions=job.cautions,
            tables=(model_table(job),),
            check=job.check,
        )


def _facts(job: NetworkJob, path: Path) -> list[tuple[str, str]]:
    found, condition = job.found, job.found.condition
    own = [
        ("Weights", f"{found.weights:,}"),
        ("Condition", "not known" if math.isnan(condition) else f"{condition:.1e}"),
    ]
    return run_facts(path, found.rows, found.recording, job.kept_back, own)


def _summary(job: NetworkJob) -> dict[str, Any]:
    found, lags = job.found, job.found.model.lags
    return {
        "title": job.title,
        "gainful_version": __version__,
        "network": {
            "of": lags.of,
            "kind": job.kind,
            "told": lags.names,
            "weights": found.weights,
            "condition": found.condition,
            "output_scale": float(found.model.output_scale),
        },
        "verdict": job.verdict,
        "judgement": job.judgement,
        "cautions": job.cautions,
        "rows": found.rows,
        "check": told(job.check),
        "adapted": None if job.adapted is None else told(job.adapted),
        "linear": {name: told(check) for name, check in job.linear.items()},
    }
