"""The contract of an update, and the likelihood it works on."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
from jaxtyping import Array, Bool, Float

from ..estimates import AbstractEstimate, Affine, Innovation
from ..linearization import AbstractLinearization
from ..models import AbstractModel, Instant
from ..spaces import AbstractSpace


class Likelihood(eqx.Module):
    """What a measurement says of the state: the function measured, its noise, and how to linearise it.

    Attributes:
        fn: measurement without noise, as a function of the state.
        output: space of the measurement.
        noise: covariance of the measurement noise (m, m).
        seen: which components were measured (m,).
        process: process noise of the interval, as it is in the prior (dof, dof).
        sensors: name and degrees of freedom of each sensor.
        linearization: turns `fn` into an affine map.
        around: where to linearise; at the prior if None.
        when: the moment of the measurement; None where nobody told.
        transition: the map without noise that led from the last estimate to the prior, likewise.
    """

    fn: Callable[[Float[Array, " size"]], Float[Array, " output_size"]]
    output: AbstractSpace
    noise: Float[Array, "m m"]
    seen: Bool[Array, " m"]
    process: Float[Array, "dof dof"]
    sensors: tuple[tuple[str, int], ...] = eqx.field(static=True)
    linearization: AbstractLinearization
    around: AbstractEstimate | None = None
    when: Instant | None = None
    transition: Affine | None = None

    def affine(self, prior: AbstractEstimate) -> Affine:
        """The map with its noise, unseen components cut off."""
        return self.with_noise(self.linearised(prior), self.noise)

    def linearised(self, prior: AbstractEstimate) -> Affine:
        """The map without noise."""
        return self.linearization(self.fn, prior if self.around is None else self.around, self.output)

    def with_noise(self, linearised: Affine, noise: Float[Array, "m m"]) -> Affine:
        """The map with a noise of its own, unseen components cut off."""
        return linearised.plus_noise(noise).masked(self.seen)

    def only(self, seen: Bool[Array, " m"]) -> Likelihood:
        """The likelihood of fewer components."""
        return eqx.tree_at(lambda part: part.seen, self, self.seen & seen)

    def linearised_around(self, estimate: AbstractEstimate) -> Likelihood:
        """The likelihood linearised elsewhere than at the prior."""
        return eqx.tree_at(lambda part: part.around, self, estimate, is_leaf=lambda leaf: leaf is None)


class Update(eqx.Module):
    """What one measurement did: all that parts of a filter may know of each other.

    Attributes:
        prior: the estimate before.
        posterior: the estimate after.
        innovation: measured minus expected, with its covariance.
        affine: the measurement map used.
        postfit: measured minus expected after the update (m,).
        weight: how far each component counted: 1 in full, 0 not at all (m,).
    """

    prior: AbstractEstimate
    posterior: AbstractEstimate
    innovation: Innovation
    affine: Affine
    postfit: Float[Array, " m"]
    weight: Float[Array, " m"]


class AbstractUpdate(eqx.Module):
    """Decides how strongly a measurement counts.

    Laws, checked for every update: an unmeasured component changes nothing; in its limit it equals `Exact`.
    """

    @abc.abstractmethod
    def init(self, model: AbstractModel) -> Any:
        """What it remembers at the start."""

    @abc.abstractmethod
    def __call__(
        self, carry: Any, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Any, Update]:
        """The update, and what it remembers afterwards."""

    def added(
        self, carry: Any, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        """Process noise it put into the prior within the step, given what it remembers after it; None if it never does.

        The smoother asks for it: what was added before the update belongs to the map that led there.
        """
        return None

    def reported(self, carry: Any, estimate: AbstractEstimate) -> AbstractEstimate:
        """The estimate a reader should see in place of the filter's own, given what it remembers; itself by default."""
        return estimate
