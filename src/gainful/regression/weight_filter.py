"""The Kalman filter of weights that many outputs share one covariance of."""

from __future__ import annotations

import math
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..errors import ConfigError, DataError, PrecisionError, ShapeError, did_you_mean
from ..linalg import symmetrize, triangularize

FORMS = ("square_root", "covariance")
FORGETS = ("everything", "direction")


class WeightState(eqx.Module):
    """What a `WeightFilter` knows.

    Attributes:
        weights: one row per feature (l, outputs).
        spread: root `S` of the covariance `P = S S^T` of every column, or `P` itself in covariance form (l, l).
        seen: rows learned from.
        skipped: rows left out because something in them was not finite.
        resets: how often the covariance was lost to rounding and begun anew.
        form: "square_root" or "covariance".
    """

    weights: Float[Array, "l outputs"]
    spread: Float[Array, "l l"]
    seen: Int[Array, ""]
    skipped: Int[Array, ""]
    resets: Int[Array, ""]
    form: str = eqx.field(static=True)

    @property
    def cov(self) -> Float[Array, "l l"]:
        """Covariance of the weights of each output."""
        return self.spread if self.form == "covariance" else self.spread @ self.spread.T

    @property
    def trace(self) -> Float[Array, ""]:
        """Its trace, which winds up where old rows are forgotten and new ones tell nothing."""
        return jnp.trace(self.spread) if self.form == "covariance" else jnp.sum(self.spread**2)

    @property
    def condition(self) -> Float[Array, ""]:
        """Condition number of the covariance."""
        found = jnp.linalg.cond(self.spread)
        return found if self.form == "covariance" else found**2


