"""What updates that change the noise within a step have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate, Innovation
from ..linalg import product, root_and_inverse
from ..spaces import AbstractSpace
from .base import AbstractUpdate, Update

Memory = TypeVar("Memory", bound=eqx.Module)


def excess(factors: Float[Array, " n"], cov: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """`E C E` with `E = diag(sqrt(factors - 1))`: added to C it multiplies the variances, and it is a covariance."""
    scale = jnp.sqrt(jnp.maximum(factors - 1.0, 0.0))
    return scale[:, None] * cov * scale[None, :]


def inflated(estimate: AbstractEstimate, cov: Float[Array, "n n"], active: Bool[Array, ""]) -> AbstractEstimate:
    """The estimate with covariance added where `active`; elsewhere itself, to the last bit."""
    more = estimate.plus_noise(cov)
    return jax.tree.map(lambda new, old: jnp.where(active, new, old), more, estimate)


def remembered(measured: Bool[Array, ""], new: Memory, old: Memory, inner: Any) -> Memory:
    """The new memory where something was measured, else the old; `inner`, which sees to itself, as it is."""
    chosen = jax.tree.map(lambda now, then: jnp.where(measured, now, then).astype(then.dtype), new, old)
    return eqx.tree_at(lambda memory: memory.inner, chosen, inner, is_leaf=lambda leaf: leaf is None)  # type: ignore[attr-defined]


def solve_least_squares(
    matrix: Float[Array, "m n"], weight: Float[Array, "m m"], ridge: Float[Array, " n"]
) -> Float[Array, "n m"]:
    """`(M^T W M + diag(ridge))^-1 M^T W`, a left inverse of `M` where the ridge is 0 and `M` has full column rank."""
    weighted = product(matrix.T, weight)
    _, inverse, _ = root_and_inverse(product(weighted, matrix) + jnp.diag(ridge))
    return product(inverse.T, product(inverse, weighted))


def with_inner(
    extra: Float[Array, "dof dof"],
    inner: AbstractUpdate,
    memory: Any,
    prior: AbstractEstimate,
    process: Float[Array, "dof dof"],
) -> Float[Array, "dof dof"]:
    """What an update and the one within it added to a prior together."""
    deeper = inner.added(memory, prior.plus_noise(extra), process)
    return extra if deeper is None else extra + deeper


def as_predicted(update: Update, prior: AbstractEstimate, nominal: Innovation) -> Update:
    """The update, its innovation told against the prediction, which knew nothing of what was added for it."""
    return eqx.tree_at(lambda part: (part.prior, part.innovation), update, (prior, nominal))


def check_bounds(bounds: dict[str, float]) -> None:
    """Raise unless all sizes are above 0; those that are being traced are not known yet."""
    for name, bound in bounds.items():
        if not isinstance(bound, Tracer) and not bound > 0:
            raise ConfigError(f"bounds: expected a size above 0 for {name!r}, got {bound!r}")


def ridge_of(bounds: dict[str, float], space: AbstractSpace) -> Float[Array, " added"]:
    """Inverse squares of the largest possible sizes of the added states; 0 for those without one.

    Raises:
        ConfigError: a bound of something that was not added to the model.
    """
    names = space.tangent_names[space.dof - space.added :]
    for name in bounds:
        if name not in names:
            known = did_you_mean(name, names) if names else "nothing was added to the model"
            raise ConfigError(f"bounds: {name!r} is not an added state; {known}")
    return jnp.array([bounds.get(name, jnp.inf) for name in names]) ** -2.0


def state_rows(role: str, states: Iterable[str], space: AbstractSpace) -> list[int]:
    """Where states stand in the covariance.

    Raises:
        ConfigError: one that is not a state, blamed on `role`.
    """
    names = list(space.tangent_names)
    for name in states:
        if name not in names:
            raise ConfigError(f"{role}: {name!r} is not a state of the model; {did_you_mean(str(name), names)}")
    return [names.index(name) for name in states]
