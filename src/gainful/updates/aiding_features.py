"""What a network is told of a filter's step."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, did_you_mean
from ..linalg import product, times_inverse
from ..models import AbstractModel
from .base import Likelihood, Update


class AbstractFeatures(eqx.Module):
    """Numbers that describe a step: the inputs of a network beside the filter."""

    @abc.abstractmethod
    def names(self, model: AbstractModel) -> tuple[str, ...]:
        """One name per number."""

    @abc.abstractmethod
    def init(self, model: AbstractModel) -> Any:
        """What they remember at the start."""

    @abc.abstractmethod
    def __call__(self, memory: Any, likelihood: Likelihood, update: Update) -> tuple[Any, Float[Array, " features"]]:
        """What they remember after a step with a measurement, and the numbers."""


class UpdateFeatures(AbstractFeatures):
    """How far the update moved the state, what it left of the innovation, and its gain.

    ```
    x- - x = -K r,   y - H x = (I - H K) r,   K
    ```

    At a steady gain all of them are functions of the one innovation.

    Source: Chin (1994), IEEE Trans. Aerosp. Electron. Syst. 30(2), for the choice of inputs.
    """

    def names(self, model: AbstractModel) -> tuple[str, ...]:
        states, outputs = model.space.tangent_names, model.output.tangent_names
        gains = (f"gain {state} by {output}" for state in states for output in outputs)
        return (*(f"move {name}" for name in states), *(f"left {name}" for name in outputs), *gains)

    def init(self, model: AbstractModel) -> None:
        return None

    def __call__(self, memory: None, likelihood: Likelihood, update: Update) -> tuple[None, Float[Array, " features"]]:
        prior = update.prior
        moved = prior.space.minus(prior.mean, update.posterior.mean)
        gain = times_inverse(product(update.affine.matrix, prior.cov), update.innovation.inverse)
        return None, jnp.concatenate([moved, update.postfit, gain.ravel()])


class Leaks(eqx.Module):
    """Leaky means of the whitened innovation, and of its square (k, m)."""

    values: Float[Array, "k m"]
    squares: Float[Array, "j m"]


class InnovationHistory(AbstractFeatures):
    """The innovation in units of its sigma, now and over some time, and how large it has been.

    ```
    n = L^-1 r with L L^T = S;  leak_a x <- a leak_a x + (1 - a) x
    n, asinh n, leak_a n (each a), ln(leak_b n^2 + 0.01) (each b), n ln(leak_c n^2 + 0.01)
    ```

    Attributes:
        leaks: `a`, from 0 to below 1.
        square_leaks: `b`.
        product_leak: `c`.
    """

    leaks: tuple[float, ...] = eqx.field(static=True, default=(0.6, 0.9))
    square_leaks: tuple[float, ...] = eqx.field(static=True, default=(0.7, 0.95))
    product_leak: float = eqx.field(static=True, default=0.9)

    def __check_init__(self) -> None:
        for name, values in (
            ("leaks", self.leaks),
            ("square_leaks", self.square_leaks),
            ("product_leak", (self.product_leak,)),
        ):
            if not all(0 <= value < 1 for value in values):
                raise ConfigError(f"{name}: expected numbers of at least 0 and below 1, got {getattr(self, name)!r}")

    def names(self, model: AbstractModel) -> tuple[str, ...]:
        kinds = (
            "innovation",
            "asinh innovation",
            *(f"mean innovation {leak:g}" for leak in self.leaks),
            *(f"log square {leak:g}" for leak in self.square_leaks),
            f"innovation times log square {self.product_leak:g}",
        )
        return tuple(f"{kind} {k}" for kind in kinds for k in range(model.output.dof))

    def init(self, model: AbstractModel) -> Leaks:
        m = model.output.dof
        return Leaks(jnp.zeros((len(self.leaks), m)), jnp.zeros((len(self.square_leaks) + 1, m)))

    def __call__(
        self, memory: Leaks, likelihood: Likelihood, update: Update
    ) -> tuple[Leaks, Float[Array, " features"]]:
        n = update.innovation.whitened
        seen = likelihood.seen

        def leaked(past: Array, value: Array, rates: tuple[float, ...]) -> Array:
            rate = jnp.array(rates, value.dtype).reshape(-1, 1)
            # What was not measured says nothing new of its component.
            return jnp.where(seen, rate * past + (1 - rate) * value, past).astype(past.dtype)

        values = leaked(memory.values, n, self.leaks)
        squares = leaked(memory.squares, n**2, (*self.square_leaks, self.product_leak))
        logs = jnp.log(squares + 0.01)
        rows = [n[None], jnp.arcsinh(n)[None], values, logs[:-1], n[None] * logs[-1:]]
        return Leaks(values, squares), jnp.concatenate(rows).ravel()


class Context(AbstractFeatures):
    """Where and when the step is: chosen states after the update, inputs, or the time.

    Attributes:
        signals: names of states, of inputs, or "t" [s] and "dt" [s].
    """

    signals: tuple[str, ...] = eqx.field(static=True)

    def names(self, model: AbstractModel) -> tuple[str, ...]:
        return self.signals

    def init(self, model: AbstractModel) -> Int[Array, " signals"]:
        return jnp.array(context_rows("signals", self.signals, model), jnp.int32)

    def __call__(
        self, memory: Int[Array, " signals"], likelihood: Likelihood, update: Update
    ) -> tuple[Int[Array, " signals"], Float[Array, " features"]]:
        when = likelihood.when
        if when is None:
            raise ConfigError("context features: expected an update that is told the moment, got none")
        return memory, context_values(update.posterior.mean, when)[memory]


def context_rows(role: str, signals: tuple[str, ...], model: AbstractModel) -> list[int]:
    """Where signals stand among `context_values`.

    Raises:
        ConfigError: one that is neither a state, an input nor a time, blamed on `role`.
    """
    known = [*model.space.names, *model.inputs, "t", "dt"]
    for name in signals:
        if name not in known:
            raise ConfigError(f"{role}: {name!r} is no state, input or time; {did_you_mean(str(name), known)}")
    return [known.index(name) for name in signals]


def context_values(x: Float[Array, " size"], when: Any) -> Float[Array, " all"]:
    """States, inputs, time and step, side by side."""
    return jnp.concatenate([x, when.u, jnp.stack([when.t, when.dt])])


class JoinedFeatures(AbstractFeatures):
    """Several kinds of features side by side.

    Attributes:
        parts: each kind.
    """

    parts: tuple[AbstractFeatures, ...]

    def names(self, model: AbstractModel) -> tuple[str, ...]:
        return tuple(name for part in self.parts for name in part.names(model))

    def init(self, model: AbstractModel) -> tuple[Any, ...]:
        return tuple(part.init(model) for part in self.parts)

    def __call__(
        self, memory: tuple[Any, ...], likelihood: Likelihood, update: Update
    ) -> tuple[tuple[Any, ...], Float[Array, " features"]]:
        found = [part(own, likelihood, update) for part, own in zip(self.parts, memory, strict=True)]
        return tuple(own for own, _ in found), jnp.concatenate([values for _, values in found])
