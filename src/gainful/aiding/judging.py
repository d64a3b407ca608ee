"""What a corrected filter is worth, on the records it learned from and on others."""

from __future__ import annotations

import dataclasses

import jax
import numpy as np
from jaxtyping import Bool

from ..filters import KalmanFilter
from ..networks import TrainingReport, zero_map
from ..running import run_many
from ..updates import Corrected
from .gates import mean_squares, run_squares
from .playing import Played, Records, play
from .report import AidingReport

FLAGGED = 0.05
"""Share of rows unknown to the network above which its training records were not like the others."""


def steady_rows(played: Played, first: int) -> Bool[np.ndarray, "M T"]:
    """Rows of the steady part whose estimate the network changed and a reference tells of."""
    rows = played.measured & played.aided & np.isfinite(played.errors).all(axis=-1)
    rows[:, :first] = False
    return rows


def judged(
    estimator: KalmanFilter,
    update: Corrected,
    records: tuple[Records, Records],
    played: tuple[Played, Played],
    accepted: Bool[np.ndarray, " n"],
    first: int,
    trainings: tuple[TrainingReport, ...],
    warnings: tuple[str, ...],
) -> AidingReport:
    """What an update is worth.

    Args:
        estimator: the filter.
        update: around the filter's own.
        records: for training, and held out.
        played: the held-out records without the network, and with it.
        accepted: by the offline gate.
        first: the first steady row.
        trainings: report of each pass.
        warnings: known so far.
    """
    lessons, others = records
    alone, final = played
    before, after = run_squares(alone.errors, final.errors, first)
    gain = before - after
    half = 1.96 * gain.std(axis=0, ddof=1) / np.sqrt(len(gain))
    plain = dataclasses.replace(update, network=zero_map(update.network.inputs, update.network.outputs))
    inside = [mean_squares(play(estimator, each, lessons).errors[:, first:]).mean(axis=0) for each in (plain, update)]
    measured = final.measured.sum()
    flagged = float(final.flagged.sum() / max(measured, 1))
    told = [*warnings, *trainings[-1].warnings]
    if flagged > FLAGGED:
        told.append(f"{100 * flagged:.3g} % of the held-out rows are unlike those the network was trained on")
    if not update.components:
        told.append("no component was better with the correction on held-out records: nothing is corrected")
    if update.components and update.covariance is None:
        told.append("no row has a reference of every state: the covariance of the corrected estimate is not known")
    by_filter, validated = _nees(estimator, others, final, first)
    return AidingReport(
        states=others.model.space.tangent_names,
        accepted=tuple(bool(good) for good in accepted),
        base=before.mean(axis=0),
        aided=after.mean(axis=0),
        low=gain.mean(axis=0) - half,
        high=gain.mean(axis=0) + half,
        base_in_sample=inside[0],
        aided_in_sample=inside[1],
        passed=float(final.passed.sum() / max(measured, 1)),
        flagged=flagged,
        nees_of_filter=by_filter,
        nees=validated,
        trainings=trainings,
        warnings=tuple(told),
    )


def _nees(estimator: KalmanFilter, records: Records, played: Played, first: int) -> tuple[float, float]:
    """Mean normalised square of the aided errors under the filter's covariance, and under that of the other half."""
    rows = steady_rows(played, first)
    if not rows.any():
        return np.nan, np.nan
    _, infos = run_many(estimator, records.model, records.priors, records.samples)
    covs = np.asarray(jax.vmap(jax.vmap(lambda estimate: estimate.cov))(infos.estimate))[rows]
    errors = played.errors[rows]
    by_filter = np.mean(np.einsum("ki,ki->k", errors, np.linalg.solve(covs, errors[..., None])[..., 0]))
    odd = np.broadcast_to(np.arange(len(rows))[:, None] % 2 == 1, rows.shape)[rows]
    squares = []
    for one in (odd, ~odd):
        if one.any() and (~one).any():
            cov = errors[~one].T @ errors[~one] / (~one).sum()
            squares.append(np.einsum("ki,ki->k", errors[one], np.linalg.solve(cov, errors[one].T).T))
    return float(by_filter), float(np.mean(np.concatenate(squares))) if squares else np.nan
