"""From a statistic to alarms."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def alarms(
    t: Float[Array, " T"],
    statistic: Float[Array, " T"],
    threshold: Float[Array, ""] | float,
    *,
    merge: float = 0.0,
    hold_off: float = 0.0,
) -> Bool[Array, " T"]:
    """Rows in which an alarm is raised: the statistic is above its threshold and was not within the last `merge` seconds.

    Pure, so `vmap` over runs applies.

    Args:
        t: times [s].
        statistic: one value per row; NaN is no alarm.
        threshold: what it must exceed.
        merge: exceedances at most so far apart are one alarm [s].
        hold_off: no alarm within so long of the first row [s].

    Example:
        >>> import numpy as np
        >>> alarms(np.arange(6.0), np.array([0.0, 9.0, 0.0, 9.0, 0.0, 9.0]), 5.0, merge=2.0).tolist()
        [False, True, False, False, False, False]
    """
    t = jnp.asarray(t)
    above = (jnp.asarray(statistic) > threshold) & (t - t[0] >= hold_off)
    latest = jax.lax.cummax(jnp.where(above, t, -jnp.inf))
    before = jnp.concatenate([jnp.full(1, -jnp.inf, t.dtype), latest[:-1]])
    return above & (t - before > merge)
