"""What may go wrong, in words and numbers."""

from __future__ import annotations

import dataclasses
import math
from typing import TypedDict, Unpack

from ..errors import ModelError, did_you_mean

EFFECTS = {
    "offset": ("input", 0.0),
    "loss": ("input", -1.0),
    "bias": ("output", 0.0),
    "scale": ("output", 1.0),
}
"""By kind: the side it is on, and the gain of a fault of size `b`, which adds `gain b s` to its signal `s`; `b` if 0."""


@dataclasses.dataclass(frozen=True)
class Fault:
    """One fault a model may have; its state is called `<kind>_<signal>` and is 0 where there is none.

    ```
    offset: the plant gets u + b      loss:  the plant gets (1 - b) u
    bias:   the sensor reads h + b    scale: the sensor reads (1 + b) h
    b <- exp(-dt / time_constant) b + w
    ```

    Attributes:
        kind: "offset" or "loss" of an input, "bias" or "scale" of an output.
        signal: name of the input, or of the output's degree of freedom.
        walk: how fast the fault may change: sigma per square root of a second, or per step.
        sigma: standard deviation before the first row, in the state's unit; needed by `extend_prior` only.
        bound: largest physical size; without one, 1 for "loss" and "scale" and infinite for the others.
        time_constant: of a fault that fades out [s]; infinite for one that stays.
        per_step: whether `walk` is per step, however long, in place of per square root of a second.

    Example:
        >>> Fault("loss", "wheel_x", walk=2e-4, sigma=1e-2).name
        'loss_wheel_x'
    """

    kind: str
    signal: str
    walk: float = 0.0
    sigma: float | None = None
    bound: float | None = None
    time_constant: float = math.inf
    per_step: bool = False

    def __post_init__(self) -> None:
        if self.kind not in EFFECTS:
            raise ModelError(f"fault kind: {self.kind!r} is not one; {did_you_mean(str(self.kind), EFFECTS)}")
        for role, value in (("walk", self.walk), ("sigma", self.sigma)):
            if value is not None and not (isinstance(value, (int, float)) and 0 <= value < math.inf):
                raise ModelError(f"{role} of {self.name!r}: expected a number of at least 0, got {value!r}")
        for role, value in (("bound", self.bound), ("time_constant", self.time_constant)):
            if value is not None and not (isinstance(value, (int, float)) and value > 0):
                raise ModelError(f"{role} of {self.name!r}: expected a number above 0, got {value!r}")

    @property
    def name(self) -> str:
        """Name of its state."""
        return f"{self.kind}_{self.signal}"

    @property
    def largest(self) -> float:
        """The bound, or what stands for it where none was given."""
        relative = EFFECTS[self.kind][1] != 0
        return self.bound if self.bound is not None else 1.0 if relative else math.inf


class FaultOptions(TypedDict, total=False):
    """What may be said of a fault beside its kind and signal, see `Fault`."""

    walk: float
    sigma: float | None
    bound: float | None
    time_constant: float
    per_step: bool


def actuator_offset(signal: str, **options: Unpack[FaultOptions]) -> Fault:
    """An input that reaches the plant shifted: the plant gets `u + b` (see `Fault` for the options)."""
    return Fault("offset", signal, **options)


def loss_of_effectiveness(signal: str, **options: Unpack[FaultOptions]) -> Fault:
    """An input that reaches the plant weakened: the plant gets `(1 - b) u` (see `Fault` for the options)."""
    return Fault("loss", signal, **options)


def sensor_bias(signal: str, **options: Unpack[FaultOptions]) -> Fault:
    """An output that is read shifted: `h + b` (see `Fault` for the options)."""
    return Fault("bias", signal, **options)


def sensor_scale_error(signal: str, **options: Unpack[FaultOptions]) -> Fault:
    """An output that is read magnified: `(1 + b) h` (see `Fault` for the options)."""
    return Fault("scale", signal, **options)
