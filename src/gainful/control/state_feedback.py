"""Feedback of the state, with what it adds up to."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError
from ..running.plant import AbstractController, Reading
from ..spaces import AbstractSpace
from .references import AbstractReference
from .state_source import StateSource


def _numbers(value: Any) -> Array:
    return jnp.asarray(value, float)


def _matrix(value: Any) -> Array | None:
    return None if value is None else jnp.asarray(value, float)


class StateFeedback(AbstractController):
    """Linear feedback of the departure from a reference, and of its integral, with the reference's input fed forward.

        u = u_r(t) - K d - K_i s,      d = x - x_r(t),      s(k+1) = s(k) + interval C d

    Gains of place and speed make it proportional and differential control, those of `lqr` and `lqi` optimal regulators. An
    integral stands still while a command is cut and it would push the command further beyond the limit.

    Attributes:
        gain: K (m, n).
        reference: to follow.
        source: where the state comes from; the readings by default.
        space: where the state lives, if differences are not those of numbers: with a quaternion, `d` is one of `space`'s
            degrees of freedom long.
        limit: largest magnitude of a command (m,) or one number; none by default.
        integral_gain: K_i (m, outputs); none by default.
        integrated: C (outputs, n).
        interval: between commands [s].
        anti_windup: whether the integral stands still.

    Raises:
        ShapeError: gains that do not fit each other.
        ConfigError: an integral gain without what is integrated.
    """

    gain: Array = eqx.field(converter=_numbers)
    reference: AbstractReference
    source: StateSource = StateSource()
    space: AbstractSpace | None = None
    limit: float | Array | None = None
    integral_gain: Array | None = eqx.field(converter=_matrix, default=None)
    integrated: Array | None = eqx.field(converter=_matrix, default=None)
    interval: float | Array = 0.1
    anti_windup: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        if self.gain.ndim != 2:
            raise ShapeError(f"gain: expected a matrix, got shape {self.gain.shape}")
        if (self.integral_gain is None) != (self.integrated is None):
            raise ConfigError("integral_gain: expected together with integrated, got one without the other")
        if self.integral_gain is not None and self.integrated is not None:
            m, n = self.gain.shape
            outputs = len(self.integrated)
            if self.integrated.shape != (outputs, n):
                raise ShapeError(f"integrated: expected {n} columns, got shape {self.integrated.shape}")
            if self.integral_gain.shape != (m, outputs):
                raise ShapeError(f"integral_gain: expected shape {(m, outputs)}, got {self.integral_gain.shape}")

    def init(self) -> Float[Array, " outputs"]:
        return jnp.zeros(0 if self.integrated is None else len(self.integrated))

    def act(
        self, carry: Float[Array, " outputs"], t: Float[Array, ""], reading: Reading
    ) -> tuple[Float[Array, " outputs"], Float[Array, " m"]]:
        x, wanted = self.source(reading), self.reference.state(t)
        d = x - wanted if self.space is None else self.space.minus(x, wanted)
        asked = self.reference.input(t) - self.gain @ d
        if self.integral_gain is None or self.integrated is None:
            return carry, self._cut(asked)
        asked = asked - self.integral_gain @ carry
        command = self._cut(asked)
        more = self.interval * self.integrated @ d
        if self.anti_windup:
            more = jnp.where(winds_up(asked - command, -self.integral_gain, more), 0.0, more)
        return carry + more, command

    def _cut(self, asked: Array) -> Array:
        return asked if self.limit is None else jnp.clip(asked, -self.limit, self.limit)


def winds_up(excess: Float[Array, " m"], effect: Float[Array, "m outputs"], more: Float[Array, " outputs"]) -> Array:
    """Which integrals would push a command that is cut further beyond its limit.

    Args:
        excess: what was cut off.
        effect: of the integrals on the command.
        more: how much each integral is about to grow.
    """
    return (excess @ effect) * more > 0
