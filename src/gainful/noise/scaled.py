"""The model's noise, made larger or smaller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from ..models import AbstractModel
from ..updates import Update
from .base import AbstractNoise
from .nominal import Nominal

Tree = TypeVar("Tree")


class Scaled(AbstractNoise):
    """Standard deviations of the model's noise times constant factors, by name.

    ```
    Q <- E Q E,  R <- D R D  with E and D diagonal
    ```

    Attributes:
        states: factors for Q by the name of a state, as the covariance writes it; 1 for all others.
        outputs: factors for R by the name of an output, likewise.

    Reads: nothing. Writes: Q, R.
    Reduces to: `Nominal` for factors of 1.
    """

    states: dict[str, float] = eqx.field(default_factory=dict)
    outputs: dict[str, float] = eqx.field(default_factory=dict)

    def __check_init__(self) -> None:
        for role, factors in (("states", self.states), ("outputs", self.outputs)):
            for name, factor in factors.items():
                if isinstance(factor, (int, float)) and not factor >= 0:
                    raise ConfigError(f"{role}: expected a factor of at least 0 for {name!r}, got {factor!r}")

    def init(self, model: AbstractModel) -> tuple[Float[Array, " dof"], Float[Array, " m"]]:
        return (
            _factors("states", self.states, model.space.tangent_names),
            _factors("outputs", self.outputs, model.output.tangent_names),
        )

    def process(self, carry: tuple[Array, Array], Q: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
        scale = carry[0].astype(Q.dtype)
        return scale[:, None] * Q * scale[None, :]

    def measurement(self, carry: tuple[Array, Array], R: Float[Array, "m m"]) -> Float[Array, "m m"]:
        scale = carry[1].astype(R.dtype)
        return scale[:, None] * R * scale[None, :]

    def learn(self, carry: tuple[Array, Array], update: Update) -> tuple[Array, Array]:
        return carry


def _factors(role: str, given: dict[str, float], names: Sequence[str]) -> Float[Array, " n"]:
    for name in given:
        if name not in names:
            raise ConfigError(f"{role}: {name!r} is not one of the model's; {did_you_mean(name, names)}")
    return jnp.array([given.get(name, 1.0) for name in names])


def with_scaled_noise(estimator: Tree, states: Mapping[str, Any], outputs: Mapping[str, Any]) -> Tree:
    """The estimator with the model's noise scaled in every filter within it, beneath all that its noise laws do.

    Factors that a `Scaled` in it has already are multiplied, so that the members of a bank stay as far apart as they are.

    Args:
        estimator: a filter, a bank of them, or anything built around one.
        states: factors on the standard deviations of Q, by the name of a state, as the covariance writes it.
        outputs: factors on those of R, by the name of an output.

    Raises:
        ConfigError: there is no noise law in it that could be scaled.

    Example:
        >>> import gainful as gf
        >>> with_scaled_noise(gf.kalman_filter(), {"x": 2.0}, {}).noise
        Scaled(states={'x': 2.0}, outputs={})
    """
    if not any(map(_bottom, jax.tree.leaves(estimator, is_leaf=_bottom))):
        raise ConfigError(f"estimator: expected one with a noise law to scale, got a {type(estimator).__name__}")

    def scaled(leaf: Any) -> Any:
        if not _bottom(leaf):
            return leaf
        own = leaf if isinstance(leaf, Scaled) else Scaled()
        return Scaled(_multiplied(own.states, states), _multiplied(own.outputs, outputs))

    return jax.tree.map(scaled, estimator, is_leaf=_bottom)


def _bottom(part: Any) -> bool:
    return isinstance(part, (Nominal, Scaled))


def _multiplied(own: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    return {name: own.get(name, 1.0) * more.get(name, 1.0) for name in {**own, **more}}
