"""Parameters that jump, told from outliers by the direction in which the innovations push them."""

from __future__ import annotations

from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..linalg import product, whitening_root
from ..linalg.whitening import Whitening, check_whitening
from ..models import AbstractModel
from .adaptation import inflated, remembered, state_rows
from .base import AbstractUpdate, Likelihood, Update
from .influence import huber_fisher_information, huber_psi, huber_threshold
from .robust import MasreliezMartin

ACTIONS = ("inflate", "report")


class Changes(eqx.Module):
    """What the detection of changes remembers.

    Attributes:
        score: push of the last innovation on each watched state, of zero mean and unit variance while nothing changes (w,).
        up: sum of the pushes upwards beyond the allowance (w,).
        down: sum of those downwards (w,).
        alarm: +1 or -1 where a change up or down was found at the last measurement, else 0 (w,).
        since: measurements since the last alarm of each state (w,).
        count: measurements so far.
        inner: memory of the inner update.
    """

    score: Float[Array, " w"]
    up: Float[Array, " w"]
    down: Float[Array, " w"]
    alarm: Float[Array, " w"]
    since: Int[Array, " w"]
    count: Int[Array, ""]
    inner: Any


class ChangeDetection(AbstractUpdate):
    """Watches what the innovations say of single states and widens those that they push one way again and again.

    ```
    s_j = [K psi(v)]_j / sqrt(c [K K^T]_jj);  v = T r with T S T^T = I,  K = P H^T T^T,  c = E[psi^2]
    up <- max(0, up + s - allowance), down <- max(0, down - s - allowance);  alarm where either exceeds the threshold
    P_jj <- P_jj + jump_j^2 after an alarm, and both sums begin anew
    ```

    Outliers are single and of either sign, and their push is bounded; a parameter that has changed is pushed the same way
    by every innovation that tells of it, although the innovations themselves change sign with the excitation.

    Attributes:
        jumps: standard deviation of a jump by the name of the watched state, in tangent units.
        inner: the update, robust or not.
        allowance: half of the mean push that is looked for.
        threshold: of the sums; larger ones make false alarms rarer and true ones later.
        arm_after: measurements before the first alarm, for the start's transient.
        dead_time: measurements between two alarms of one state.
        contamination: share of outliers by which a single push is bounded; 0 for none.
        whitening: which root of the inverse innovation covariance, see `whitening_root`.
        action: "inflate" as above, or "report" for alarms alone.

    Reads: the innovation. Writes: the posterior covariance of the watched states.
    Source: Page (1954), Biometrika 41:100-115, on the score of Masreliez and Martin (1977), IEEE TAC 22(3):361-371.
    Reduces to: `inner` for an infinite threshold.
    """

    jumps: dict[str, float] = eqx.field(default_factory=dict)
    inner: AbstractUpdate = MasreliezMartin()
    allowance: float = 0.5
    threshold: float = 8.0
    arm_after: int = eqx.field(static=True, default=200)
    dead_time: int = eqx.field(static=True, default=50)
    contamination: float = eqx.field(static=True, default=0.1)
    whitening: Whitening = eqx.field(static=True, default="zca-cor")
    action: Literal["inflate", "report"] = eqx.field(static=True, default="inflate")

    def __check_init__(self) -> None:
        for name, jump in self.jumps.items():
            if isinstance(jump, (int, float)) and not jump > 0:
                raise ConfigError(f"jumps: expected a size above 0 for {name!r}, got {jump!r}")
        for name in ("arm_after", "dead_time"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 0:
                raise ConfigError(f"{name}: expected a whole number of at least 0, got {value!r}")
        for name, least in (("allowance", 0.0), ("threshold", 0.0)):
            value = getattr(self, name)
            if isinstance(value, (int, float)) and not value >= least:
                raise ConfigError(f"{name}: expected a number of at least 0, got {value!r}")
        huber_threshold(self.contamination)
        check_whitening(self.whitening)
        if self.action not in ACTIONS:
            raise ConfigError(f"action: {self.action!r} is not known; {did_you_mean(str(self.action), ACTIONS)}")

    def init(self, model: AbstractModel) -> Changes:
        state_rows("jumps", self.jumps, model.space)
        none = jnp.zeros(len(self.jumps))
        since = jnp.full(len(self.jumps), self.dead_time, jnp.int32)
        return Changes(none, none, none, none, since, jnp.array(0, jnp.int32), self.inner.init(model))

    def added(
        self, carry: Changes, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return self.inner.added(carry.inner, prior, process)

    def reported(self, carry: Changes, estimate: AbstractEstimate) -> AbstractEstimate:
        return self.inner.reported(carry.inner, estimate)

    def __call__(
        self, carry: Changes, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[Changes, Update]:
        inner, update = self.inner(carry.inner, prior, likelihood, y)
        measured = jnp.any(likelihood.seen)
        rows = jnp.array(state_rows("jumps", self.jumps, prior.space), int)
        score = self._score(prior, update, rows).astype(carry.score.dtype)
        up = jnp.maximum(0.0, carry.up + score - self.allowance)
        down = jnp.maximum(0.0, carry.down - score - self.allowance)
        count, since = carry.count + 1, carry.since + 1
        armed = measured & (count > self.arm_after) & (since > self.dead_time)
        alarm = jnp.where(armed & (jnp.maximum(up, down) > self.threshold), jnp.where(up > down, 1.0, -1.0), 0.0)
        found = alarm != 0.0
        up, down = jnp.where(found, 0.0, up), jnp.where(found, 0.0, down)
        new = Changes(score, up, down, alarm.astype(score.dtype), jnp.where(found, 0, since), count, inner)
        if self.action == "inflate":
            jump = jnp.asarray(list(self.jumps.values()), prior.mean.dtype)
            extra = jnp.zeros(prior.space.dof, prior.mean.dtype).at[rows].set(jnp.where(found, jump**2, 0.0))
            posterior = inflated(update.posterior, jnp.diag(extra), jnp.any(found))
            update = eqx.tree_at(lambda part: part.posterior, update, posterior)
        still = eqx.tree_at(
            lambda memory: (memory.score, memory.alarm), carry, (jnp.zeros_like(score), jnp.zeros_like(score))
        )
        return remembered(measured, new, still, inner), update

    def _score(self, prior: AbstractEstimate, update: Update, rows: Int[Array, " w"]) -> Float[Array, " w"]:
        """The push on each watched state; 0 where the measurement says nothing of it."""
        innovation, threshold = update.innovation, huber_threshold(self.contamination)
        whiten = whitening_root(innovation.cov, self.whitening)
        v = product(whiten, innovation.residual[:, None])[:, 0]
        gain = product(prior.cov[rows], product(whiten, update.affine.matrix).T)
        power = jnp.sum(gain**2, axis=1) * huber_fisher_information(threshold)
        told = power > 0
        return jnp.where(told, gain @ huber_psi(v, threshold), 0.0) / jnp.sqrt(jnp.where(told, power, 1.0))
