"""The same step as in a run, one sample at a time."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import DataError, NumericalError, ShapeError, Status, did_you_mean
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator
from ..models import AbstractModel, Instant, Sample
from ..running.checks import check_parts
from ..running.compiled import Frozen
from ..running.log import fill_missing
from ..runtime import compiler_options
from .packing import Packed, pack, unpack

_STATUSES = tuple(Status)
_NO_INPUTS = np.zeros(0)


class OnlineEstimate:
    """What is known after a sample.

    Attributes:
        t: time [s].
        names: of the state's coordinates.
        mean: estimated state (size,).
        cov: covariance in tangent coordinates (dof, dof).
        nis: normalised innovation squared.
        weight: how far each measured component counted (m,).
        status: what became of the sample.
    """

    # Read from the step's one report when asked: most callers want one or two of them.
    __slots__ = ("_dof", "_report", "names", "status", "t")

    def __init__(self, t: float, names: tuple[str, ...], dof: int, report: np.ndarray) -> None:
        self.t, self.names, self._dof, self._report = t, names, dof, report
        self.status = _STATUSES[int(report[-1])]

    @property
    def mean(self) -> np.ndarray:
        return self._report[: len(self.names)]

    @property
    def cov(self) -> np.ndarray:
        start = len(self.names)
        return self._report[start : start + self._dof**2].reshape(self._dof, self._dof)

    @property
    def nis(self) -> float:
        return float(self._report[len(self.names) + self._dof**2])

    @property
    def weight(self) -> np.ndarray:
        return self._report[len(self.names) + self._dof**2 + 1 : -1]

    @property
    def std(self) -> np.ndarray:
        """Standard deviations in tangent coordinates (dof,)."""
        return np.sqrt(np.maximum(np.diag(self.cov), 0.0))

    def __getitem__(self, name: str) -> float:
        """One state by name."""
        if name not in self.names:
            raise KeyError(f"{name!r} is not a state; states: {', '.join(self.names)}")
        return float(self.mean[self.names.index(name)])

    def __repr__(self) -> str:
        states = ", ".join(f"{name}={value:.6g}" for name, value in zip(self.names, self.mean, strict=True))
        return f"OnlineEstimate(t={self.t:.9g}, {states}, {self.status.name})"


class OnlineFilter:
    """Steps an estimator through a stream as it comes; equal to `run` on the same samples to rounding.

    Args:
        estimator: a filter, such as `unscented_kalman_filter()`.
        model: of the plant.
        prior: the estimate at `start`.
        start: time of the prior [s]; the first sample's by default.
        max_step: longest interval predicted in one go [s]; longer ones are split.
        throw: raise if a step fails; otherwise the last good estimate is kept and the status says so.

    The first sample compiles the step; call `warm_up` before the stream starts where that matters.

    Example:
        >>> import gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, outputs=["y"])
        >>> online = OnlineFilter(gf.kalman_filter(), model, gf.make_prior(model, [0.0], [1.0]))
        >>> round(online.push(0.0, [2.0])["x0"], 12)
        1.0
    """

    def __init__(
        self,
        estimator: AbstractEstimator,
        model: AbstractModel,
        prior: AbstractEstimate,
        *,
        start: float | None = None,
        max_step: float | None = None,
        throw: bool = True,
    ) -> None:
        check_parts(estimator, model, prior, 0.0 if start is None else start)
        if max_step is not None and not (max_step > 0 and math.isfinite(max_step)):
            raise DataError(f"max_step: expected a time above 0 s, got {max_step!r}")
        self._model, self._time, self._max_step, self._throw = model, start, max_step, throw
        carry = eqx.filter_jit(estimator.init)(model, prior)
        # Few arrays go in and round; what they stand for is part of the program.
        self._dtype = prior.mean.dtype
        self._arrays, parts = pack((estimator, model), self._dtype)
        self._carry, memory = pack(carry, self._dtype)
        self._frozen = Frozen((parts, memory))
        self._sizes, self._program = (len(model.inputs), model.output.size), _program()
        # Read once: attribute access on a module costs as much as the rest of a push.
        self._names, self._dof = model.space.names, model.space.dof
        self._signals, self._inputs = model.output.names, model.inputs
        self._plain = all(part.size == part.dof for part in model.output.parts)
        self._all_seen = np.ones(model.output.dof, bool)
        self._nothing = self._measured(None)

    def warm_up(self) -> None:
        """Compile the step without using a sample."""
        self._step(0.0, 0.0, 1, np.zeros(self._sizes[0]), *self._nothing)

    def push(self, t: float, y: Any = None, u: Any = None) -> OnlineEstimate:
        """Predict to `t` and use what was measured then.

        Args:
            t: time [s], not before the last one.
            y: measurement (output size,), NaN where missing; a mapping from signal name to number, absent where missing;
                or None for a prediction alone.
            u: inputs (inputs,), held over the interval that ends at `t`; needed if the model has inputs.

        Raises:
            DataError: time goes back, or a number is not finite.
            ShapeError: a wrong number of entries.
            NumericalError: the step failed, and `throw` is on.
        """
        last = t if self._time is None else self._time
        if not math.isfinite(t) or t < last:
            raise DataError(f"t: expected a time not before {last:.9g} s, got {t:.9g} s")
        inputs = self._given(t, u)
        point, seen = self._measured(y)
        pieces = 1 if self._max_step is None else max(1, math.ceil((t - last) / self._max_step - 1e-9))
        carry, report = self._step(last, t, pieces, inputs, point, seen)
        estimate = OnlineEstimate(t, self._names, self._dof, np.asarray(report))
        if self._throw and estimate.status.failed:
            raise NumericalError(f"t = {t:.9g} s: {estimate.status.sentence}; the filter stays as it was before")
        self._carry, self._time = carry, t
        return estimate

    def _step(self, last: float, t: float, pieces: int, u: Any, y: Any, seen: Any) -> tuple[Any, Array]:
        # One vector in and one out: each array crossing into XLA costs more than the arithmetic.
        inputs, outputs = self._sizes
        packed = np.empty(3 + inputs + outputs + len(seen), self._dtype)
        packed[:3] = last, t, pieces
        packed[3 : 3 + inputs], packed[3 + inputs : 3 + inputs + outputs], packed[3 + inputs + outputs :] = u, y, seen
        return self._program(self._frozen, self._sizes, self._arrays, self._carry, packed)

    def _given(self, t: float, u: Any) -> np.ndarray:
        inputs = _NO_INPUTS if u is None else np.atleast_1d(np.asarray(u, dtype=float))
        if inputs.shape != (self._sizes[0],):
            raise ShapeError(f"u: expected shape ({self._sizes[0]},) ({', '.join(self._inputs)}), got {inputs.shape}")
        if inputs.size and not np.isfinite(inputs).all():
            raise DataError(f"u at t = {t:.9g} s: expected finite numbers, got {inputs}")
        return inputs

    def _measured(self, y: Any) -> tuple[np.ndarray, np.ndarray]:
        size, names = self._sizes[1], self._signals
        if y is None:
            values = np.full(size, np.nan)
        elif isinstance(y, Mapping):
            values = np.full(size, np.nan)
            for name, value in y.items():
                if name not in names:
                    raise ShapeError(f"y: {name!r} is not a signal of the model; {did_you_mean(name, names)}")
                values[names.index(name)] = value
        else:
            values = np.asarray(y, dtype=float)
            if values.ndim == 0:
                values = values[None]
        if values.shape != (size,):
            raise ShapeError(f"y: expected shape ({size},) ({', '.join(names)}), got {values.shape}")
        if self._plain and math.isfinite(values @ values):  # all of them, at half the price of asking one by one
            return values, self._all_seen
        if np.isinf(values).any():
            raise DataError(f"y: expected finite numbers, or NaN for missing, got {values}")
        point, known = fill_missing(self._model, values[None])
        return point[0], known[0]


@functools.cache
def _program() -> Callable[..., tuple[Packed, Array]]:
    # Every operation taken out of the loop would be started by itself.
    options = {"xla_disable_hlo_passes": "while-loop-invariant-code-motion"} | compiler_options()
    return jax.jit(_packed_step, static_argnums=(0, 1), compiler_options=options)


def _packed_step(
    frozen: Frozen, sizes: tuple[int, int], arrays: Packed, carry: Packed, packed: Array
) -> tuple[Packed, Array]:
    parts, memory = frozen.tree
    estimator, model = unpack(arrays, parts)
    inputs, outputs = sizes

    def piece(k: Array, held: tuple[Packed, Array]) -> tuple[Packed, Array]:
        last, t, pieces = packed[0], packed[1], packed[2]
        u, y, seen = jnp.split(packed[3:], [inputs, inputs + outputs])
        dt = (t - last) / pieces
        # The measurement belongs to the end of the last piece.
        final = k + 1 == pieces
        sample = Sample(Instant(jnp.where(final, t, last + (k + 1) * dt), dt, u), y, (seen > 0.5) & final)
        after, info = estimator.step(model, unpack(held[0], memory), sample)
        estimate = info.estimate
        report = [estimate.mean, estimate.cov.ravel(), info.nis[None], info.weight, info.status[None]]
        return pack(after, packed.dtype)[0], jnp.concatenate([part.astype(packed.dtype) for part in report])

    # A loop even where there is one piece: XLA compiles a loop into one function.
    size = model.space.size + model.space.dof**2 + 1 + model.output.dof + 1
    return jax.lax.fori_loop(0, packed[2].astype(int), piece, (carry, jnp.zeros(size, packed.dtype)))
