"""Radial basis networks: functions of the distance to fixed centres, with or without a polynomial tail."""

from __future__ import annotations

import math
import warnings
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float
from scipy.cluster.vq import kmeans2

from ..errors import ConfigError, DataError, ShapeError, did_you_mean
from .distances import squared_distances
from .linear_in_weights import LinearInWeights
from .product_features import ProductFeatures

KERNELS = ("thin-plate", "gaussian")
TAILS = ("none", "affine", "lift")
PLACEMENTS = ("box", "examples", "clusters")


class RadialBasisNetwork(LinearInWeights):
    """A weighted sum of a kernel of the distances between the lifted input and fixed centres.

    ```
    v = lift(u);   d_j = |v - c_j|;   y = W^T [phi(d_1), ..., phi(d_m), tail]
    thin-plate: phi = d^2 ln d / mu,  mu = p/6 max(ln(p/3), 1);     gaussian: phi = exp(-d^2 / (2 width^2))
    tail: nothing, [1; scaled u], or [1; v]
    ```

    `mu` is the value at `d^2 = p/3`, a typical distance in a box of `p` dimensions, so that features are near 1 there. Thin
    plates grow without bound: see `contains`. Without centres the tail alone is an affine or a bilinear regression.

    Attributes:
        weights: one row per feature, centres first (l, outputs).
        centres: in lifted coordinates (m, p).
        lifting: from inputs to `v`.
        width: of the Gaussian kernel, in lifted coordinates.
        kernel: "thin-plate" or "gaussian".
        tail: "none", "affine" or "lift".

    Raises:
        ConfigError: an unknown kernel or tail, a width that is not above 0, or neither centres nor a tail.
        ShapeError: centres or weights that do not fit.

    Source: Chen, Cowan and Grant (1991), IEEE Trans. Neural Netw. 2(2):302-309; Duchon (1977), Lect. Notes Math. 571:85-100,
        for thin plates, which ask for an affine tail.
    Differs: the factor `1 / mu`, which makes weights of one size whatever the number of inputs.

    Example:
        >>> lifting = ProductFeatures([1.0, 1.0], gain=1.0)
        >>> make_radial_basis(lifting, 1, 0, tail="lift").features(jnp.array([2.0, 3.0])).tolist()
        [1.0, 2.0, 3.0, 6.0]
    """

    weights: Float[Array, "l outputs"]
    centres: Float[Array, "m p"]
    lifting: ProductFeatures
    width: Float[Array, ""]
    kernel: Literal["thin-plate", "gaussian"] = eqx.field(static=True, default="thin-plate")
    tail: Literal["none", "affine", "lift"] = eqx.field(static=True, default="none")

    def __check_init__(self) -> None:
        _check_choices(self.kernel, self.tail, self.width)
        if self.centres.ndim != 2 or self.centres.shape[1] != self.lifting.size:
            raise ShapeError(f"centres: expected {self.lifting.size} numbers each, got shape {self.centres.shape}")
        size = len(self.centres) + tail_size(self.lifting, self.tail)
        if size == 0:
            raise ConfigError("centres: expected at least 1 without a tail, got 0")
        if self.weights.ndim != 2 or len(self.weights) != size:
            raise ShapeError(f"weights: expected {size} rows, got shape {self.weights.shape}")

    @property
    def inputs(self) -> int:
        return self.lifting.inputs

    def features(self, u: Float[Array, " inputs"]) -> Float[Array, " l"]:
        lifted = self.lifting.lift(u)
        squares = squared_distances(lifted, self.centres)
        if self.kernel == "thin-plate":
            found = thin_plate(squares) / typical_thin_plate(self.lifting.size)
        else:
            found = jnp.exp(-0.5 * squares / self.width**2)
        ends = {"none": lifted[:0], "affine": lifted[: self.inputs], "lift": lifted}[self.tail]
        return jnp.concatenate([found, jnp.ones(int(self.tail != "none"), found.dtype), ends])

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        return self.lifting.contains(u)

    def cautions(self) -> tuple[str, ...]:
        needed = self.lifting.size + 2
        if self.tail == "none" and self.kernel == "thin-plate" and len(self.centres) < needed:
            said = f"{len(self.centres)} centres represent only a part of the {self.lifting.size} lifted inputs"
            return (f"{said}: take at least {needed}, or a tail",)
        return ()


