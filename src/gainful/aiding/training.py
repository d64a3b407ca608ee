"""Training a network beside a filter, and asking whether it is worth having."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, DataError
from ..estimates import AbstractEstimate
from ..filters import KalmanFilter
from ..models import AbstractModel
from ..networks import AbstractNetwork, AbstractTraining, CMACTraining, TrainingReport
from ..running import Log, Result
from ..updates import AbstractFeatures, Corrected, OnlineGate, UpdateFeatures
from .gates import mean_squares, validation_gate
from .judging import judged, steady_rows
from .playing import Played, Records, gathered, play, unaided
from .report import AidingReport
from .teachers import Smoother, references


def train_aiding(
    estimator: KalmanFilter,
    model: AbstractModel,
    prior: AbstractEstimate | Sequence[AbstractEstimate],
    logs: Sequence[Log],
    *,
    held_out: int,
    key: Array,
    training: AbstractTraining | None = None,
    features: AbstractFeatures | None = None,
    teacher: Literal["truth", "reference", "smoother"] = "truth",
    reference: Sequence[Result | Float[np.ndarray, "T size"]] | None = None,
    smoother: Smoother | None = None,
    feedback: bool = False,
    passes: int = 3,
    gate: OnlineGate | None = None,
    steady_from: int | None = None,
    regions: AbstractTraining | None = None,
    least_visits: float = 20.0,
) -> tuple[Corrected, AidingReport]:
    """A correction of a filter's estimates learned from records, its gates set by other records.

    Open loop, the network learns `reference - estimate` from what the filter's steps looked like. With `feedback` what it
    is told changes once it is in the loop, so it learns in passes: each runs the training records with the network of
    the pass before and trains anew on the last two passes. The pass that did best on the training records is kept.

    A component whose error the correction does not lessen on the held-out records, beyond chance, is left alone. There
    too the covariance of the corrected estimate is found; the filter's own would say nothing of it.

    Args:
        estimator: the filter.
        model: of the plant.
        prior: the estimate before the first row, one for all records or one for each.
        logs: the records, of any lengths.
        held_out: how many of them, the last ones, are for validation; at least 2.
        key: random key of the training.
        training: how the network is made; `CMACTraining()` by default.
        features: what it is told; `UpdateFeatures()` by default.
        teacher: "truth" of the logs, a "reference" for each record, or a "smoother" of the same records.
        reference: for "reference", the states of each record, or a result of a better instrument.
        smoother: for "smoother", the filter to smooth, its noise fitted; by default the aided one, which warns.
        feedback: whether the filter goes on from the corrected estimate.
        passes: further trainings after the first, with the network in the loop, with `feedback`.
        gate: the online gate; a new one by default.
        steady_from: first row that is scored; half of the longest record by default.
        regions: how to learn variances that depend on the features; one covariance for all by default.
        least_visits: visits in training without which the network is not believed; each epoch counts.

    Returns:
        The update, whose inner one is the filter's, and what the correction was worth.

    Raises:
        ConfigError: an argument out of its range.
        DataError: records without reference, or too few of them.
    """
    logs = list(logs)
    if not 2 <= held_out < len(logs):
        raise ConfigError(f"held_out: expected from 2 to {len(logs) - 1} of the {len(logs)} records, got {held_out!r}")
    if isinstance(passes, bool) or not isinstance(passes, int) or passes < 1:
        raise ConfigError(f"passes: expected a whole number of at least 1, got {passes!r}")
    priors = [prior] * len(logs) if isinstance(prior, AbstractEstimate) else list(prior)
    if len(priors) != len(logs):
        raise ConfigError(f"prior: expected one, or one per record, {len(logs)}, got {len(priors)}")
    training = CMACTraining() if training is None else training
    features = UpdateFeatures() if features is None else features
    gate = OnlineGate() if gate is None else gate
    pupil = Smoother(estimator, model)
    states, warnings = references(teacher, pupil, priors, logs, reference, smoother)
    records = gathered(model, priors, logs, states)
    lessons, others = records.chosen(slice(None, -held_out)), records.chosen(slice(-held_out, None))
    first = steady_from if steady_from is not None else records.real.shape[1] // 2
    plain = dataclasses.replace(unaided(estimator, features, model), least_visits=least_visits)
    taught, trainings = _taught(estimator, plain, lessons, training, feedback, passes, first, key)
    names = model.space.tangent_names
    update = dataclasses.replace(taught, feedback=feedback, gate=gate)
    alone = play(estimator, plain, others)
    tried = play(estimator, update, others)
    accepted = validation_gate(alone.errors, tried.errors, first)
    chosen = tuple(name for name, good in zip(names, accepted, strict=True) if good)
    update = dataclasses.replace(update, components=chosen)
    final = tried if len(chosen) == len(names) else play(estimator, update, others)
    update = _with_covariance(update, final, first, regions, key)
    report = judged(estimator, update, (lessons, others), (alone, final), accepted, first, trainings, warnings)
    return update, report


def _taught(
    estimator: KalmanFilter,
    plain: Corrected,
    lessons: Records,
    training: AbstractTraining,
    feedback: bool,
    passes: int,
    first: int,
    key: Array,
) -> tuple[Corrected, tuple[TrainingReport, ...]]:
    """The update with a trained network, and the report of every pass."""
    start = play(estimator, plain, lessons)
    collected, reports, best = [start.examples()], [], (np.inf, plain)
    for own in jax.random.split(key, 1 + passes if feedback else 1):
        # What the filter did before the network was in the loop is forgotten as soon as there is enough of what it does now.
        inputs, targets = (np.concatenate(parts) for parts in zip(*collected[-2:], strict=True))
        network, report = _trained(training, inputs, targets, own)
        reports.append(report)
        update = dataclasses.replace(plain, network=network, feedback=feedback)
        if not feedback:
            return update, tuple(reports)
        played = play(estimator, update, lessons)
        collected.append(played.examples())
        best = min(best, (_left(played, start, first), update), key=lambda each: each[0])
    return best[1], tuple(reports)


def _left(played: Played, start: Played, first: int) -> float:
    """What is left of the squared error without the network, over the components with a reference; infinite if not finite."""
    size = start.errors.shape[-1]
    after, before = (mean_squares(each.errors[:, first:].reshape(1, -1, size))[0] for each in (played, start))
    known = np.isfinite(before) & (before > 0)
    left = float(np.mean(after[known] / before[known]))
    return left if np.isfinite(left) else np.inf


def _trained(
    training: AbstractTraining, inputs: np.ndarray, targets: np.ndarray, key: Array
) -> tuple[AbstractNetwork, TrainingReport]:
    if not len(inputs):
        raise DataError("training: expected rows with both a measurement and a reference, got none")
    # A state that no reference tells of is asked for no correction, and gets none.
    known = np.isfinite(targets).all(axis=0)
    rows = np.isfinite(targets) | ~known
    whole = rows.all(axis=1)
    return training(inputs[whole], np.where(known, targets[whole], 0.0), key=key)


def _with_covariance(
    update: Corrected, played: Played, first: int, regions: AbstractTraining | None, key: Array
) -> Corrected:
    """The update with the covariance of its estimates, from the steady rows whose estimate it changed."""
    rows = steady_rows(played, first)
    errors = played.errors[rows]
    if not len(errors) or not update.components:
        return update
    covariance = errors.T @ errors / len(errors)
    if not np.isfinite(covariance).all():
        return update
    variances = None
    if regions is not None:
        variances, _ = regions(played.features[rows], errors**2, key=key)
    return dataclasses.replace(update, covariance=jnp.asarray(covariance), variances=variances)
