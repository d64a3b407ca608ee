"""Series that are small while nothing is wrong and large when something is."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import scipy.special
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError
from ..running import Result


def windowed_mean(values: Float[Array, " T"], window: int) -> Float[Array, " T"]:
    """Mean of the last `window` values that are not NaN; NaN until there are so many.

    Of a sound filter's NIS with `m` components it is chi-square with `m window` degrees, divided by `window`.

    Args:
        values: one per row, NaN where nothing was measured.
        window: how many count.

    Raises:
        ConfigError: a window that is not a whole number of at least 1.

    Example:
        >>> windowed_mean(jnp.array([1.0, jnp.nan, 3.0, 5.0]), 2).tolist()
        [nan, nan, 2.0, 4.0]
    """
    _check_count(window, "window")
    values = jnp.asarray(values)

    def step(last: Array, value: Array) -> tuple[Array, Array]:
        last = jnp.where(jnp.isnan(value), last, jnp.concatenate([last[1:], value[None]]))
        return last, jnp.mean(last)

    # The values themselves are carried: running sums would keep the rounding of the largest ever seen.
    return jax.lax.scan(step, jnp.full(window, jnp.nan, values.dtype), values)[1]


def fault_scores(mean: Float[Array, "... size"], cov: Float[Array, "... dof dof"], count: int) -> Float[Array, "... k"]:
    """Estimates of the last `count` states in units of their standard deviations; 0 where that is 0.

    Args:
        mean: estimated states, for any number of rows and runs.
        cov: their covariances.
        count: how many states are faults.

    Raises:
        ConfigError: a count that is not a whole number of at least 1.
    """
    _check_count(count, "count")
    variance = jnp.diagonal(cov, axis1=-2, axis2=-1)[..., -count:]
    known = variance > 0
    return jnp.where(known, mean[..., -count:] / jnp.sqrt(jnp.where(known, variance, 1.0)), 0.0)


def normalised_innovations(
    residual: Float[Array, "... m"], cov: Float[Array, "... m m"], seen: Bool[Array, "... m"]
) -> Float[Array, "... m"]:
    """Innovations in units of their own standard deviations; NaN where nothing was measured."""
    return jnp.where(seen, residual / jnp.sqrt(jnp.diagonal(cov, axis1=-2, axis2=-1)), jnp.nan)


def cusum(scores: Float[Array, "T ..."], drift: float = 1.0) -> Float[Array, "T ..."]:
    """Two-sided cumulative sum: how much the scores have lately kept to one side of 0 by more than `drift`.

    ```
    up <- max(0, up + z - drift),   down <- max(0, down - z - drift);   max(up, down)
    ```

    Args:
        scores: normalised innovations or fault scores; NaN leaves the sums as they are.
        drift: half the mean shift, in sigmas, that is to be found soonest.

    Source: Page (1954), Biometrika 41(1/2):100-115.

    Example:
        >>> cusum(jnp.array([0.0, 3.0, 3.0, -9.0]), drift=1.0).tolist()
        [0.0, 2.0, 4.0, 8.0]
    """
    scores = jnp.asarray(scores)

    def step(sums: tuple[Array, Array], z: Array) -> tuple[tuple[Array, Array], Array]:
        moved = tuple(jnp.maximum(0.0, total + side * z - drift) for total, side in zip(sums, (1, -1), strict=True))
        up, down = (jnp.where(jnp.isnan(z), old, new) for old, new in zip(sums, moved, strict=True))
        return (up, down), jnp.maximum(up, down)

    zero = jnp.zeros(scores.shape[1:], scores.dtype)
    return jax.lax.scan(step, (zero, zero), scores)[1]


def mean_jump(scores: Float[Array, "T ..."], window: int = 60, bound: float = float("inf")) -> Float[Array, "T ..."]:
    """Generalised likelihood ratio of a jump of the mean at some row of the window, twice its logarithm.

    ```
    max over n = 1 ... window of  (sum of the last n z)^2 / (n + 1 / bound^2)
    ```

    For white scores of one sigma, such as normalised innovations. Jumps of a state, whose effect on the innovations
    fades as the filter follows, are told better by a filter that carries the hypotheses along.

    Args:
        scores: one per row; NaN counts as no information.
        window: latest rows in which the jump may have begun.
        bound: largest jump expected, in sigmas.

    Raises:
        ConfigError: a window that is not a whole number of at least 1.

    Source: Basseville and Nikiforov (1993), Detection of Abrupt Changes, 2.4.3.
    Differs: a ridge by the largest jump expected.
    """
    _check_count(window, "window")
    scores = jnp.asarray(scores)
    ridge = bound**-2

    def step(sums: tuple[Array, Array], z: Array) -> tuple[tuple[Array, Array], Array]:
        known = ~jnp.isnan(z)
        # Each hypothesis has its own sum and count; the oldest makes room for the one that begins now.
        total, count = (jnp.concatenate([past[1:], jnp.zeros_like(past[:1])]) for past in sums)
        total, count = total + jnp.where(known, z, 0.0), count + known
        return (total, count), jnp.max(total**2 / jnp.maximum(count + ridge, 1e-300), axis=0)

    empty = jnp.zeros((window, *scores.shape[1:]), scores.dtype)
    return jax.lax.scan(step, (empty, empty), scores)[1]


def detection_statistics(
    nis: Float[Array, " T"], scores: Float[Array, "T k"], *, window: int = 20, drift: float = 1.0
) -> dict[str, Float[Array, " T"]]:
    """The usual statistics of a run by name: pure, so `vmap` over runs applies.

    Args:
        nis: normalised innovation squared, NaN where nothing was measured.
        scores: from `fault_scores`.
        window: rows of the windowed mean.
        drift: of the cumulative sum.

    Returns:
        `nis`; `nis_mean`, over the window; `score`, the largest absolute fault score; `cusum`, the largest of its sums.
    """
    return {
        "nis": jnp.asarray(nis),
        "nis_mean": windowed_mean(nis, window),
        "score": jnp.max(jnp.abs(scores), axis=-1),
        "cusum": jnp.max(cusum(scores, drift), axis=-1),
    }


def result_statistics(result: Result, *, window: int = 20, drift: float = 1.0) -> dict[str, np.ndarray]:
    """The `detection_statistics` of a run whose model has faults or other added states.

    Args:
        result: of a run.
        window: rows of the windowed mean.
        drift: of the cumulative sum.

    Raises:
        ConfigError: a model without added states.
    """
    nis = jnp.where(result.seen.any(axis=1), jnp.asarray(result.nis), jnp.nan)
    scores = fault_scores(jnp.asarray(result.mean), jnp.asarray(result.cov), result.model.space.added)
    found = detection_statistics(nis, scores, window=window, drift=drift)
    return {name: np.asarray(values) for name, values in found.items()}


def chi_square_threshold(degrees: int, probability: float, window: int = 1) -> float:
    """What the NIS, or its mean over a window, exceeds in one row of a sound filter with a probability.

    ```
    chi-square quantile(1 - probability; degrees window) / window
    ```

    Innovations of a sound filter are independent, so for a window of 1 the probability is the false-alarm rate times
    the step. Windowed means overlap: for a rate of theirs, `calibrate_threshold`.

    Args:
        degrees: components measured.
        probability: of one row.
        window: rows averaged.

    Raises:
        ConfigError: degrees or a window below 1, or a probability outside (0, 1).

    Example:
        >>> round(chi_square_threshold(1, 0.05), 2)
        3.84
    """
    _check_count(degrees, "degrees")
    _check_count(window, "window")
    if not 0 < probability < 1:
        raise ConfigError(f"probability: expected a number between 0 and 1, got {probability!r}")
    return float(2 * scipy.special.gammainccinv(0.5 * degrees * window, probability) / window)


def _check_count(value: int, name: str) -> None:
    if not (isinstance(value, (int, np.integer)) and value >= 1):
        raise ConfigError(f"{name}: expected a whole number of at least 1, got {value!r}")