class WeightFilter(eqx.Module):
    """Recursive least squares on weights that walk at random; all outputs have the same regressors and one covariance.

    ```
    e = y - W^T phi;   s = f r + phi^T P phi;   K = P phi / s;   W <- W + K e^T;   P <- (P - K (P phi)^T) / f + q I
    ```

    The cost is that of one output. The square-root form keeps twice the digits, by Potter's update and, for `q > 0`, one
    triangularisation per step. A row of which anything is not finite changes nothing.

    Attributes:
        prior_variance: of every weight before the first row.
        noise_variance: `r`, of an output.
        forgetting: `f`, how much a row counts one step later; above 0 and at most 1.
        random_walk: `q`, variance that every weight gains per step.
        trace_cap: trace of `P` beyond which nothing is forgotten; infinite for none.
        forgets: "everything", or only what the new row tells of: its "direction".
        form: "square_root" or "covariance".

    Raises:
        ConfigError: an argument out of its range.

    Source: Plackett (1950), Biometrika 37(1-2):149-157; Potter in Battin (1964), Astronautical Guidance, 338-340, for the
        root; Kulhavy (1987), Kybernetika 23(3):221-233, for forgetting in one direction.
    Differs: forgetting stops as the trace of `P` reaches a bound, where it would wind up.
    Reduces to: `RecursiveLeastSquares` of each output alone; ridge regression without forgetting and walk.

    Example:
        >>> weight_filter = WeightFilter()
        >>> state, innovation = weight_filter.update(weight_filter.init(1, 1), jnp.array([2.0]), jnp.array([6.0]))
        >>> round(float(state.weights[0, 0]), 6), float(innovation[0])
        (3.0, 6.0)
    """

    prior_variance: float = 1e4
    noise_variance: float = 1e-4
    forgetting: float = 1.0
    random_walk: float = 0.0
    trace_cap: float = 1e4
    forgets: Literal["everything", "direction"] = eqx.field(static=True, default="everything")
    form: Literal["square_root", "covariance"] = eqx.field(static=True, default="square_root")

    def __check_init__(self) -> None:
        for name, value, known in (("forgets", self.forgets, FORGETS), ("form", self.form, FORMS)):
            if value not in known:
                raise ConfigError(f"{name}: {value!r} is not known; {did_you_mean(str(value), known)}")
        for name in ("prior_variance", "noise_variance", "trace_cap"):
            value = getattr(self, name)
            if _known(value) and not value > 0:
                raise ConfigError(f"{name}: expected a number above 0, got {value!r}")
        if _known(self.forgetting) and not 0 < self.forgetting <= 1:
            raise ConfigError(f"forgetting: expected a number above 0 and at most 1, got {self.forgetting!r}")
        if _known(self.random_walk) and not 0 <= self.random_walk < math.inf:
            raise ConfigError(f"random_walk: expected a number of at least 0, got {self.random_walk!r}")

    def init(self, features: int, outputs: int) -> WeightState:
        """Weights of zero, known as well as `prior_variance` says.

        Raises:
            PrecisionError: the covariance form with 32-bit numbers, in which it loses its covariance.
        """
        weights = jnp.zeros((features, outputs))
        if self.form == "covariance" and weights.dtype == jnp.float32:
            raise PrecisionError('form: expected "square_root" with 32-bit numbers, got "covariance"')
        none = jnp.zeros((), int)
        return WeightState(weights, self._prior(features, weights.dtype), none, none, none, self.form)

    def reset(self, state: WeightState) -> WeightState:
        """The same weights, known no better than before the first row: for when they are known to have jumped."""
        prior = self._prior(len(state.weights), state.weights.dtype)
        return eqx.tree_at(lambda each: each.spread, state, prior)

    def update(
        self, state: WeightState, phi: Float[Array, " l"], y: Float[Array, " outputs"]
    ) -> tuple[WeightState, Float[Array, " outputs"]]:
        """Learn from one row.

        Args:
            state: what is known.
            phi: the features.
            y: what the outputs should have been.

        Returns:
            What is known then, and `e`, what was left of `y` before; NaN where the row was skipped.
        """
        whole = jnp.all(jnp.isfinite(phi)) & jnp.all(jnp.isfinite(y))
        phi, y = jnp.where(whole, phi, 0.0), jnp.where(whole, y, 0.0)
        innovation = y - state.weights.T @ phi
        square_root = self.form == "square_root"
        across = state.spread.T @ phi if square_root else state.spread @ phi
        told = across @ across if square_root else phi @ across
        cross = state.spread @ across if square_root else across
        fade = self.forgetting if self.forgets == "everything" else 1.0
        noise = self.noise_variance * fade
        gain = cross / (noise + told)
        weights = state.weights + jnp.outer(gain, innovation)
        left = self._left(told, noise)
        # P - share P phi (P phi)^T, which leaves `left` of the variance of phi^T W.
        safe = jnp.where(told > 0, told, 1.0)
        if square_root:
            share = jnp.where(told > 0, (1.0 - jnp.sqrt(left)) / safe, 0.0)
            spread = self._walked_root(self._faded(state.spread - share * jnp.outer(cross, across)))
        else:
            share = jnp.where(told > 0, (1.0 - left) / safe, 0.0)
            # Symmetric to the last bit, as is what it is taken from.
            spread = self._faded(state.spread - share * jnp.outer(cross, cross))
            spread = spread + self.random_walk * jnp.eye(len(spread), dtype=spread.dtype)
        # A covariance form may lose its covariance to rounding; a root cannot. What is lost beside the diagonal shows in
        # `told` with the next row.
        diagonal = jnp.diagonal(spread)
        sound = jnp.all(jnp.isfinite(diagonal)) & jnp.all(jnp.isfinite(weights)) & (told >= 0)
        sound = sound & (square_root | jnp.all(diagonal > 0))
        kept = whole & sound
        spread = jnp.where(kept, spread, jnp.where(whole, self._prior(len(weights), weights.dtype), state.spread))
        after = WeightState(
            jnp.where(kept, weights, state.weights),
            spread,
            state.seen + kept,
            state.skipped + ~whole,
            state.resets + (whole & ~sound),
            self.form,
        )
        return after, jnp.where(whole, innovation, jnp.nan)

    def fitted(self, features: Float[np.ndarray, "N l"], targets: Float[np.ndarray, "N outputs"]) -> WeightState:
        """What is known after all rows at once, without forgetting and walk: see `fit_weights`."""
        fitted = fit_weights(features, targets, float(self.prior_variance), float(self.noise_variance))
        if self.form == "square_root":
            return fitted
        return WeightState(
            fitted.weights, symmetrize(fitted.cov), fitted.seen, fitted.skipped, fitted.resets, self.form
        )

    def _prior(self, features: int, dtype: jnp.dtype) -> Float[Array, "l l"]:
        variance = jnp.asarray(self.prior_variance, dtype)
        return jnp.eye(features, dtype=dtype) * (jnp.sqrt(variance) if self.form == "square_root" else variance)

    def _left(self, told: Float[Array, ""], noise: float | Array) -> Float[Array, ""]:
        """Share of the variance of `phi^T W` that a row leaves."""
        if self.forgets == "everything":
            return noise / (noise + told)
        return noise / (self.forgetting * (noise + told))

    def _faded(self, spread: Float[Array, "l l"]) -> Float[Array, "l l"]:
        """The covariance, or its root, after forgetting."""
        if self.forgets == "direction" or (_known(self.forgetting) and self.forgetting == 1):
            return spread
        square_root = self.form == "square_root"
        trace = jnp.sum(spread**2) if square_root else jnp.trace(spread)
        growth = jnp.clip(self.trace_cap / trace, 1.0, 1.0 / self.forgetting)
        return spread * (jnp.sqrt(growth) if square_root else growth)

    def _walked_root(self, root: Float[Array, "l l"]) -> Float[Array, "l l"]:
        if _known(self.random_walk) and self.random_walk == 0:
            return root
        walk = jnp.sqrt(jnp.asarray(self.random_walk, root.dtype)) * jnp.eye(len(root), dtype=root.dtype)
        return triangularize(jnp.concatenate([root, walk], axis=1))


