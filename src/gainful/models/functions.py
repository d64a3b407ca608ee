"""Models from a user's plain functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, did_you_mean
from ..spaces import AbstractSpace, SpaceLike, make_space
from .base import Instant

EXTRA_ARGUMENTS = ("dt", "p")
"""What a model function may ask for by name after `x, u, t`: the time step [s] and the parameters."""


class Function(eqx.Module):
    """A user's function of `(x, u, t)` and, if it names them, `dt` and `p`.

    Attributes:
        fn: the function itself.
        asks: which of `dt` and `p` it takes.
    """

    fn: Callable[..., Any]
    arity: int = eqx.field(static=True)
    asks: tuple[str, ...] = eqx.field(static=True)

    def __init__(self, fn: Callable[..., Any], role: str) -> None:
        if not callable(fn):
            raise ModelError(f"{role}: expected a function of (x, u, t), got {fn!r}")
        names = [
            name
            for name, parameter in inspect.signature(fn).parameters.items()
            if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.POSITIONAL_ONLY, parameter.KEYWORD_ONLY)
            and (parameter.default is parameter.empty or name in EXTRA_ARGUMENTS)
        ]
        extra = [name for name in names if name in EXTRA_ARGUMENTS]
        plain = [name for name in names if name not in EXTRA_ARGUMENTS]
        if not 1 <= len(plain) <= 3:
            hint = f" ({plain[3]!r}: {did_you_mean(plain[3], EXTRA_ARGUMENTS)})" if len(plain) > 3 else ""
            raise ModelError(
                f"{role}: expected a function of x, u and t, then optionally dt and p by name; "
                f"got the arguments {names}{hint}"
            )
        self.fn, self.arity, self.asks = fn, len(plain), tuple(extra)

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        """What the function says of itself along these states, if it is an object that does."""
        told = getattr(self.fn, "cautions", None)
        return () if told is None else told(x)

    def __call__(self, x: Array, u: Array, t: Array, dt: Array, p: dict[str, Array]) -> Any:
        offered = {"dt": dt, "p": p}
        return self.fn(*(x, u, t)[: self.arity], **{name: offered[name] for name in self.asks})


class Matrix(eqx.Module):
    """A matrix given as numbers or as a function of `(x, u, t)`."""

    value: Array | None
    fn: Function | None

    def __init__(self, given: Any, role: str) -> None:
        if callable(given):
            self.value, self.fn = None, Function(given, role)
            return
        try:
            array = jnp.asarray(given, dtype=float)
        except (TypeError, ValueError) as problem:
            raise ModelError(f"{role}: expected numbers or a function, got {given!r}") from problem
        if array.ndim < 2:
            # A scalar or a vector is the diagonal: the commonest way to write a covariance.
            array = jnp.diag(jnp.atleast_1d(array))
        self.value, self.fn = array, None

    def __call__(self, x: Array, u: Array, t: Array, dt: Array, p: dict[str, Array]) -> Array:
        if self.fn is not None:
            return jnp.asarray(self.fn(x, u, t, dt, p), x.dtype)
        assert self.value is not None
        return self.value.astype(x.dtype)


class Sensor(eqx.Module):
    """One sensor: what it reads and how noisy it is.

    Attributes:
        name: used in messages, gates and plots.
        output: space of its reading.
        h: the reading without noise, as a function of the state.
        noise: its covariance.
    """

    name: str = eqx.field(static=True)
    output: AbstractSpace
    h: Function
    noise: Matrix


def sensor(
    name: str, h: Callable[..., Any], *, outputs: SpaceLike | None = None, R: Any, prefix: str | None = None
) -> Sensor:
    """A sensor of a model with several.

    Args:
        name: of the sensor.
        h: its reading `h(x, u, t)`; may also ask for `dt` and `p` by name.
        outputs: names and units of its signals (see `make_space`); by default one number called as the sensor.
        R: covariance of its noise: a matrix, a vector or scalar of variances, or a function of `(x, u, t)`.
        prefix: of made-up signal names; the sensor's name by default.
    """
    space = make_space([name] if outputs is None else outputs, prefix=prefix or name)
    return Sensor(name, space, Function(h, f"h of sensor {name!r}"), Matrix(R, f"R of sensor {name!r}"))


def make_sensors(h: Any, outputs: SpaceLike | None, R: Any, sensors: Sequence[Sensor] | None) -> tuple[Sensor, ...]:
    """The sensors of a model given either `h, outputs, R` or `sensors`."""
    if sensors is not None:
        if h is not None or outputs is not None or R is not None:
            raise ModelError("sensors: give either h, outputs and R, or sensors, not both")
        names = [part.name for part in sensors]
        signals = [signal for part in sensors for signal in part.output.names]
        for kind, found in (("sensor", names), ("signal", signals)):
            twice = sorted({name for name in found if found.count(name) > 1})
            if twice:
                raise ModelError(f"sensors: expected distinct {kind} names, got {twice[0]!r} twice")
        if not sensors:
            raise ModelError("sensors: expected at least one, got an empty list")
        return tuple(sensors)
    missing = [name for name, value in (("h", h), ("outputs", outputs), ("R", R)) if value is None]
    if missing:
        raise ModelError(f"{missing[0]}: missing; a model needs h, outputs and R, or sensors")
    assert outputs is not None
    return (sensor("y", h, outputs=outputs, R=R, prefix="y"),)


def as_point(value: Any, size: int, dtype: Any, role: str) -> Float[Array, " size"]:
    """What a model function returned, as a point with `size` numbers."""
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError) as problem:
        count = "1 number" if size == 1 else f"{size} numbers"
        raise ModelError(f"{role}: expected {count}, got {value!r}") from problem
    if jnp.iscomplexobj(array):
        raise ModelError(f"{role}: expected real numbers, got complex ones")
    array = array.astype(dtype)
    if array.shape != (size,):
        raise ModelError(f"{role}: expected shape ({size},), got {array.shape}")
    return array


def at(when: Instant, x: Array, p: dict[str, Array]) -> tuple[Array, Array, Array, Array, dict[str, Array]]:
    """The arguments of a model function, in order."""
    return x, when.u, when.t, when.dt, jax.tree.map(lambda leaf: leaf.astype(x.dtype), p)
