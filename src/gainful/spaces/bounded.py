"""Numbers that keep to bounds: stored as themselves, moved and compared in coordinates without bounds.

The estimate of a bounded parameter can never leave its range, and its interval is lopsided near a bound, as it should be.
Covariances are in the unbounded coordinate: for `Positive` that is the logarithm, so a small sigma is a relative error.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ModelError
from .base import AbstractSpace

_LONGEST = 80.0
"""Moves of the unbounded coordinate beyond this change nothing a float32 could tell."""


class Positive(AbstractSpace):
    """A number above zero, with `minus(y, x) = log(y / x)`.

    Example:
        >>> import jax.numpy as jnp
        >>> float(Positive("mass", "kg").plus(jnp.array([2.0]), jnp.array([0.0]))[0])
        2.0
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, name: str, unit: str = "1") -> None:
        self.names, self.units = (name,), (unit,)
        self.tangent_names, self.tangent_units = (f"log({name})",), ("1",)

    @property
    def curved(self) -> bool:
        return False

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return (self,)

    def plus(self, x: Float[Array, "1"], d: Float[Array, "1"]) -> Float[Array, "1"]:
        # However long the move, the number stays one: neither zero nor infinite.
        limits = jnp.finfo(x.dtype)
        return jnp.clip(x * jnp.exp(jnp.clip(d, -_LONGEST, _LONGEST)), limits.tiny, limits.max)

    def minus(self, y: Float[Array, "1"], x: Float[Array, "1"]) -> Float[Array, "1"]:
        return jnp.log(y / x)

    def velocity(self, x: Float[Array, "1"], rate: Float[Array, "1"]) -> Float[Array, "1"]:
        return rate

    def error_rate(
        self, x: Float[Array, "1"], d: Float[Array, "1"], moved: Float[Array, "1"], own: Float[Array, "1"]
    ) -> Float[Array, "1"]:
        return moved / self.plus(x, d) - own / x

    def defect(self, x: Float[Array, "1"]) -> Float[Array, "1"]:
        return jnp.where(x > 0, 0.0, x - 1.0)


class Interval(AbstractSpace):
    """A number between two bounds, with `minus(y, x) = logit(y) - logit(x)` over the interval.

    Example:
        >>> import jax.numpy as jnp
        >>> float(Interval("efficiency", 0.0, 1.0).plus(jnp.array([0.5]), jnp.array([1e9]))[0]) <= 1.0
        True
    """

    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    tangent_names: tuple[str, ...] = eqx.field(static=True)
    tangent_units: tuple[str, ...] = eqx.field(static=True)
    lower: float = eqx.field(static=True)
    upper: float = eqx.field(static=True)

    def __init__(self, name: str, lower: float, upper: float, unit: str = "1") -> None:
        if not lower < upper:
            raise ModelError(f"bounds of {name!r}: expected lower < upper, got {lower} and {upper}")
        self.names, self.units = (name,), (unit,)
        self.tangent_names, self.tangent_units = (f"logit({name})",), ("1",)
        self.lower, self.upper = float(lower), float(upper)

    @property
    def curved(self) -> bool:
        return False

    @property
    def parts(self) -> tuple[AbstractSpace, ...]:
        return (self,)

    def _logit(self, x: Float[Array, "1"]) -> Float[Array, "1"]:
        margin = self._margin(x)
        return jnp.log(jnp.maximum(x - self.lower, margin)) - jnp.log(jnp.maximum(self.upper - x, margin))

    def _margin(self, x: Float[Array, "1"]) -> float:
        """A step that still tells a number apart from the bounds."""
        size = max(abs(self.lower), abs(self.upper), self.upper - self.lower)
        return 4.0 * float(jnp.finfo(x.dtype).eps) * size

    def plus(self, x: Float[Array, "1"], d: Float[Array, "1"]) -> Float[Array, "1"]:
        share = 1.0 / (1.0 + jnp.exp(-jnp.clip(self._logit(x) + d, -_LONGEST, _LONGEST)))
        margin = self._margin(x)
        return jnp.clip(self.lower + (self.upper - self.lower) * share, self.lower + margin, self.upper - margin)

    def minus(self, y: Float[Array, "1"], x: Float[Array, "1"]) -> Float[Array, "1"]:
        return self._logit(y) - self._logit(x)

    def velocity(self, x: Float[Array, "1"], rate: Float[Array, "1"]) -> Float[Array, "1"]:
        return rate

    def error_rate(
        self, x: Float[Array, "1"], d: Float[Array, "1"], moved: Float[Array, "1"], own: Float[Array, "1"]
    ) -> Float[Array, "1"]:
        return moved * self._slope(self.plus(x, d)) - own * self._slope(x)

    def _slope(self, x: Float[Array, "1"]) -> Float[Array, "1"]:
        return 1.0 / (x - self.lower) + 1.0 / (self.upper - x)

    def defect(self, x: Float[Array, "1"]) -> Float[Array, "1"]:
        inside = (x > self.lower) & (x < self.upper)
        return jnp.where(inside, 0.0, x - 0.5 * (self.lower + self.upper))
