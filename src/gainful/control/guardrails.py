"""What keeps a controller that learns from doing harm."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError


class Guardrails(eqx.Module):
    """When a controller with a learned model stops learning, goes back to older weights, or hands over.

    Limits of torque and step are those of the inversion, the braking curve is the command's, and the bound of the
    covariance's trace is the weight filter's.

    Attributes:
        extrapolation: whether learning stops outside the range the network knows.
        least_sensitivity: smallest share of the nominal sensitivity that is believed; None turns the check off.
        most_missing: samples in a row that may be missing, in whole or in part, before the fallback acts; None for no end.
        largest_error: of the command's errors, beyond which the fallback acts until they are half as large; None for none.
        settling: time constant with which the last command gives way to the fallback's [s].

    Raises:
        ConfigError: a number out of its range.
    """

    extrapolation: bool = eqx.field(static=True, default=True)
    least_sensitivity: float | Array | None = 0.1
    most_missing: int | None = 5
    largest_error: float | Array | None = None
    settling: float | Array = 1.0  # s

    def __check_init__(self) -> None:
        for name in ("least_sensitivity", "largest_error", "settling"):
            value = getattr(self, name)
            if isinstance(value, float | int) and not value > 0:
                raise ConfigError(f"{name}: expected a number above 0, got {value!r}")
        if self.most_missing is not None and (not isinstance(self.most_missing, int) or self.most_missing < 0):
            raise ConfigError(f"most_missing: expected a whole number of at least 0, got {self.most_missing!r}")

    @classmethod
    def none(cls) -> Guardrails:
        """All of them off. A reading that is missing is still never learned from."""
        return cls(False, None, None, None)

    def far_off(self, error: Float[Array, " errors"], already: Bool[Array, ""]) -> Bool[Array, ""]:
        """Whether the errors ask for the fallback, which `already` acts or not."""
        if self.largest_error is None:
            return jnp.asarray(False)
        return jnp.any(jnp.abs(error) > jnp.where(already, 0.5, 1.0) * self.largest_error)

    def overdue(self, missing: Array) -> Bool[Array, ""]:
        """Whether too many samples in a row were missing."""
        return jnp.asarray(False) if self.most_missing is None else missing > self.most_missing


def weak_inputs(
    sensitivity: Float[Array, "outputs inputs"],
    nominal: Float[Array, "outputs inputs"],
    weights: Float[Array, "outputs outputs"],
    least: float | Array,
) -> Bool[Array, " inputs"]:
    """Inputs whose effect is not to be believed: of the wrong sign, or lost among the others'.

    With `N` the nominal sensitivity and `W` the weights of the outputs, `G = (N' W N)^-1 N' W H` is the identity where the
    sensitivity `H` is the nominal one. Its diagonal shall be positive and its smallest singular value at least `least`;
    where that is smaller, the inputs that share most in its direction are named.
    """
    normal = nominal.T @ weights @ nominal
    G = jnp.linalg.solve(normal, nominal.T @ weights @ sensitivity)
    squares, directions = jnp.linalg.eigh(G.T @ G)
    # The largest share of a unit vector is at least that of equal ones.
    named = jnp.abs(directions[:, 0]) >= 0.999 / jnp.sqrt(len(squares))
    small = ~(squares[0] >= jnp.square(least))
    return ~(jnp.diag(G) > 0) | (small & named)
