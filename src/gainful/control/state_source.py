"""Where a controller takes the state from."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, Status
from ..running.plant import Reading

FEEDBACK = ("readings", "estimate")


class StateSource(eqx.Module):
    """The state a controller acts on: the readings of the sensors, or the mean of the estimator in the loop.

    Attributes:
        feedback: "readings" or "estimate".
        size: how many of its leading numbers are taken, such as the plant's own before estimated biases; all by default.
        convert: from these numbers to the controller's state, such as `AngleState`; the numbers themselves by default.

    Raises:
        ConfigError: another feedback; later, an estimate without an estimator in the loop.
    """

    feedback: str = eqx.field(static=True, default="readings")
    size: int | None = eqx.field(static=True, default=None)
    convert: Callable[[Array], Array] | None = None

    def __check_init__(self) -> None:
        if self.feedback not in FEEDBACK:
            raise ConfigError(f"feedback: expected one of {', '.join(FEEDBACK)}, got {self.feedback!r}")

    def __call__(self, reading: Reading) -> Float[Array, " n"]:
        """The state; what is missing of a reading holds its last value."""
        return self._converted(self.numbers(reading))

    def fresh(self, reading: Reading) -> Float[Array, " n"]:
        """The state as far as it was measured at this moment, NaN elsewhere."""
        return self._converted(jnp.where(self._seen(reading), self.numbers(reading), jnp.nan))

    def numbers(self, reading: Reading) -> Float[Array, " size"]:
        """The readings or the mean before they are converted."""
        if self.feedback == "readings":
            return reading.y[: self.size]
        if reading.info is None:
            raise ConfigError("feedback: expected an estimator in the loop for 'estimate', got none")
        return reading.info.estimate.mean[: self.size]

    def _seen(self, reading: Reading) -> Bool[Array, "..."]:
        if self.feedback == "estimate":
            assert reading.info is not None
            return jnp.asarray(reading.info.status) == Status.ok
        return jnp.asarray(True) if reading.seen is None else reading.seen[: self.size]

    def _converted(self, numbers: Array) -> Array:
        return numbers if self.convert is None else self.convert(numbers)
