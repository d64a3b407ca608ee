"""An update whose estimate a network corrects."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..linalg import congruence
from ..models import AbstractModel
from ..networks import AbstractNetwork
from .adaptation import remembered, state_rows
from .aiding_features import AbstractFeatures, UpdateFeatures
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact
from .online_gate import OnlineGate, Usefulness

_LEAST_SHARE = 1e-3
"""A region's variance is at least this share of the variance everywhere."""


class Correction(eqx.Module):
    """What a corrected update remembers.

    Attributes:
        shift: what was added to the estimate at the last row, in tangent coordinates; 0 where nothing was (dof,).
        offered: what the network said at the last measurement, moved along with the state since (dof,).
        passed: 1 where it was let through at the last row.
        trusted: 1 where the filter's own estimate holds what was offered.
        aided: 1 where the estimate is another than the filter would have had.
        flagged: 1 where the network was asked where it had learned nothing.
        features: what the network was told at the last measurement (d,).
        cov: covariance of the corrected estimate (dof, dof); 0 where there is none or nobody knows it.
        usefulness: memory of the gate.
        told: memory of the features.
        inner: memory of the inner update.
    """

    shift: Float[Array, " dof"]
    offered: Float[Array, " dof"]
    passed: Float[Array, ""]
    trusted: Float[Array, ""]
    aided: Float[Array, ""]
    flagged: Float[Array, ""]
    features: Float[Array, " d"]
    cov: Float[Array, "dof dof"]
    usefulness: Usefulness
    told: Any
    inner: Any


