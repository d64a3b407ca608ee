"""From records and a configuration to trained parts, and a configuration that uses them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..aiding import AidingReport, SensorMapReport, Smoother, learn_sensor_map, train_aiding, with_sensor_maps
from ..config import EstimateConfig, build_filter, build_model, build_parameters, build_prior, load_config
from ..config.parts import single_filter
from ..config.rewriting import Rewriting
from ..config.schema import TrainingSection
from ..config.training import build_features, build_pieces, build_smoother, build_training
from ..errors import ConfigError
from ..filters import KalmanFilter
from ..io import check_folder, save_part, whole_folder
from ..models import AbstractModel
from ..running import Log, Result, run, smooth
from ..updates import Corrected
from ..version import __version__
from .json_text import json_text

AIDING, CONFIG, SUMMARY = "aiding.part", "aided.toml", "training.json"
"""Files that training leaves in its folder, beside one `map_….part` per sensor."""


@dataclasses.dataclass(frozen=True)
class TrainAidingJob:
    """What training came to.

    Attributes:
        title: of the configuration.
        config: what was asked.
        aiding: the network beside the filter, if one was trained.
        maps: the maps of sensors, by signal.
        folder: where the trained parts and `aided.toml` lie, or None if nothing was written.
    """

    title: str
    config: EstimateConfig
    aiding: AidingReport | None
    maps: dict[str, SensorMapReport]
    folder: Path | None

    @property
    def files(self) -> tuple[str, ...]:
        """What lies in the folder."""
        aiding = (AIDING,) if self.aiding is not None and self.aiding.components else ()
        return (CONFIG, *aiding, *map(_map_file, self.maps), SUMMARY)


def train(
    path: Path | str, folder: Path | str | None = None, *, progress: Callable[[str], None] | None = None
) -> TrainAidingJob:
    """Train what the `[training]` section of a configuration of `gainful estimate` asks for.

    Maps of sensors are learned first; the network beside the filter is trained on a filter that uses them. A network that does
    not lessen any error on the records held out is not written.

    Args:
        path: of the TOML file; files it names are relative to it.
        folder: where to leave `aided.toml`, the configuration that uses what was trained, with the trained parts and
            `training.json`, all or none; nothing if None.
        progress: told what is being done.

    Raises:
        ConfigError: the configuration is not valid.
        GainfulError: the data, the model or the training failed; the message says how.
    """
    path = Path(path)
    config = load_config(path)
    section = config.training
    if section is None:
        raise ConfigError("training: missing; what is to be learned, and from which records?")
    if config.faults is not None:
        raise ConfigError("training: expected a configuration without [faults], got one with them")
    if not section.aiding and not section.maps:
        raise ConfigError("training: expected something to learn, got aiding = false and no maps")
    if folder is not None:
        check_folder(Path(folder))
    model = build_parameters(config, build_model(config.model, path.parent))
    estimator = single_filter(build_filter(config, model, path.parent), "filter", " to train with")
    prior = build_prior(config, model)
    logs, priors = build_pieces(config, section, estimator, model, prior, path.parent)
    smoother = build_smoother(section, path.parent)
    say = progress or (lambda words: None)
    map_key, aiding_key = jax.random.split(jax.random.key(section.seed))
    parts: dict[str, Any] = {}
    found: dict[str, SensorMapReport] = {}
    if section.maps:
        say("learning maps of sensors")
        states = _states(section, smoother or Smoother(estimator, model), logs, priors)
        for name, key in zip(section.maps, jax.random.split(map_key, len(section.maps)), strict=True):
            asked = section.maps[name]
            recipe = None if asked.network is None else build_training(asked.network, f"training.maps.{name}.network")
            parts[_map_file(name)], found[name] = learn_sensor_map(
                model,
                logs,
                states,
                name,
                asked.context,
                key=key,
                training=recipe,
                floor=asked.floor,
                held_out=section.held_out,
            )
    report = None
    if section.aiding:
        say("training the network")
        mapped = with_sensor_maps(model, list(parts.values())) if parts else model
        update, report = _aiding(section, estimator, mapped, priors, logs, smoother, aiding_key)
        if report.components:
            parts[AIDING] = update
    job = TrainAidingJob(config.title or path.stem, config, report, found, None if folder is None else Path(folder))
    if job.folder is not None:
        _write(job, path, model, parts, job.folder)
    return job


def map_rows(job: TrainAidingJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of sensors: their error before and after, on pieces held out and in sample."""
    heads = ["sensor", "depends on", "error RMS", "with its map", "in sample", "unknown, %"]
    rows = [
        [name, ", ".join(job.config.training.maps[name].context), each.before, each.after, each.in_sample, each.unknown]  # type: ignore[union-attr]
        for name, each in job.maps.items()
    ]
    return heads, rows