def fit_weights(
    features: Float[np.ndarray, "N l"],
    targets: Float[np.ndarray, "N outputs"],
    prior_variance: float = 1e4,
    noise_variance: float = 1e-4,
) -> WeightState:
    """All rows at once, by one orthogonal triangularisation: what a `WeightFilter` that forgets nothing knows after them.

    ```
    Q [R, Z] = [Phi / sqrt(r), Y / sqrt(r); I / sqrt(lambda), 0];   W = R^-1 Z;   P = R^-1 R^-T
    ```

    Args:
        features: one row each; a row of which anything is not finite is skipped, here and in `targets`.
        targets: likewise.
        prior_variance: `lambda`, of every weight.
        noise_variance: `r`, of an output.

    Raises:
        ShapeError: not one row of each per example.
        DataError: no row is whole.

    Source: Golub (1965), Numer. Math. 7(3):206-216.

    Example:
        >>> state = fit_weights(np.array([[1.0], [2.0]]), np.array([[3.0], [6.0]]))
        >>> round(float(state.weights[0, 0]), 6)
        3.0
    """
    features, targets = (np.asarray(values, float) for values in (features, targets))
    if features.ndim != 2 or targets.ndim != 2 or len(features) != len(targets):
        raise ShapeError(
            f"features and targets: expected one row of each per example, got shapes {features.shape} and {targets.shape}"
        )
    whole = np.isfinite(np.concatenate([features, targets], axis=1)).all(axis=1)
    if not whole.any():
        raise DataError(f"features and targets: expected a row of finite numbers, got none in {len(features)}")
    size, weight = features.shape[1], 1.0 / math.sqrt(noise_variance)
    rows = weight * np.concatenate([features[whole], targets[whole]], axis=1)
    prior = np.concatenate([np.eye(size) / math.sqrt(prior_variance), np.zeros((size, targets.shape[1]))], axis=1)
    upper = jnp.linalg.qr(jnp.asarray(np.concatenate([rows, prior])), mode="r")
    root = jax.scipy.linalg.solve_triangular(upper[:size, :size], jnp.eye(size))
    weights = jax.scipy.linalg.solve_triangular(upper[:size, :size], upper[:size, size:])
    seen, skipped = jnp.asarray(whole.sum()), jnp.asarray((~whole).sum())
    return WeightState(weights, root, seen, skipped, jnp.zeros((), int), "square_root")


def _known(value: float | Array) -> bool:
    """Whether a number is one already, and not being traced or an array to map over."""
    return isinstance(value, int | float)
