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
    b <- exp(-dt / time_constant) b + w,   or   b <- b + dt r + w,  r <- r + w_r   for one that drifts
    ```

    A fault with a `rate_sigma` drifts: the rate `r` at which it does is a further state, called `<kind>_<signal>_rate`.

    Attributes:
        kind: "offset" or "loss" of an input, "bias" or "scale" of an output.
        signal: name of the input, or of the output's degree of freedom.
        walk: how fast the fault may change: sigma per square root of a second, or per step.
        sigma: standard deviation before the first row, in the state's unit; needed by `extend_prior` only.
        bound: largest physical size; without one, 1 for "loss" and "scale" and infinite for the others.
        time_constant: of a fault that fades out [s]; infinite for one that stays.
        per_step: whether `walk` is per step, however long, in place of per square root of a second.
        rate_sigma: standard deviation of the rate before the first row, in the state's unit per second; no rate if None.
        rate_walk: how fast the rate may change: sigma per square root of a second; 0 for a straight ramp.

    Example:
        >>> Fault("loss", "wheel_x", walk=2e-4, sigma=1e-2).name
        'loss_wheel_x'
        >>> Fault("bias", "gyro", sigma=0.1, rate_sigma=1e-3).names
        ('bias_gyro', 'bias_gyro_rate')
    """

    kind: str
    signal: str
    walk: float = 0.0
    sigma: float | None = None
    bound: float | None = None
    time_constant: float = math.inf
    per_step: bool = False
    rate_sigma: float | None = None
    rate_walk: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in EFFECTS:
            raise ModelError(f"fault kind: {self.kind!r} is not one; {did_you_mean(str(self.kind), EFFECTS)}")
        at_least_zero = ("walk", "sigma", "rate_sigma", "rate_walk")
        for role, value in ((role, getattr(self, role)) for role in at_least_zero):
            if value is not None and not (isinstance(value, (int, float)) and 0 <= value < math.inf):
                raise ModelError(f"{role} of {self.name!r}: expected a number of at least 0, got {value!r}")
        for role, value in (("bound", self.bound), ("time_constant", self.time_constant)):
            if value is not None and not (isinstance(value, (int, float)) and value > 0):
                raise ModelError(f"{role} of {self.name!r}: expected a number above 0, got {value!r}")
        if self.rate_sigma is None and self.rate_walk:
            raise ModelError(f"rate_walk of {self.name!r}: expected with rate_sigma, which makes the fault drift")
        if self.drifts and math.isfinite(self.time_constant):
            raise ModelError(
                f"time_constant of {self.name!r}: expected a fault that fades out or one that drifts, not both"
            )

    @property
    def name(self) -> str:
        """Name of its state."""
        return f"{self.kind}_{self.signal}"

    @property
    def drifts(self) -> bool:
        """Whether its rate is a state too."""
        return self.rate_sigma is not None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its states: its size and, if it drifts, its rate."""
        return (self.name, f"{self.name}_rate") if self.drifts else (self.name,)

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
    rate_sigma: float | None
    rate_walk: float


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
