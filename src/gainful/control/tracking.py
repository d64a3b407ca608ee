"""Following an attitude with wheels."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..running.plant import AbstractController, Reading
from .allocation import Adjustment, allocate_torque
from .base import AbstractAttitudeReference
from .reconfiguration import AbstractReconfiguration, Unchanged

FEEDBACK = ("readings", "estimate")


class TrackingController(AbstractController):
    """Proportional and differential feedback of the tracking error, with the torque the target asks for fed forward.

    With `w` the body rate, `h` the wheels' momentum, `e` the angles relative to the target and `A` from target to body,

        w_e = w - A w_t
        T   = w x (J w + W h) + J (A dw_t/dt - w_e x A w_t) - J (k_d w_e + k_p e)

    which leaves `d w_e/dt = -k_d w_e - k_p e` where the wheels can follow: `k_p = w_n^2`, `k_d = 2 zeta w_n`.
    A reading begins with the three rates, then the attitude.

    Attributes:
        inertia: J (3, 3) [kg m^2].
        axes: W, unit vector of each wheel in body axes (3, w).
        max_torque: largest command to a wheel [N m]; a number or one per wheel.
        reference: the attitude to follow.
        k_p: feedback of the angles [1/s^2].
        k_d: feedback of the rates [1/s].
        feedback: "readings" of the sensors, or the leading coordinates of the "estimate".
        reconfigure: which faults to make up for; none by default.

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

    def __check_init__(self) -> None:
        if self.feedback not in FEEDBACK:
            raise ConfigError(f"feedback: expected one of {', '.join(FEEDBACK)}, got {self.feedback!r}")

    @property
    def _reconfigure(self) -> AbstractReconfiguration:
        return self.reconfigure or Unchanged(Adjustment.none(self.axes.shape[1]))

    def init(self) -> Any:
        return self._reconfigure.init()

    def act(self, carry: Any, t: Float[Array, ""], reading: Reading) -> tuple[Any, Float[Array, " w"]]:
        carry, adjustment = self._reconfigure.adjust(carry, t, reading)
        rate, attitude = self._measured(reading, adjustment)
        torque = self.torque(t, rate, attitude, self.axes @ reading.monitored)
        command = allocate_torque(self.axes, torque, adjustment)
        return carry, jnp.clip(command, -self.max_torque, self.max_torque)

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
            return reading.y[:3] - adjustment.gyro_bias, reading.y[3:]
        if reading.info is None:
            raise ConfigError("feedback: expected an estimator in the loop for 'estimate', got none")
        mean = reading.info.estimate.mean
        return mean[:3], mean[3 : reading.y.shape[0]]
