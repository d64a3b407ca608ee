"""The laws of a space."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..spaces import AbstractSpace
from .comparisons import assert_close, assert_true

FAR = 1e3
"""A move, in tangent units, that leaves any bounded set unless the space keeps it inside."""


def point_of(space: AbstractSpace) -> Float[Array, " size"]:
    """Some point of a space: the first simple one with no defect, found part by part.

    Raises:
        AssertionError: none of the candidates is a point; give one to the check yourself.

    Example:
        >>> from gainful.spaces import Quaternion
        >>> point_of(Quaternion("q")).tolist()
        [0.0, 0.0, 0.0, 1.0]
    """
    parts = space.parts
    if len(parts) > 1:
        return jnp.concatenate([point_of(part) for part in parts])
    zero = jnp.zeros(space.size)
    candidates = [zero, zero.at[-1].set(1.0), zero - space.defect(zero), jnp.ones(space.size) / np.sqrt(space.size)]
    for candidate in candidates:
        if not np.any(np.asarray(space.defect(candidate))):
            return candidate
    raise AssertionError(f"{type(space).__name__}: found no point without a defect; give one as `point`")


def check_space(
    space: AbstractSpace, key: Array, *, point: Any = None, draws: int = 16, tolerance: float = 1e-11
) -> None:
    """Raise unless a space keeps its laws at random points.

    ```
    plus(x, 0) = x        minus(plus(x, d), x) = d for small d        plus(x, minus(y, x)) = y
    ```
    Moves however long end in the space, the coordinates are smooth with unit slope at the point itself, a batch gives
    what its members give, and the declared names fit the sizes.

    Args:
        space: the space.
        key: random key; the same key tries the same points.
        point: a point to start from; searched for if not given.
        draws: how many points and moves to try.
        tolerance: rounding allowed, in tangent units.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> import jax
        >>> from gainful.spaces import Circle
        >>> check_space(Circle("heading"), jax.random.key(0))
        >>> class Unwrapped(Circle):
        ...     def minus(self, y, x):
        ...         return y - x
        >>> check_space(Unwrapped("heading"), jax.random.key(0))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        AssertionError: Unwrapped: minus(plus(x, d), x) = d: expected ...
    """
    name = type(space).__name__
    _check_names(space, name)
    origin = point_of(space) if point is None else jnp.asarray(point, dtype=float)
    assert_true(origin.shape == (space.size,), f"{name}: expected a point of {space.size} numbers, got {origin.shape}")
    small, wide, far = (
        scale * jax.random.normal(k, (draws, space.dof))
        for k, scale in zip(jax.random.split(key, 3), (0.3, 2.0, FAR), strict=True)
    )
    found = jax.jit(lambda: _measure(space, origin, small, wide, far))()
    zero = np.zeros_like(wide)
    for law, actual, expected in (
        ("plus(x, 0) = x", found["rest"], zero),
        ("minus(x, x) = 0", found["self"], zero),
        ("minus(plus(x, d), x) = d", found["back"], small),
        ("plus(x, minus(y, x)) = y", found["reached"], zero),
        ("slope of minus(plus(x, d), x) at d = 0 is 1", found["slope"], np.tile(np.eye(space.dof), (draws, 1, 1))),
        ("vmap of plus = loop", found["alone"][0], found["batch"][0]),
        ("vmap of minus = loop", found["alone"][1], found["batch"][1]),
        ("plus acts part by part", found["parts"][0], found["alone"][0]),
        ("minus acts part by part", found["parts"][1], found["alone"][1]),
    ):
        assert_close(actual, expected, f"{name}: {law}", tolerance=tolerance)
    for length, (points, defects) in found["moved"].items():
        inside = np.isfinite(points) & (np.asarray(defects) == 0)
        assert_true(np.all(inside), f"{name}: a {length} move left the space: {_worst(points, defects, inside)}")


def _measure(space: AbstractSpace, origin: Array, small: Array, wide: Array, far: Array) -> dict[str, Any]:
    """Everything the laws speak of, in one function so that it compiles once."""
    plus, minus, defect = jax.vmap(space.plus), jax.vmap(space.minus), jax.vmap(space.defect)
    start = jnp.broadcast_to(origin, (len(wide), space.size))
    x, y = plus(start, wide), plus(start, -wide[::-1])
    near, gone, home = plus(x, small), plus(x, far), plus(x, -far)
    still = jnp.zeros(space.dof)
    parts_plus, parts_minus, i, j = [], [], 0, 0
    for part in space.parts:
        here, there = slice(i, i + part.size), slice(j, j + part.dof)
        parts_plus.append(part.plus(x[0, here], small[0, there]))
        parts_minus.append(part.minus(y[0, here], x[0, here]))
        i, j = i + part.size, j + part.dof
    return {
        "rest": minus(plus(x, jnp.zeros_like(wide)), x),
        "self": minus(x, x),
        "back": minus(near, x),
        "reached": minus(plus(x, minus(y, x)), y),
        "slope": jax.vmap(lambda at: jax.jacfwd(lambda d: space.minus(space.plus(at, d), at))(still))(x),
        "alone": (space.plus(x[0], small[0]), space.minus(y[0], x[0])),
        "batch": (near[0], minus(y, x)[0]),
        "parts": (jnp.concatenate(parts_plus), jnp.concatenate(parts_minus)),
        "moved": {
            "short": (near, defect(near)),
            "long": (jnp.concatenate([gone, home]), jnp.concatenate([defect(gone), defect(home)])),
        },
    }


def _check_names(space: AbstractSpace, name: str) -> None:
    assert_true(space.size >= 1 and space.dof >= 1, f"{name}: expected at least one name and one tangent name")
    for count, units, role in (
        (space.size, space.units, "units"),
        (space.dof, space.tangent_units, "tangent_units"),
    ):
        assert_true(len(units) == count, f"{name}: expected {count} {role}, got {units}")
    for count, parts, role in (
        (space.size, [part.size for part in space.parts], "coordinates"),
        (space.dof, [part.dof for part in space.parts], "degrees of freedom"),
    ):
        assert_true(sum(parts) == count, f"{name}: expected parts with {count} {role} together, got {parts}")
    for names, role in ((space.names, "names"), (space.tangent_names, "tangent_names")):
        assert_true(len(set(names)) == len(names), f"{name}: expected distinct {role}, got {names}")


def _worst(points: Array, defects: Array, inside: np.ndarray) -> str:
    row = int(np.argmin(np.all(inside, axis=1)))
    return f"{np.asarray(points)[row].tolist()} has the defect {np.asarray(defects)[row].tolist()}"
