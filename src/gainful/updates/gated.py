"""Refusing measurements that are too far off, without losing track for good."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..linalg import chi_square_quantile, root_and_inverse
from ..models import AbstractModel
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact

BY = ("sensor", "component", "all")


class Gated(AbstractUpdate):
    """Leaves out each sensor whose squared normalised innovation exceeds its chi-square quantile.

    Sensors are judged one by one, each by its own block of the innovation covariance, so that a bad one does not take a
    good one with it. A sensor refused `reacquire` times in a row is believed the next time: by then it is more likely
    that the estimate is wrong.

    Attributes:
        inner: the update of what is left.
        probability: share of good measurements that pass, below 1.
        reacquire: rejections in a row before a sensor is believed again; 0 for never.
        by: what is judged as a whole: each "sensor", each "component" of the measurement, or "all" of it.

    Reduces to: `inner` as `probability` goes to 1.
    Source: Bar-Shalom, Li and Kirubarajan (2001), Estimation with Applications to Tracking and Navigation, 5.4.2.
    """

    inner: AbstractUpdate = Exact()
    probability: float = eqx.field(static=True, default=0.999)
    reacquire: int = eqx.field(static=True, default=10)
    by: Literal["sensor", "component", "all"] = eqx.field(static=True, default="sensor")

    def __check_init__(self) -> None:
        if not 0 < self.probability <= 1:
            raise ConfigError(f"probability: expected a number above 0 and at most 1, got {self.probability!r}")
        if not isinstance(self.reacquire, int) or self.reacquire < 0:
            raise ConfigError(f"reacquire: expected a whole number of at least 0, got {self.reacquire!r}")
        if self.by not in BY:
            raise ConfigError(f"by: {self.by!r} is not known; {did_you_mean(str(self.by), BY)}")

    def init(self, model: AbstractModel) -> tuple[Int[Array, " groups"], object]:
        return jnp.zeros(len(self._groups(model.sensors)), jnp.int32), self.inner.init(model)

    def _groups(self, sensors: tuple[tuple[str, int], ...]) -> list[int]:
        """Degrees of freedom of what is judged as a whole, in order."""
        total = sum(dof for _, dof in sensors)
        return {"sensor": [dof for _, dof in sensors], "component": [1] * total, "all": [total]}[self.by]

    def added(
        self, carry: tuple[Int[Array, " groups"], object], prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return self.inner.added(carry[1], prior, process)

    def reported(self, carry: tuple[Int[Array, " groups"], object], estimate: AbstractEstimate) -> AbstractEstimate:
        return self.inner.reported(carry[1], estimate)

    def __call__(
        self,
        carry: tuple[Int[Array, " groups"], object],
        prior: AbstractEstimate,
        likelihood: Likelihood,
        y: Float[Array, " output_size"],
    ) -> tuple[tuple[Int[Array, " groups"], object], Update]:
        refused, memory = carry
        _, innovation = prior.condition(likelihood.affine(prior), y, likelihood.seen)
        passed, counts, start = [], [], 0
        for i, dof in enumerate(self._groups(likelihood.sensors)):
            block = slice(start, start + dof)
            seen = likelihood.seen[block]
            _, whiten, _ = root_and_inverse(innovation.cov[block, block])
            distance = jnp.sum((whiten @ innovation.residual[block]) ** 2)
            # At probability 1 the quantile is infinite, and everything passes.
            limit = jnp.asarray(chi_square_quantile(self.probability, dof), distance.dtype)[jnp.sum(seen)]
            inside = distance <= limit
            if self.reacquire:
                inside |= refused[i] >= self.reacquire
            counts.append(jnp.where(jnp.any(seen), jnp.where(inside, 0, refused[i] + 1), refused[i]))
            passed.append(jnp.broadcast_to(inside, (dof,)))
            start += dof
        memory, update = self.inner(memory, prior, likelihood.only(jnp.concatenate(passed)), y)
        # What was refused is still reported: the innovation of everything measured, with weight 0 where left out.
        update = eqx.tree_at(lambda part: part.innovation, update, innovation)
        return (jnp.stack(counts).astype(jnp.int32), memory), update