def aiding_rows(job: TrainAidingJob) -> tuple[list[str], list[list[Any]]]:
    """Headings and rows of the table of the network: errors without and with it on the pieces held out."""
    report = job.aiding
    heads = ["state", "RMSE without", "RMSE with", "squared error less by, 95 %", "in sample", "corrected"]
    if report is None:
        return heads, []
    rows: list[list[Any]] = []
    for k, name in enumerate(report.states):
        gain = f"{report.low[k]:.3g} to {report.high[k]:.3g}"
        both = [float(np.sqrt(each[k])) for each in (report.base, report.aided, report.aided_in_sample)]
        rows.append([name, *both[:2], gain, both[2], "yes" if report.accepted[k] else "no"])
    return heads, rows


def _states(
    section: TrainingSection, smoother: Smoother, logs: Sequence[Log], priors: Sequence[Any]
) -> list[Result | np.ndarray]:
    """What the states should have been, of each piece."""
    if section.teacher == "smoother":
        return [
            smooth(run(smoother.estimator, smoother.model, prior, log)) for log, prior in zip(logs, priors, strict=True)
        ]
    names = smoother.model.space.names
    return [np.stack([log.truth.get(name, np.full(len(log), np.nan)) for name in names], axis=1) for log in logs]


def _aiding(
    section: TrainingSection,
    estimator: KalmanFilter,
    model: AbstractModel,
    priors: Sequence[Any],
    logs: Sequence[Log],
    smoother: Smoother | None,
    key: jax.Array,
) -> tuple[Corrected, AidingReport]:
    return train_aiding(
        estimator,
        model,
        priors,
        logs,
        held_out=section.held_out,
        key=key,
        training=build_training(section.network, "training.network"),
        features=build_features(section),
        teacher=section.teacher,
        smoother=smoother,
        feedback=section.feedback,
    )


def _map_file(signal: str) -> str:
    return f"map_{signal}.part"


def _write(job: TrainAidingJob, path: Path, model: AbstractModel, parts: dict[str, Any], folder: Path) -> None:
    text = Rewriting(path.read_text(encoding="utf-8"), job.config, model)
    text.use_trained(AIDING if AIDING in parts else "", [name for name in parts if name != AIDING])
    text.move(path.parent, folder)
    with whole_folder(folder) as scratch:
        for name, part in parts.items():
            save_part(scratch / name, part, model=model)
        (scratch / CONFIG).write_text(text.text, encoding="utf-8")
        (scratch / SUMMARY).write_text(json_text(_summary(job)), encoding="utf-8")


def _summary(job: TrainAidingJob) -> dict[str, Any]:
    out: dict[str, Any] = {"title": job.title, "gainful_version": __version__, "maps": {}, "aiding": None}
    for name, each in job.maps.items():
        out["maps"][name] = {
            "before": each.before,
            "after": each.after,
            "in_sample": each.in_sample,
            "unknown": each.unknown,
            "warnings": each.warnings,
        }
    report = job.aiding
    if report is not None:
        out["aiding"] = {
            "corrected": report.components,
            "states": {
                name: {
                    "mean_square_without": report.base[k],
                    "mean_square_with": report.aided[k],
                    "gain": {"low": report.low[k], "high": report.high[k]},
                    "in_sample": {"without": report.base_in_sample[k], "with": report.aided_in_sample[k]},
                    "accepted": bool(report.accepted[k]),
                }
                for k, name in enumerate(report.states)
            },
            "passed": report.passed,
            "unknown": report.flagged,
            "nees": {"of_filter": report.nees_of_filter, "validated": report.nees},
            "warnings": report.warnings,
        }
    return out
