"""What a controller makes of an estimate of its own faults."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, did_you_mean
from ..running.plant import Reading
from .allocation import Adjustment


class AbstractReconfiguration(eqx.Module):
    """Decides, each time a controller acts, which faults it makes up for."""

    @abc.abstractmethod
    def init(self) -> Any:
        """What it remembers at the start."""

    @abc.abstractmethod
    def adjust(self, carry: Any, t: Float[Array, ""], reading: Reading) -> tuple[Any, Adjustment]:
        """What it remembers from now on, and the faults to make up for."""


class Unchanged(AbstractReconfiguration):
    """Makes up for nothing but what is said once and for all.

    Attributes:
        adjustment: the known faults, such as a wheel that is off.
    """

    adjustment: Adjustment

    def init(self) -> None:
        return None

    def adjust(self, carry: None, t: Float[Array, ""], reading: Reading) -> tuple[None, Adjustment]:
        return None, self.adjustment


class EstimatedFaults(AbstractReconfiguration):
    """Makes up for the faults that the estimator in the loop carries as states.

    Each fault is a multiple of a state of the estimate; made by `EstimatedFaults.named`.

    Attributes:
        offset: torque a wheel adds of itself, per estimated state (w, size).
        loss: share of its command a wheel does not carry out, likewise (w, size).
        gyro_bias: what the gyro reads too much, likewise (3, size).
        bound: largest offset [N m] and loss believed; an estimate beyond is cut for control, not in the filter.
    """

    offset: Float[Array, "w size"]
    loss: Float[Array, "w size"]
    gyro_bias: Float[Array, "3 size"]
    bound: tuple[float, float] = (0.1, 1.0)  # N m, share

    @classmethod
    def named(
        cls,
        states: Sequence[str],
        wheels: int,
        *,
        offset: Mapping[str, tuple[int, float]] | None = None,
        loss: Mapping[str, tuple[int, float]] | None = None,
        gyro_bias: Mapping[str, tuple[int, float]] | None = None,
    ) -> EstimatedFaults:
        """The faults by the names of the states that estimate them.

        Args:
            states: names of the estimated state's coordinates, `model.space.names`.
            wheels: how many there are.
            offset: by name, the wheel and the offset per unit of the state. A bias of an input torque is what the input
                reads too much, so the wheel adds its negative: `{"bias_torque_x": (0, -1.0)}`.
            loss: by name, the wheel and the loss per unit.
            gyro_bias: by name, the axis and the bias per unit.

        Raises:
            ModelError: a name that is not a state, or a wheel or axis that is not there.
        """
        return cls(
            _rows(states, offset or {}, wheels),
            _rows(states, loss or {}, wheels),
            _rows(states, gyro_bias or {}, 3),  # body axes
        )

    def init(self) -> None:
        return None

    def adjust(self, carry: None, t: Float[Array, ""], reading: Reading) -> tuple[None, Adjustment]:
        if reading.info is None:
            raise ModelError("reconfigure: expected an estimator in the loop, got none")
        mean = reading.info.estimate.mean
        offset, loss = (
            jnp.clip(rows @ mean, -most, most) for rows, most in zip((self.offset, self.loss), self.bound, strict=True)
        )
        return None, Adjustment(offset, loss, jnp.ones_like(loss), self.gyro_bias @ mean)


def _rows(states: Sequence[str], given: Mapping[str, tuple[int, float]], rows: int) -> Array:
    out = np.zeros((rows, len(states)))
    for name, (row, factor) in given.items():
        if name not in states:
            raise ModelError(f"state {name!r} is not one of the model's; {did_you_mean(name, states)}")
        if not 0 <= row < rows:
            raise ModelError(f"state {name!r}: expected a wheel or axis from 0 to {rows - 1}, got {row!r}")
        out[row, list(states).index(name)] = factor
    return jnp.asarray(out)
