"""Records run through an aided filter, and what its network was told on the way."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from ..errors import Status
from ..estimates import AbstractEstimate
from ..filters import KalmanFilter
from ..models import AbstractModel, Sample
from ..networks import zero_map
from ..running import Log, run_many, samples_of
from ..running.result import apart
from ..updates import AbstractFeatures, Corrected, Correction


@dataclasses.dataclass(frozen=True)
class Records:
    """Records of one model, padded to one length with rows in which nothing happens.

    Attributes:
        model: of the plant.
        priors: the estimate before each, stacked.
        samples: of all, stacked.
        real: which rows are not padding (M, T).
        reference: what the states should be, NaN where nobody knows (M, T, size).
    """

    model: AbstractModel
    priors: AbstractEstimate
    samples: Sample
    real: Bool[np.ndarray, "M T"]
    reference: Float[np.ndarray, "M T size"]

    def chosen(self, rows: slice) -> Records:
        """Some of the records."""
        priors, samples = jax.tree.map(lambda leaf: leaf[rows], (self.priors, self.samples))
        return Records(self.model, priors, samples, self.real[rows], self.reference[rows])


def gathered(
    model: AbstractModel,
    priors: Sequence[AbstractEstimate],
    logs: Sequence[Log],
    references: Sequence[Float[np.ndarray, "T size"]],
) -> Records:
    """Records of any lengths, together."""
    longest = max(len(log) for log in logs)
    dtype = priors[0].mean.dtype

    def padded(log: Log) -> Sample:
        missing = longest - len(log)
        longer = jax.tree.map(
            lambda leaf: np.concatenate([leaf, np.repeat(leaf[-1:], missing, axis=0)]), samples_of(log, dtype)
        )
        longer.when.dt[len(log) :] = 0
        longer.seen[len(log) :] = False
        return longer

    samples = jax.tree.map(lambda *leaves: np.stack(leaves), *(padded(log) for log in logs))
    real = np.stack([np.arange(longest) < len(log) for log in logs])
    reference = np.full((len(logs), longest, model.space.size), np.nan)
    for k, values in enumerate(references):
        reference[k, : len(values)] = values
    return Records(model, jax.tree.map(lambda *leaves: jnp.stack(leaves), *priors), samples, real, reference)


@dataclasses.dataclass(frozen=True)
class Played:
    """What an aided filter made of records.

    Attributes:
        features: what the network was told (M, T, d).
        wanted: what it should have said: the reference minus the estimate without the correction (M, T, dof).
        errors: the reference minus the estimate that is reported (M, T, dof).
        measured: rows with a measurement that counted (M, T).
        aided: rows whose estimate is another than without the network (M, T).
        passed: rows whose correction was let through (M, T).
        flagged: rows at which the network was asked where it had learned nothing (M, T).
    """

    features: Float[np.ndarray, "M T d"]
    wanted: Float[np.ndarray, "M T dof"]
    errors: Float[np.ndarray, "M T dof"]
    measured: Bool[np.ndarray, "M T"]
    aided: Bool[np.ndarray, "M T"]
    passed: Bool[np.ndarray, "M T"]
    flagged: Bool[np.ndarray, "M T"]

    def examples(self) -> tuple[Float[np.ndarray, "N d"], Float[np.ndarray, "N dof"]]:
        """Features and what the network should say of them, at every row with a measurement and some reference."""
        known = np.isfinite(self.wanted).any(axis=-1)
        rows = self.measured & known & np.isfinite(self.features).all(axis=-1)
        return self.features[rows], self.wanted[rows]


def play(estimator: KalmanFilter, update: Corrected, records: Records) -> Played:
    """Records run through the filter with its update corrected."""
    # What is reported of uncertainty is not looked at here.
    bare = dataclasses.replace(update, covariance=None, variances=None)
    watching = dataclasses.replace(estimator, update=bare)
    _, infos = run_many(watching, records.model, records.priors, records.samples)
    memory = infos.memory[0]
    assert isinstance(memory, Correction)
    space = records.model.space
    mean, shift = np.asarray(infos.estimate.mean), np.asarray(memory.shift)
    # Taking the shift back gives the estimate that the network was to correct.
    before = np.asarray(jax.vmap(jax.vmap(space.plus))(jnp.asarray(mean), -jnp.asarray(shift)))
    status = np.asarray(infos.status)
    measured = records.real & (status == Status.ok)
    return Played(
        np.asarray(memory.features),
        _errors(records, before),
        _errors(records, mean),
        measured,
        records.real & (np.asarray(memory.aided) > 0),
        measured & (np.asarray(memory.passed) > 0),
        measured & (np.asarray(memory.flagged) > 0),
    )


def _errors(records: Records, mean: Float[np.ndarray, "M T size"]) -> Float[np.ndarray, "M T dof"]:
    flat = apart(records.model.space, records.reference.reshape(-1, mean.shape[-1]), mean.reshape(-1, mean.shape[-1]))
    errors = flat.reshape(*mean.shape[:2], -1)
    return np.where(records.real[..., None], errors, np.nan)


def unaided(estimator: KalmanFilter, features: AbstractFeatures, model: AbstractModel) -> Corrected:
    """The filter's update with a network that says nothing."""
    network = zero_map(len(features.names(model)), model.space.dof)
    return Corrected(network, features, estimator.update, gate=None)