def thin_plate(square: Float[Array, " *shape"]) -> Float[Array, " *shape"]:
    """`d^2 ln d` of a squared distance; 0 with slope 0 in `d` at `d = 0`."""
    # The inner choice keeps log and its slope finite where the outer one does not look.
    apart = square > 0
    return jnp.where(apart, 0.5 * square * jnp.log(jnp.where(apart, square, 1.0)), 0.0)


def typical_thin_plate(size: int) -> float:
    """Thin plate at a typical distance in a box of some dimensions, bounded from below where those are few."""
    return size / 6.0 * max(math.log(size / 3.0), 1.0)


def tail_size(lifting: ProductFeatures, tail: str) -> int:
    """How many features a tail has."""
    return {"none": 0, "affine": 1 + lifting.inputs, "lift": 1 + lifting.size}[tail]


def make_radial_basis(
    lifting: ProductFeatures,
    outputs: int,
    centres: int = 200,
    *,
    kernel: Literal["thin-plate", "gaussian"] = "thin-plate",
    tail: Literal["none", "affine", "lift"] = "none",
    width: float = 1.0,
    placement: Literal["box", "examples", "clusters"] = "box",
    examples: Float[np.ndarray, "N inputs"] | None = None,
    rng: np.random.Generator | int = 0,
) -> RadialBasisNetwork:
    """A radial basis network that has learned nothing: it gives zero everywhere.

    Args:
        lifting: from inputs to the space of the centres.
        outputs: how many numbers it gives.
        centres: how many; 0 for the tail alone.
        kernel: "thin-plate" or "gaussian".
        tail: "none", "affine" or "lift".
        width: of the Gaussian kernel, in lifted coordinates.
        placement: where the centres are: "box", uniform between -1 and 1 in every lifted coordinate; "examples", drawn from the
            lifted examples; "clusters", the means of `centres` clusters of them.
        examples: inputs, one row each, for the last two.
        rng: random numbers, or a seed of them.

    Raises:
        ConfigError: an argument out of its range.
        DataError: no examples where they are asked for, or fewer than centres.

    Example:
        >>> network = make_radial_basis(ProductFeatures(np.ones(15)), outputs=12)
        >>> network.inputs, network.lifting.size, network.weights.shape
        (15, 120, (200, 12))
    """
    if isinstance(centres, bool) or not isinstance(centres, int | np.integer) or centres < 0:
        raise ConfigError(f"centres: expected a whole number of at least 0, got {centres!r}")
    if placement not in PLACEMENTS:
        raise ConfigError(f"placement: {placement!r} is not known; {did_you_mean(str(placement), PLACEMENTS)}")
    _check_choices(kernel, tail, width)
    placed = _placed(lifting, centres, placement, examples, np.random.default_rng(rng))
    weights = jnp.zeros((centres + tail_size(lifting, tail), outputs))
    return RadialBasisNetwork(weights, jnp.asarray(placed), lifting, jnp.asarray(width, float), kernel, tail)


def _check_choices(kernel: str, tail: str, width: float | Array) -> None:
    for name, value, known in (("kernel", kernel, KERNELS), ("tail", tail, TAILS)):
        if value not in known:
            raise ConfigError(f"{name}: {value!r} is not known; {did_you_mean(str(value), known)}")
    if not isinstance(width, Tracer) and not 0 < float(width) < math.inf:
        raise ConfigError(f"width: expected a number above 0, got {float(width)!r}")


def _placed(
    lifting: ProductFeatures, centres: int, placement: str, examples: np.ndarray | None, rng: np.random.Generator
) -> np.ndarray:
    if placement == "box" or centres == 0:
        return rng.uniform(-1.0, 1.0, (centres, lifting.size))
    if examples is None or len(examples) < centres:
        came = "none" if examples is None else len(examples)
        raise DataError(f"examples: expected at least {centres}, one per centre, got {came}")
    lifted = np.asarray(jax.vmap(lifting.lift)(jnp.asarray(examples, float)))
    chosen = lifted[rng.choice(len(lifted), centres, replace=False)]
    if placement == "examples":
        return chosen
    with warnings.catch_warnings():
        # A cluster that ends up with no example keeps its place.
        warnings.filterwarnings("ignore", message="One of the clusters is empty")
        return kmeans2(lifted, chosen, minit="matrix", missing="warn")[0]
