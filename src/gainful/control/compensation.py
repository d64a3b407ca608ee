"""Running mean and covariance of what a model leaves unexplained."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError, did_you_mean

KINDS = ("exponential", "mean")


class ErrorMoments(eqx.Module):
    """What has been learned of an error.

    Attributes:
        mean: (outputs,).
        variance: (outputs,), or the covariance (outputs, outputs).
        count: errors seen.
    """

    mean: Float[Array, " outputs"]
    variance: Float[Array, "..."]
    count: Float[Array, ""]


class ErrorStatistics(eqx.Module):
    """Running mean and covariance of an error, with the gain `a`:

        mean <- mean + a (e - mean),      variance <- (1 - a) (variance + a (e - mean)^2),      mean the old one in the latter

    "exponential" keeps `a` and so forgets what is older than `1 / a` errors; "mean" takes `a = 1 / (k + head_start)` at the
    error number `k`, which is the plain mean of all of them with what was known at first counting as `head_start` more. The
    plain mean cannot follow an error that drifts.

    Attributes:
        kind: "exponential" or "mean".
        rate: the gain of "exponential"; 1 keeps the latest error alone.
        head_start: of "mean".
        full: the covariance, in place of its diagonal.
        counts: whether the variance is told to who asks how uncertain the error is; if not, only the mean is of use.

    Raises:
        ConfigError: an unknown kind, a rate outside (0, 1], or a negative head start.

    Example:
        >>> statistics = ErrorStatistics("mean", head_start=0.0)
        >>> moments = statistics.init(1)
        >>> for e in (3.0, 6.0):
        ...     moments = statistics.update(moments, jnp.array([e]))
        >>> moments.mean.tolist(), moments.variance.tolist()
        ([4.5], [2.25])
    """

    kind: str = eqx.field(static=True, default="exponential")
    rate: float | Array = 0.02
    head_start: float | Array = 200.0
    full: bool = eqx.field(static=True, default=False)
    counts: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        if self.kind not in KINDS:
            raise ConfigError(f"kind: {self.kind!r} is not known; {did_you_mean(self.kind, KINDS)}")
        if isinstance(self.rate, float | int) and not 0 < self.rate <= 1:
            raise ConfigError(f"rate: expected a number above 0 and at most 1, got {self.rate!r}")
        if isinstance(self.head_start, float | int) and not self.head_start >= 0:
            raise ConfigError(f"head_start: expected a number of at least 0, got {self.head_start!r}")

    def init(self, outputs: int) -> ErrorMoments:
        """No error yet: mean and variance zero."""
        return ErrorMoments(jnp.zeros(outputs), jnp.zeros((outputs, outputs) if self.full else outputs), jnp.zeros(()))

    def of(self, errors: Any) -> ErrorMoments:
        """Moments to start from, of errors seen before, such as the residuals of training (N, outputs).

        Raises:
            ShapeError: errors that are no table with at least one row.
        """
        errors = jnp.asarray(errors, float)
        if errors.ndim != 2 or not len(errors):
            raise ShapeError(f"errors: expected one row per sample, got shape {errors.shape}")
        apart = errors - errors.mean(axis=0)
        variance = apart.T @ apart / len(errors) if self.full else jnp.mean(apart**2, axis=0)
        return ErrorMoments(errors.mean(axis=0), variance, jnp.zeros(()))

    def update(self, moments: ErrorMoments, error: Float[Array, " outputs"]) -> ErrorMoments:
        """The moments with one error more."""
        count = moments.count + 1.0
        a = jnp.asarray(self.rate) if self.kind == "exponential" else 1.0 / (count + self.head_start)
        apart = error - moments.mean
        square = jnp.outer(apart, apart) if self.full else apart**2
        return ErrorMoments(moments.mean + a * apart, (1.0 - a) * (moments.variance + a * square), count)

    def counted(self, moments: ErrorMoments) -> Float[Array, "..."] | None:
        """The variance, if it counts."""
        return moments.variance if self.counts else None
