"""Inputs of a high-order network: scaled signals and their products."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, ShapeError

_BEYOND = 1.5
"""Ranges from the centre within which features that grow without bound are still to be believed."""


class ProductFeatures(eqx.Module):
    """Signals in units of their range, then all products of two different ones, in lexicographic order; no squares.

    ```
    zt = gain (z - centre) / scale;   v = [zt; zt_i zt_j for i < j]
    ```

    A regression on `v` is bilinear. A small gain makes a function of the distance to far centres nearly so.

    Attributes:
        scale: range of each signal, in its unit (d,).
        gain: size of a scaled signal at the end of its range.
        centre: of each signal; 0 by default (d,).
        products: whether the products are taken; `v = zt` without.

    Raises:
        ConfigError: a scale that is not above 0, or a gain that is not.
        ShapeError: a scale or a centre that is not one number per signal.

    Source: Kosmatopoulos, Polycarpou, Christodoulou and Ioannou (1995), IEEE Trans. Neural Netw. 6(2):422-431, for high-order
        networks.

    Example:
        >>> ProductFeatures([2.0, 1.0, 4.0], gain=1.0).lift(jnp.array([1.0, 2.0, 4.0])).tolist()
        [0.5, 2.0, 1.0, 1.0, 0.5, 2.0]
    """

    scale: Float[Array, " d"]
    gain: Float[Array, ""]
    centre: Float[Array, " d"]
    products: bool = eqx.field(static=True)

    def __init__(
        self,
        scale: Float[np.ndarray | Array, " d"] | list[float],
        gain: float | Float[Array, ""] = 0.3,
        centre: Float[np.ndarray | Array, " d"] | list[float] | None = None,
        products: bool = True,
    ) -> None:
        self.scale = jnp.asarray(scale, float)
        self.gain = jnp.asarray(gain, float)
        self.centre = jnp.zeros_like(self.scale) if centre is None else jnp.asarray(centre, float)
        self.products = products

    def __check_init__(self) -> None:
        for name, values in (("scale", self.scale), ("centre", self.centre)):
            if values.ndim != 1 or values.shape != self.scale.shape:
                raise ShapeError(f"{name}: expected one number per signal, got shape {values.shape}")
        for name, values in (("scale", self.scale), ("gain", self.gain)):
            if not isinstance(values, Tracer) and not bool(jnp.all((values > 0) & jnp.isfinite(values))):
                raise ConfigError(f"{name}: expected numbers above 0, got {np.asarray(values).tolist()!r}")

    @property
    def inputs(self) -> int:
        """`d`, how many signals there are."""
        return self.scale.shape[0]

    @property
    def size(self) -> int:
        """`p`, how many numbers `v` has."""
        d = self.inputs
        return d + d * (d - 1) // 2 if self.products else d

    def scaled(self, z: Float[Array, " d"]) -> Float[Array, " d"]:
        """`zt`."""
        return self.gain * (z - self.centre) / self.scale

    def lift(self, z: Float[Array, " d"]) -> Float[Array, " p"]:
        """`v`."""
        scaled = self.scaled(z)
        if not self.products:
            return scaled
        first, second = np.triu_indices(self.inputs, k=1)
        return jnp.concatenate([scaled, scaled[first] * scaled[second]])

    def contains(self, z: Float[Array, " d"]) -> Bool[Array, ""]:
        """Whether no signal is farther from its centre than one and a half times its range."""
        return jnp.all(jnp.abs(z - self.centre) <= _BEYOND * self.scale)


def product_features_of(
    examples: Float[np.ndarray, "N d"], *, gain: float = 0.3, products: bool = True
) -> ProductFeatures:
    """Features whose scales are half the range of examples, about its middle.

    Args:
        examples: one row per example; a signal that does not vary has a scale of 1.
        gain: size of a scaled signal at either end of the range.
        products: whether the products are taken.
    """
    examples = np.asarray(examples, float)
    low, high = examples.min(axis=0), examples.max(axis=0)
    return ProductFeatures(np.where(high > low, 0.5 * (high - low), 1.0), gain, 0.5 * (low + high), products)