class Corrected(AbstractUpdate):
    """Adds to the inner update's estimate what a network makes of the step: `x + E(features)`.

    Open loop, the filter runs as if there were no network, and the corrected estimate is an output. With `feedback` it takes
    the place of the filter's own before the next prediction. The gain is the filter's own either way.

    The filter's covariance says nothing of a corrected estimate, so it is never reported with one: `covariance` is,
    found on records with a reference, or NaN where it was not given. Where nothing was measured the network is not asked,
    and all that the features and the gate remember is held. Where the network has learned too little the correction is 0.

    Attributes:
        network: from the features to a correction in tangent coordinates.
        features: what the network is told.
        inner: the update that is corrected.
        feedback: whether the filter goes on from the corrected estimate.
        gate: when to trust the network; always if None.
        components: names of the states that are corrected, as the covariance has them; all if None.
        covariance: of the corrected estimate (dof, dof).
        variances: a network from the features to the variances of the corrected estimate, where `covariance` alone is too
            coarse; it lends the correlations.
        least_visits: visits in training that what answers must have had; each epoch counts.

    Reads: the whole update. Writes: the reported estimate; with `feedback` the posterior mean.
    Source: Chin (1994), IEEE Trans. Aerosp. Electron. Syst. 30(2); Zhang, Yang and Sun (2010), Modern Electronics Technique
        33(21):51-53.
    Differs: gates, feedback, and a covariance of its own.
    Reduces to: `inner` for a network that gives 0, and while the gate is closed.

    Example:
        >>> from gainful.filters import KalmanFilter
        >>> from gainful.models import linear_model
        >>> from gainful.networks import zero_map
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"], outputs=["y"])
        >>> UpdateFeatures().names(model)
        ('move x', 'left y', 'gain x by y')
        >>> KalmanFilter(update=Corrected(zero_map(3, 1))).update.init(model).shift.tolist()
        [0.0]
    """

    network: AbstractNetwork
    features: AbstractFeatures = UpdateFeatures()
    inner: AbstractUpdate = Exact()
    feedback: bool = eqx.field(static=True, default=False)
    gate: OnlineGate | None = OnlineGate()
    components: tuple[str, ...] | None = eqx.field(static=True, default=None)
    covariance: Float[Array, "dof dof"] | None = None
    variances: AbstractNetwork | None = None
    least_visits: float = 20.0

    def __check_init__(self) -> None:
        if isinstance(self.least_visits, (int, float)) and not self.least_visits >= 0:
            raise ConfigError(f"least_visits: expected a number of at least 0, got {self.least_visits!r}")
        if self.variances is not None and self.covariance is None:
            raise ConfigError("variances: expected a covariance too, whose correlations they take, got none")

    def init(self, model: AbstractModel) -> Correction:
        dof, names = model.space.dof, self.features.names(model)
        state_rows("components", self.components or (), model.space)
        for role, network in (("network", self.network), ("variances", self.variances)):
            if network is not None and (network.inputs, network.outputs) != (len(names), dof):
                raise ConfigError(
                    f"{role}: expected {len(names)} inputs ({', '.join(names)}) and {dof} outputs, got "
                    f"{network.inputs} and {network.outputs}"
                )
        if self.covariance is not None and self.covariance.shape != (dof, dof):
            raise ConfigError(f"covariance: expected shape ({dof}, {dof}), got {self.covariance.shape}")
        none, zero = jnp.zeros(dof), jnp.array(0.0)
        return Correction(
            none,
            none,
            zero,
            zero,
            zero,
            zero,
            jnp.zeros(len(names)),
            jnp.zeros((dof, dof)),
            (self.gate or OnlineGate()).init(),
            self.features.init(model),
            self.inner.init(model),
        )

    def added(
        self, carry: Correction, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return self.inner.added(carry.inner, prior, process)

    def __call__(
        self, carry: Correction, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Correction, Update]:
        inner, update = self.inner(carry.inner, prior, likelihood, y)
        measured = jnp.any(likelihood.seen)
        moved = carry.offered if likelihood.transition is None else likelihood.transition.matrix @ carry.offered
        usefulness = self._judged(carry, moved, update)
        told, features = self.features(carry.told, likelihood, update)
        learned = self.network.visits(features) >= self.least_visits
        flagged = ~(learned & self.network.contains(features))
        offered = jnp.where(learned, self.network(features), 0.0) * self._chosen(prior)
        passed = measured & jnp.any(offered != 0)
        if self.gate is not None:
            passed &= self.gate.is_open(usefulness)
        shift = jnp.where(passed, offered, 0.0)
        # A filter that was corrected once goes on from there; one that was not knows nothing of the network.
        aided = jnp.maximum(carry.aided, passed) if self.feedback else passed
        trusted = passed if self.feedback else jnp.array(False)
        cov = self._cov(features, prior)
        new = Correction(shift, offered, passed, trusted, aided, flagged, features, cov, usefulness, told, inner)
        new = remembered(measured, new, self._held(carry, moved, likelihood), inner)
        if self.feedback:
            mean = prior.space.plus(update.posterior.mean, shift.astype(prior.mean.dtype))
            mean = jnp.where(passed, mean, update.posterior.mean)
            update = eqx.tree_at(lambda part: part.posterior.mean, update, mean)
        return new, update

    def _judged(self, carry: Correction, moved: Array, update: Update) -> Usefulness:
        """The gate's memory after it has seen what the last correction was worth."""
        if self.gate is None:
            return carry.usefulness
        # What the update refused to believe shall not judge either.
        residual = jnp.where(update.weight > 0, update.innovation.residual, 0.0)
        predicted = jnp.where(update.weight > 0, update.affine.matrix @ moved, 0.0)
        return self.gate.judged(carry.usefulness, residual, predicted, update.innovation.inverse, carry.trusted)

    def _chosen(self, prior: AbstractEstimate) -> Float[np.ndarray, " dof"]:
        """1 for the components that are corrected."""
        if self.components is None:
            return np.ones(prior.space.dof)
        chosen = np.zeros(prior.space.dof)
        chosen[state_rows("components", self.components, prior.space)] = 1.0
        return chosen

    def _cov(self, features: Array, prior: AbstractEstimate) -> Float[Array, "dof dof"]:
        """Covariance of the corrected estimate here; 0 where nobody knows it."""
        if self.covariance is None:
            return jnp.zeros((prior.space.dof, prior.space.dof))
        if self.variances is None:
            return self.covariance
        everywhere = jnp.diagonal(self.covariance)
        here = jnp.maximum(self.variances(features), _LEAST_SHARE * everywhere)
        here = jnp.where(self.variances.visits(features) >= self.least_visits, here, everywhere)
        scale = jnp.sqrt(here / jnp.where(everywhere > 0, everywhere, 1.0))
        return scale[:, None] * self.covariance * scale[None, :]

    def _held(self, carry: Correction, moved: Array, likelihood: Likelihood) -> Correction:
        """What is remembered after a row without a measurement: nothing is added, and all else moves with the state."""
        zero = jnp.array(0.0)
        still = eqx.tree_at(
            lambda memory: (memory.shift, memory.offered, memory.passed, memory.flagged),
            carry,
            (jnp.zeros_like(carry.shift), moved.astype(carry.offered.dtype), zero, zero),
        )
        if not self.feedback:
            return eqx.tree_at(lambda memory: memory.aided, still, zero)
        transition, cov = likelihood.transition, carry.cov
        if transition is not None:
            cov = congruence(transition.matrix, cov) + transition.covariance()
        cov = jnp.where(carry.aided > 0, cov + likelihood.process, carry.cov)
        return eqx.tree_at(lambda memory: memory.cov, still, cov.astype(carry.cov.dtype))

    def reported(self, carry: Correction, estimate: AbstractEstimate) -> AbstractEstimate:
        own = self.inner.reported(carry.inner, estimate)
        mean = estimate.mean
        if not self.feedback:
            mean = estimate.space.plus(mean, carry.shift.astype(mean.dtype))
        cov = carry.cov.astype(mean.dtype) if self.covariance is not None else jnp.full_like(carry.cov, jnp.nan)
        corrected = type(estimate).start(mean, cov, estimate.space)
        aided = carry.aided > 0
        return jax.tree.map(lambda ours, theirs: jnp.where(aided, ours, theirs), corrected, own)
