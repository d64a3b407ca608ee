"""Models that predict a signal's next sample from rows before it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError
from ..networks import AbstractNetwork
from .equations import later
from .free_run import longest_stretch


class Lags(eqx.Module):
    """Which rows a network is told to predict a signal.

    Attributes:
        of: the signal.
        own: how many of its own rows before.
        inputs: how many rows of each other signal.
        delay: rows from the newest of these to the one predicted; 0 where an input acts at once.

    Raises:
        ConfigError: numbers out of their range, or the signal among its inputs.

    Example:
        >>> Lags("y", 2, {"u": 2}).names
        ('u', 'lag(u)', 'lag(y)', 'lag(y, 2)')
    """

    of: str = eqx.field(static=True)
    own: int = eqx.field(static=True)
    inputs: tuple[tuple[str, int], ...] = eqx.field(static=True)
    delay: int = eqx.field(static=True)

    def __init__(self, of: str, own: int, inputs: Mapping[str, int], delay: int = 0) -> None:
        self.of, self.own, self.inputs, self.delay = of, own, tuple(inputs.items()), delay

    def __check_init__(self) -> None:
        for name, value, least in (
            ("lags", self.own, 1),
            ("delay", self.delay, 0),
            *((k, v, 1) for k, v in self.inputs),
        ):
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise ConfigError(f"{name}: expected a whole number of rows of at least {least}, got {value!r}")
        if self.of in dict(self.inputs):
            raise ConfigError(f"inputs: expected signals other than {self.of!r}, which has lags of its own")

    @property
    def signals(self) -> tuple[str, ...]:
        """All that are needed."""
        return (self.of, *(name for name, _ in self.inputs))

    @property
    def depth(self) -> int:
        """Rows that are looked back."""
        return max(self.own, *(self.delay + count - 1 for _, count in self.inputs)) if self.inputs else self.own

    @property
    def names(self) -> tuple[str, ...]:
        """What the network is told, in order: inputs from the newest on, then the signal itself."""
        outside = [_lagged(name, self.delay + k) for name, count in self.inputs for k in range(count)]
        return (*outside, *(_lagged(self.of, k) for k in range(1, self.own + 1)))

    def rows(self, signals: Mapping[str, Float[np.ndarray, " T"]]) -> Float[np.ndarray, "T d"]:
        """What the network is told for each row; NaN where anything of it is missing."""
        outside = [later(signals[name], self.delay + k) for name, count in self.inputs for k in range(count)]
        return np.stack([*outside, *(later(signals[self.of], k) for k in range(1, self.own + 1))], axis=1)


class LaggedModel(eqx.Module):
    """A signal from rows before it, by a network.

    ```
    y(k) = y(k-1) + scale network([u(k-d), ..., y(k-1), ..., y(k-n)])     increment; without y(k-1) for absolute
    ```

    Attributes:
        network: takes what `lags` says, and gives one number.
        output_scale: its unit, in that of the signal.
        lags: which rows it is told.
        form: "increment" or "absolute".

    Raises:
        ShapeError: a network of other inputs or of more than one output.

    Source: Narendra and Parthasarathy (1990), IEEE Trans. Neural Netw. 1(1):4-27, model IV; series-parallel for `one_step`,
        parallel for `free_run`.

    Example:
        >>> from gainful.networks import AffineMap
        >>> line = AffineMap(jnp.array([[0.5, -0.5]]), jnp.zeros(1))
        >>> model = LaggedModel(line, jnp.asarray(1.0), Lags("y", 1, {"u": 1}))
        >>> model.free_run({"y": np.zeros(4), "u": np.ones(4)}).tolist()
        [0.0, 0.5, 0.75, 0.875]
    """

    network: AbstractNetwork
    output_scale: Float[Array, ""]
    lags: Lags
    form: Literal["increment", "absolute"] = eqx.field(static=True, default="increment")

    def __check_init__(self) -> None:
        wanted = (len(self.lags.names), 1)
        if (self.network.inputs, self.network.outputs) != wanted:
            got = (self.network.inputs, self.network.outputs)
            raise ShapeError(f"network: expected (inputs, outputs) of {wanted}, got {got}")

    def __call__(self, z: Float[Array, " d"]) -> Float[Array, ""]:
        """The signal in a row, from what `lags` says of the rows before."""
        base = z[-self.lags.own] if self.form == "increment" else jnp.zeros(())
        return base + self.output_scale * self.network(z)[0]

    def one_step(self, signals: Mapping[str, Float[np.ndarray, " T"]]) -> Float[np.ndarray, " T"]:
        """The signal in each row, from measured rows before; NaN where one of them is missing."""
        rows = self.lags.rows(signals)
        whole = np.asarray(np.isfinite(rows).all(axis=1))
        said = np.asarray(_all_rows(self, jnp.asarray(np.where(whole[:, None], rows, 0.0))))
        return np.where(whole, said, np.nan)

    def free_run(self, signals: Mapping[str, Float[np.ndarray, " T"]]) -> Float[np.ndarray, " T"]:
        """The signal from the start of the longest stretch in which nothing is missing, given only the inputs, else NaN.

        It starts from what was measured. A run that grows beyond all numbers ends in infinity.
        """
        rows, measured = self.lags.rows(signals), signals[self.lags.of]
        start, stop = longest_stretch(np.isfinite(np.c_[rows, measured]).all(axis=1))
        out = np.full(len(measured), np.nan)
        if stop > start:
            own = self.lags.own
            found = np.asarray(_by_itself(self, jnp.asarray(rows[start, -own:]), jnp.asarray(rows[start:stop, :-own])))
            out[start:stop] = np.where(np.isnan(found), np.inf, found)
            before = slice(start - self.lags.depth, start)
            out[before] = measured[before]
        return out


@eqx.filter_jit
def _all_rows(model: LaggedModel, rows: Float[Array, "T d"]) -> Float[Array, " T"]:
    return jax.vmap(model)(rows)


@eqx.filter_jit
def _by_itself(model: LaggedModel, past: Float[Array, " own"], outside: Float[Array, "T e"]) -> Float[Array, " T"]:
    def step(past: Array, row: Array) -> tuple[Array, Array]:
        new = model(jnp.concatenate([row, past]))
        return jnp.concatenate([new[None], past[:-1]]), new

    return jax.lax.scan(step, past, outside)[1]


def _lagged(name: str, rows: int) -> str:
    return name if rows == 0 else f"lag({name})" if rows == 1 else f"lag({name}, {rows})"
