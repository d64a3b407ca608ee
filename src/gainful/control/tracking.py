"""Following an attitude with wheels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..running.plant import AbstractController, Reading
from .allocation import Adjustment, allocate_torque
from .base import AbstractAttitudeReference
from .reconfiguration import AbstractReconfiguration, Unchanged
from .state_feedback import winds_up
from .state_source import FEEDBACK


class TrackingController(AbstractController):
    """Proportional and differential feedback of the tracking error, with the torque the target asks for fed forward.

    With `w` the body rate, `h` the wheels' momentum, `e` the angles relative to the target and `A` from target to body,

        w_e = w - A w_t
        T   = w x (J w + W h) + J (A dw_t/dt - w_e x A w_t) - J (k_d w_e + k_p e)

    which leaves `d w_e/dt = -k_d w_e - k_p e` where the wheels can follow: `k_p = w_n^2`, `k_d = 2 zeta w_n`. With `k_i`
    the integral of `e`, times `J k_i`, is taken off too (computed torque); it stands still about an axis on which a wheel
    is at its limit and it would push further. A reading begins with the three rates, then the attitude.

    Attributes:
        inertia: J (3, 3) [kg m^2].
        axes: W, unit vector of each wheel in body axes (3, w).
        max_torque: largest command to a wheel [N m]; a number or one per wheel.
        reference: the attitude to follow.
        k_p: feedback of the angles [1/s^2].
        k_d: feedback of the rates [1/s].
        feedback: "readings" of the sensors, or the leading coordinates of the "estimate".
        reconfigure: which faults to make up for; none by default.
        k_i: feedback of the angles' integral [1/s^3]; none by default.
        interval: between commands [s], for the integral.
        arrange: from the readings or the estimate to the three rates, then the attitude, where they come in another order.

    Source: Chen, Sun, Wu and Jiang (2019), Acta Aeronautica et Astronautica Sinica 40(5):322551.
    Differs: the feedback is multiplied by the inertia, without which the published gains would leave it badly damped.
    """

    inertia: Float[Array, "3 3"]
    axes: Float[Array, "3 w"]
    max_torque: Float[Array, "..."]
    reference: AbstractAttitudeReference
    k_p: float | Array = 0.09  # 1/s^2
    k_d: float | Array = 0.54  # 1/s
    feedback: str = eqx.field(static=True, default="readings")
    reconfigure: AbstractReconfiguration | None = None
    k_i: float | Array | None = None  # 1/s^3
    interval: float | Array = 0.1  # s
    arrange: Callable[[Array], Array] | None = None

    def __check_init__(self) -> None:
        if self.feedback not in FEEDBACK:
            raise ConfigError(f"feedback: expected one of {', '.join(FEEDBACK)}, got {self.feedback!r}")

    @property
    def _reconfigure(self) -> AbstractReconfiguration:
        return self.reconfigure or Unchanged(Adjustment.none(self.axes.shape[1]))

    def init(self) -> Any:
        known = self._reconfigure.init()
        return known if self.k_i is None else (known, jnp.zeros(3))

    def act(self, carry: Any, t: Float[Array, ""], reading: Reading) -> tuple[Any, Float[Array, " w"]]:
        known, integral = (carry, None) if self.k_i is None else carry
        known, adjustment = self._reconfigure.adjust(known, t, reading)
        rate, attitude = self._measured(reading, adjustment)
        torque = self.torque(t, rate, attitude, self.axes @ reading.monitored)
        if self.k_i is None or integral is None:
            return known, self._limited(torque, adjustment)[0]
        effect = -self.inertia * self.k_i  # of each integral, in a column
        command, excess = self._limited(torque + effect @ integral, adjustment)
        more = self.interval * self.reference.tracking_error(attitude, t)[0]
        more = jnp.where(winds_up(self.axes @ excess, effect, more), 0.0, more)
        return (known, integral + more), command

    def _limited(self, torque: Array, adjustment: Adjustment) -> tuple[Array, Array]:
        """Commands to the wheels, and what was cut off them."""
        asked = allocate_torque(self.axes, torque, adjustment)
        command = jnp.clip(asked, -self.max_torque, self.max_torque)
        return command, asked - command

    def torque(
        self,
        t: Float[Array, ""],
        rate: Float[Array, "3"],
        attitude: Float[Array, " size"],
        momentum: Float[Array, "3"],
    ) -> Float[Array, "3"]:
        """The torque on the body [N m] the law asks for, `momentum` being the wheels' together in body axes [N m s]."""
        angles, to_body = self.reference.tracking_error(attitude, t)
        target_rate = to_body @ self.reference.target_rate(t)
        error = rate - target_rate
        forward = to_body @ self.reference.target_acceleration(t) - jnp.cross(error, target_rate)
        gyroscopic = jnp.cross(rate, self.inertia @ rate + momentum)
        return gyroscopic + self.inertia @ (forward - self.k_d * error - self.k_p * angles)

    def _measured(self, reading: Reading, adjustment: Adjustment) -> tuple[Array, Array]:
        if self.feedback == "readings":
            y = reading.y if self.arrange is None else self.arrange(reading.y)
            return y[:3] - adjustment.gyro_bias, y[3:]
        if reading.info is None:
            raise ConfigError("feedback: expected an estimator in the loop for 'estimate', got none")
        mean = reading.info.estimate.mean
        if self.arrange is not None:
            mean = self.arrange(mean)
            return mean[:3], mean[3:]
        return mean[:3], mean[3 : reading.y.shape[0]]
