"""The state that is asked for one sample ahead."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..spaces import wrap_angle
from .euler321 import euler321_rates
from .references import AbstractReference
from .slews import QuinticSlews


class AbstractCommand(eqx.Module):
    """What a one-step inverse is to reach with the next sample.

    Attributes:
        interval: between samples [s].
    """

    interval: eqx.AbstractVar[float]

    @abc.abstractmethod
    def init(self) -> Any:
        """What it remembers at the start."""

    @abc.abstractmethod
    def desired(self, carry: Any, t: Float[Array, ""], x: Float[Array, " n"]) -> tuple[Any, Float[Array, " n"]]:
        """What it remembers from now on, and the state wanted at `t + interval` where it is `x` at `t`."""

    @abc.abstractmethod
    def error(self, t: Float[Array, ""], x: Float[Array, " n"]) -> Float[Array, " errors"]:
        """How far the state is from where it should be."""


class FollowReference(AbstractCommand):
    """Asks for the reference itself: the weights of the inverse are then all there is of a control law.

    Attributes:
        interval: between samples [s].
        reference: to follow.
    """

    interval: float
    reference: AbstractReference

    def init(self) -> None:
        return None

    def desired(self, carry: None, t: Float[Array, ""], x: Float[Array, " n"]) -> tuple[None, Float[Array, " n"]]:
        return None, self.reference.state(t + self.interval)

    def error(self, t: Float[Array, ""], x: Float[Array, " n"]) -> Float[Array, " n"]:
        return x - self.reference.state(t)


class RateCommand(AbstractCommand):
    """Asks for a body rate that leads an attitude to its reference and takes the swing out of elastic modes.

    For a state `x = [angles(3), deflection(m), rate(3), deflection rate(m)]` with 3-2-1 angles, and `T` the interval,

        rate_d(k+1) = w_r(k+1) + sat(e) + panel_gain (q - q_r(k+1)) + (1 - contraction) (w - rate_d(k))
        e = angles_r(k+1) - angles - T E(angles) w,      sat(e) = sign(e) min(attitude_gain |e|, sqrt(2 braking |e|))

    A hub that turns by `w = panel_gain q` damps a mode to the ratio `B panel_gain / (2 sqrt(A E))`; a hub that follows its
    reference to the letter leaves it to swing. The square root slows down in time for the torque there is.

    Only the rates are asked for; the rest of what is returned is the state as it is, so give it no weight.

    Attributes:
        interval: T [s].
        slews: to follow.
        attitude_gain: 1/s.
        panel_gain: of each mode on its own axis (3,), or a matrix (3, m) [1/(m s)]; none by default.
        quasi_static: `-E^-1 B`, the deflection per acceleration of the reference (m, 3) [m s^2]; none by default.
        braking: acceleration that slows down (3,) or one number [rad/s^2]; none by default, which never saturates.
        contraction: beta, share of the rate's error to be gone after a step; 1 asks for all of it.

    Raises:
        ConfigError: a gain, an interval or a contraction out of its range.

    Source: Wie and Lu (1995), J. Guid. Control Dyn. 18(6):1372-1379, for the braking curve.
    """

    interval: float
    slews: QuinticSlews
    attitude_gain: float | Array = 1.0
    panel_gain: Any = None
    quasi_static: Any = None
    braking: Any = None
    contraction: float | Array = 1.0

    def __check_init__(self) -> None:
        for name in ("interval", "attitude_gain"):
            value = getattr(self, name)
            if isinstance(value, float | int) and not value > 0:
                raise ConfigError(f"{name}: expected a number above 0, got {value!r}")
        if isinstance(self.contraction, float | int) and not 0 < self.contraction <= 1:
            raise ConfigError(f"contraction: expected a number above 0 and at most 1, got {self.contraction!r}")

    def init(self) -> Float[Array, "3"]:
        return jnp.full(3, jnp.nan)

    def desired(
        self, carry: Float[Array, "3"], t: Float[Array, ""], x: Float[Array, " n"]
    ) -> tuple[Float[Array, "3"], Float[Array, " n"]]:
        modes = (x.shape[0] - 6) // 2
        angles, deflection, rate, rest = jnp.split(x, [3, 3 + modes, 6 + modes])
        ahead = t + self.interval
        error = wrap_angle(self.slews.angles(ahead) - angles - self.interval * euler321_rates(angles) @ rate)
        wanted = self.slews.target_rate(ahead) + self._approach(error)
        if self.panel_gain is not None:
            gain = jnp.asarray(self.panel_gain, float)
            wanted = wanted + (jnp.diag(gain) if gain.ndim == 1 else gain) @ (deflection - self._resting(ahead, modes))
        # Nothing was asked for before the first sample.
        wanted = wanted + (1.0 - self.contraction) * jnp.where(jnp.isnan(carry), 0.0, rate - carry)
        return wanted, jnp.concatenate([angles, deflection, wanted, rest])

    def error(self, t: Float[Array, ""], x: Float[Array, " n"]) -> Float[Array, "3"]:
        return self.slews.tracking_error(x[:3], t)[0]

    def _resting(self, t: Array, modes: int) -> Array:
        if self.quasi_static is None:
            return jnp.zeros(modes)
        return jnp.asarray(self.quasi_static, float) @ self.slews.target_acceleration(t)

    def _approach(self, error: Array) -> Array:
        straight = self.attitude_gain * error
        if self.braking is None:
            return straight
        # Both branches meet here; the root is never taken of less, where its slope would not be finite.
        meet = 2.0 * jnp.asarray(self.braking, float) / self.attitude_gain**2
        curve = jnp.sqrt(2.0 * self.braking * jnp.maximum(jnp.abs(error), meet))
        return jnp.where(jnp.abs(error) > meet, jnp.sign(error) * curve, straight)
