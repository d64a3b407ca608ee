"""Random walks that stop where nothing is learned of them."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..models import AbstractModel
from ..updates import Update
from ..updates.adaptation import state_rows
from .base import AbstractNoise
from .nominal import Nominal


class Capped(AbstractNoise):
    """Adds process noise to a state only up to a largest standard deviation, so that an unexcited one does not wind up.

    ```
    Q_jj <- min(Q_jj, max(0, limit_j^2 - P_jj)), with the correlations of Q
    ```

    Without excitation the variance of a parameter that walks grows by its noise in every step, and when the excitation
    comes back the gain is as if nothing were known.

    Attributes:
        limits: largest standard deviation by the name of the state, in tangent units.
        inner: the noise law that is capped.

    Reads: the posterior covariance. Writes: Q.
    Reduces to: `inner` for infinite limits.
    """

    limits: dict[str, float] = eqx.field(default_factory=dict)
    inner: AbstractNoise = Nominal()

    def __check_init__(self) -> None:
        for name, limit in self.limits.items():
            if isinstance(limit, (int, float)) and not limit > 0:
                raise ConfigError(f"limits: expected a standard deviation above 0 for {name!r}, got {limit!r}")

    def init(self, model: AbstractModel) -> tuple[Float[Array, " dof"], Float[Array, " dof"], Any]:
        state_rows("limits", self.limits, model.space)
        precisions = jnp.array([self.limits.get(name, jnp.inf) for name in model.space.tangent_names]) ** -2.0
        return precisions, jnp.zeros(model.space.dof), self.inner.init(model)

    def process(self, carry: Any, Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        precisions, variances, inner = carry
        Q = self.inner.process(inner, Q)
        wanted = jnp.diagonal(Q)
        limited = precisions > 0
        room = jnp.where(limited, 1.0 / jnp.where(limited, precisions, 1.0) - variances, jnp.inf)
        room = jnp.maximum(room, 0.0).astype(Q.dtype)
        share = jnp.where(wanted > room, room / jnp.where(wanted > 0, wanted, 1.0), 1.0)
        # Where nothing is let through, the root has no derivative.
        scale = jnp.where(share > 0, jnp.sqrt(jnp.where(share > 0, share, 1.0)), 0.0)
        return scale[:, None] * Q * scale[None, :]

    def measurement(self, carry: Any, R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        return self.inner.measurement(carry[2], R)

    def learn(self, carry: Any, update: Update) -> Any:
        precisions, variances, inner = carry
        now = jnp.diagonal(update.posterior.cov).astype(variances.dtype)
        return precisions, now, self.inner.learn(inner, update)
