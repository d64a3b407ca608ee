"""Whether a correction has lately been of use, asked of the measurements alone."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError


class Usefulness(eqx.Module):
    """What the gate remembers.

    Attributes:
        mean: running mean of what the correction took off the next squared innovation.
        count: how often that was looked at.
    """

    mean: Float[Array, ""]
    count: Float[Array, ""]


class OnlineGate(eqx.Module):
    """Lets a correction pass while it makes the next measurement better predicted.

    ```
    s = |L^-1 (y - h(A x))|^2 - |L^-1 (y - h(A (x + E)))|^2,  S = L L^T;  m <- (1 - 1/w) m + s / w;  open while m > 0
    ```

    Whether a correction passes or not, it is asked what it would have done, so a closed gate can open again.

    Attributes:
        window: `w`, how many measurements it looks back over, at least 1.
        least: measurements before it may open.
    """

    window: float = 30.0
    least: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        if isinstance(self.window, (int, float)) and not self.window >= 1:
            raise ConfigError(f"window: expected a number of at least 1, got {self.window!r}")
        if isinstance(self.least, bool) or not isinstance(self.least, int) or self.least < 0:
            raise ConfigError(f"least: expected a whole number of at least 0, got {self.least!r}")

    def init(self) -> Usefulness:
        """Nothing was looked at yet."""
        return Usefulness(jnp.array(0.0), jnp.array(0.0))

    def judged(
        self,
        memory: Usefulness,
        residual: Float[Array, " m"],
        predicted: Float[Array, " m"],
        inverse: Float[Array, "m m"],
        trusted: Float[Array, ""],
    ) -> Usefulness:
        """What it remembers after one more measurement.

        Args:
            memory: before it.
            residual: the innovation.
            predicted: how the last correction moves the predicted measurement.
            inverse: inverse root of the innovation's covariance.
            trusted: 1 where the prediction was made with the correction, 0 where without.
        """
        without = inverse @ (residual + trusted * predicted)
        taken = inverse @ predicted
        # The difference of the two squares, and exactly 0 for a correction of 0.
        gain = jnp.sum(taken * (2 * without - taken))
        mean = (1 - 1 / self.window) * memory.mean + gain / self.window
        return Usefulness(mean.astype(memory.mean.dtype), memory.count + 1)

    def is_open(self, memory: Usefulness) -> Bool[Array, ""]:
        """Whether a correction may pass now."""
        return (memory.mean > 0) & (memory.count >= self.least)
