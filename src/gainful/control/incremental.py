"""Inversion of what an input adds, from the last measured change."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ShapeError
from ..running.plant import AbstractController, Reading
from .commands import AbstractCommand
from .state_source import StateSource


def _numbers(value: Any) -> Array:
    return jnp.asarray(value, float)


class IncrementalInversion(AbstractController):
    """Incremental nonlinear dynamic inversion: the last command, plus what is missing over the input's effectiveness.

        u(k) = u(k-1) + B^+ (wanted - happened),      wanted = x_d(k+1) - x(k),      happened = x(k) - x(k-1)

    of the tracked states. It needs no more of a model than `B`: all the rest is in what happened. Where a tracked state was
    not measured, now or a sample ago, the last command stays.

    Attributes:
        effectiveness: B, change of the tracked states in a sample per unit of the input (tracked, m).
        command: what is asked for.
        tracked: indices of the tracked states.
        source: where the state comes from; the readings by default.
        limit: largest magnitude of an input (m,) or one number; none by default.

    Raises:
        ShapeError: not one row of the effectiveness per tracked state.

    Source: Sieberling, Chu and Mulder (2010), J. Guid. Control Dyn. 33(6):1732-1742.
    Reduces to: the adaptive inverse with the frozen model `B u` and a mean error that follows at once.
    """

    effectiveness: Array = eqx.field(converter=_numbers)
    command: AbstractCommand
    tracked: tuple[int, ...] = eqx.field(static=True)
    source: StateSource = StateSource()
    limit: float | Array | None = None

    def __check_init__(self) -> None:
        if self.effectiveness.ndim != 2 or len(self.effectiveness) != len(self.tracked):
            raise ShapeError(
                f"effectiveness: expected {len(self.tracked)} rows, one per tracked state, "
                f"got shape {self.effectiveness.shape}"
            )

    def init(self) -> Any:
        tracked, inputs = self.effectiveness.shape
        return self.command.init(), jnp.full(tracked, jnp.nan), jnp.zeros(inputs), jnp.asarray(False)

    def act(self, carry: Any, t: Float[Array, ""], reading: Reading) -> tuple[Any, Float[Array, " m"]]:
        asking, last, u, gap = carry
        x, rows = self.source(reading), jnp.asarray(self.tracked)
        fresh = jnp.all(jnp.isfinite(self.source.fresh(reading)[rows]))
        asking, wanted = self.command.desired(asking, t, x)
        now = x[rows]
        happened = jnp.where(jnp.isnan(last), 0.0, now - last)
        moved = u + jnp.linalg.pinv(self.effectiveness) @ (wanted[rows] - now - happened)
        moved = moved if self.limit is None else jnp.clip(moved, -self.limit, self.limit)
        u = jnp.where(fresh & ~gap, moved, u)
        return (asking, jnp.where(fresh, now, jnp.nan), u, ~fresh), u
