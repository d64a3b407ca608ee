"""What `gainful train-aiding` learns: networks, what they are told, who teaches, and the records."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..aiding import Smoother
from ..errors import ConfigError
from ..estimates import AbstractEstimate, Gaussian
from ..filters import KalmanFilter
from ..io import read_log
from ..models import AbstractModel
from ..networks import AbstractTraining
from ..running import Log, run
from ..updates import AbstractFeatures, JoinedFeatures
from .build import build_filter, build_model, build_parameters
from .load import load_config
from .parts import make_part, single_filter
from .schema import EstimateConfig, TrainingSection


def build_training(table: str | dict[str, Any], path: str) -> AbstractTraining:
    """How a network is made.

    Raises:
        ConfigError: an unknown kind or key, or a value of the wrong kind.
    """
    return make_part(AbstractTraining, table, path)


def build_features(section: TrainingSection) -> AbstractFeatures:
    """What the network beside the filter is told: one kind, or several side by side.

    Raises:
        ConfigError: an unknown kind or key, or a value of the wrong kind.
    """
    if not isinstance(section.features, list):
        return make_part(AbstractFeatures, section.features, "training.features")
    parts = [make_part(AbstractFeatures, each, f"training.features[{i}]") for i, each in enumerate(section.features)]
    if not parts:
        raise ConfigError("training.features: expected at least one, got none")
    return JoinedFeatures(tuple(parts))


def build_smoother(section: TrainingSection, base: Path) -> Smoother | None:
    """The filter whose smoothed estimates teach, where another configuration gives it.

    Raises:
        ConfigError: no such configuration, or one whose filter is not a single one.
    """
    if not section.smoother:
        return None
    if section.teacher != "smoother":
        raise ConfigError(f'training.smoother: has no effect with teacher = "{section.teacher}"')
    path = base / section.smoother
    config = load_config(path)
    model = build_parameters(config, build_model(config.model, path.parent))
    return Smoother(single_filter(build_filter(config, model, path.parent), "training.smoother"), model)


def build_pieces(
    config: EstimateConfig,
    section: TrainingSection,
    estimator: KalmanFilter,
    model: AbstractModel,
    prior: AbstractEstimate,
    base: Path,
) -> tuple[list[Log], list[AbstractEstimate]]:
    """The records in pieces, and the estimate before each: that of the filter run up to there.

    Raises:
        ConfigError: fewer than one piece, or as many as there are rows.
        DataError: a record that cannot be used.
    """
    if section.pieces < 1:
        raise ConfigError(f"training.pieces: expected a whole number of at least 1, got {section.pieces}")
    sources = [dataclasses.replace(config.data, file=file) for file in section.files] or [config.data]
    logs: list[Log] = []
    priors: list[AbstractEstimate] = []
    for source in sources:
        log = read_log(model, source, base)
        if section.pieces >= len(log):
            raise ConfigError(
                f"training.pieces: expected fewer than the {len(log)} rows of the record, got {section.pieces}"
            )
        ends = [round(k * len(log) / section.pieces) for k in range(section.pieces + 1)]
        logs += [rows_of(log, slice(*both)) for both in itertools.pairwise(ends)]
        priors += _before(ends[1:-1], estimator, model, prior, log)
    if not 2 <= section.held_out < len(logs):
        raise ConfigError(
            f"training.held_out: expected from 2 to {len(logs) - 1} of the {len(logs)} pieces, got {section.held_out}; "
            "cut the record into more pieces, or give more files"
        )
    return logs, priors


def _before(
    starts: Sequence[int], estimator: KalmanFilter, model: AbstractModel, prior: AbstractEstimate, log: Log
) -> list[AbstractEstimate]:
    """The estimate before the first piece, and those that the filter has at the starts of the others."""
    if not len(starts):
        return [prior]
    result = run(estimator, model, prior, log)
    return [prior, *(Gaussian.start(result.mean[k - 1], result.cov[k - 1], model.space) for k in starts)]


def rows_of(log: Log, rows: slice) -> Log:
    """A stretch of a record."""
    inserted = None if log.inserted is None else log.inserted[rows]
    truth = {name: values[rows] for name, values in log.truth.items()}
    return dataclasses.replace(
        log,
        t=log.t[rows],
        dt=log.dt[rows],
        u=log.u[rows],
        y=log.y[rows],
        seen=log.seen[rows],
        truth=truth,
        inserted=inserted,
        counts={},
        missing={},
    )
