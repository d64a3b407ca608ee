"""What is fitted to what, and how surprising a record is under some noise."""

from __future__ import annotations

import dataclasses
import math
import warnings
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ...errors import Status
from ...estimates import AbstractEstimate
from ...filters import AbstractEstimator, Info
from ...linalg import root_and_inverse
from ...models import AbstractModel, Sample
from ...noise import with_scaled_noise
from ..compiled import compiled_call
from ..run import scan
from .entries import NoiseEntry, factors_of
from .records import Record

FAILED = 1e3
"""What a failed row costs [nats]: more than any that is only improbable."""

DOUBTED = 0.01
"""Share of outliers taken for granted where the filter doubts readings."""

WIDER = 3.0
"""Outliers are spread so many times as widely as the innovations of the start."""

NORMAL_MEDIAN = 0.6745
"""Median size of a normal number, in sigmas."""

LEAST_WEIGHT = 0.5
"""A reading that counted less than this is doubted by the filter."""


class Outliers(eqx.Module):
    """Readings that may be anything: a share of them, spread widely whatever the noise that is being fitted.

    Attributes:
        share: of outliers, 0 for none.
        width: of each component's outliers, the scale of a Cauchy distribution (m,).
    """

    share: Float[Array, ""]
    width: Float[Array, " m"]

    @classmethod
    def none(cls, m: int) -> Outliers:
        """No outliers."""
        return cls(jnp.array(0.0), jnp.ones(m))

    def log_likelihood(
        self, residual: Float[Array, " m"], cov: Float[Array, "m m"], seen: Bool[Array, " m"]
    ) -> Float[Array, ""]:
        """Log density of an innovation, component by component, each given those before it.

        ```
        log p = sum_i log((1 - e) N(v_i) / L_ii + e Cauchy(L_ii v_i)),  v = L^-1 r,  S = L L^T
        ```

        A reading far off costs no more than its outlier does, whatever R is, and so does not make R large.
        """
        lower, inverse, _ = root_and_inverse(cov)
        v, size = inverse @ residual, jnp.diagonal(lower)
        size = jnp.where(size > 0, size, 1.0)
        normal = -0.5 * v**2 - jnp.log(size) - 0.5 * math.log(2.0 * math.pi)
        far = jnp.log(self.share) - jnp.log(math.pi * self.width) - jnp.log1p((size * v / self.width) ** 2)
        return jnp.sum(jnp.where(seen, jnp.logaddexp(jnp.log1p(-self.share) + normal, far), 0.0))


@dataclasses.dataclass(frozen=True)
class Problem:
    """What is fitted to what.

    Attributes:
        estimator: with the noise of the start.
        model: of the plant.
        entries: what is fitted.
        records: the records.
        outliers: what is thought of them.
    """

    estimator: AbstractEstimator
    model: AbstractModel
    entries: tuple[NoiseEntry, ...]
    records: tuple[Record, ...]
    outliers: Outliers

    @property
    def parts(self) -> tuple[Any, ...]:
        """What shapes the program."""
        return self.estimator, self.model, self.entries

    def scaled(self, logs: Float[np.ndarray, " entries"]) -> AbstractEstimator:
        """The estimator with factors in place, given their logarithms."""
        states, outputs = factors_of(self.entries, np.asarray(logs, float))
        plain = [{name: float(value) for name, value in each.items()} for each in (states, outputs)]
        return with_scaled_noise(self.estimator, *plain)

    def loss(
        self, logs: Float[np.ndarray, " entries"], held: bool = False
    ) -> tuple[float, Float[np.ndarray, " entries"], int]:
        """Mean negative log likelihood of the rows fitted, or held out, its gradient and how many rows there are."""
        total, slope, count = 0.0, np.zeros(len(self.entries)), 0
        for record in self.records:
            chosen = record.held if held else record.fitted
            if not chosen.any():
                continue
            value, gradient, _ = self._called(logs, record, chosen)
            total, slope, count = total + float(value), slope + np.asarray(gradient), count + int(chosen.sum())
        return total / max(count, 1), slope / max(count, 1), count

    def allowing_for(self, contamination: float | None) -> Problem:
        """The problem with a share of outliers; for None, with some if the filter doubts any of the fitted rows."""
        names = self.model.output.tangent_names
        residuals, doubted = [np.zeros((0, len(names)))], 0
        for record in self.records:
            if record.fitted.any():
                _, _, (residual, doubts) = self._called(np.zeros(len(self.entries)), record, record.fitted)
                seen = record.samples.seen & record.fitted[:, None]
                residuals.append(np.where(seen, np.asarray(residual), np.nan))
                doubted += int(np.sum(doubts))
        if contamination is None:
            contamination = DOUBTED if doubted else 0.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # a component never seen has no median
            median = np.nanmedian(np.abs(np.concatenate(residuals)), axis=0)
        width = WIDER * np.where(median > 0, median, 1.0) / NORMAL_MEDIAN
        return dataclasses.replace(
            self, outliers=Outliers(jnp.asarray(contamination), jnp.asarray(np.nan_to_num(width, nan=1.0)))
        )

    def _called(self, logs: Float[np.ndarray, " entries"], record: Record, rows: Any) -> tuple[Any, Any, Any]:
        """Loss of rows of a record, its gradient, and the innovations with those that hardly counted."""
        ((value, told), gradient), _ = compiled_call(
            _value_and_gradient,
            self.parts,
            jnp.asarray(logs, float),
            record.prior,
            record.samples,
            rows,
            self.outliers,
        )
        return value, gradient, told

    def fitted_loss(self, logs: Float[np.ndarray, " entries"]) -> tuple[float, Float[np.ndarray, " entries"]]:
        """Mean negative log likelihood of the fitted rows and its gradient, both finite."""
        value, slope, _ = self.loss(logs)
        return (value, slope) if np.isfinite(value) and np.isfinite(slope).all() else (FAILED, np.zeros_like(slope))


def scaled_run(
    parts: tuple[Any, ...], logs: Float[Array, " entries"], prior: AbstractEstimate, samples: Sample
) -> tuple[AbstractEstimator, Info]:
    """The estimator with factors in place, and its reports along a record: pure."""
    estimator, model, entries = parts
    chosen = with_scaled_noise(estimator, *factors_of(entries, logs))
    return chosen, scan(chosen, model, prior, samples)[1]


def _value_and_gradient(
    parts: tuple[Any, ...], logs: Array, prior: AbstractEstimate, samples: Sample, rows: Array, outliers: Outliers
) -> tuple[tuple[Array, tuple[Array, Array]], Array]:
    def loss(logs: Array) -> tuple[Array, tuple[Array, Array]]:
        info = scaled_run(parts, logs, prior, samples)[1]
        seen = jnp.asarray(samples.seen)
        doubted = seen & (info.weight < LEAST_WEIGHT) & rows[:, None]
        values = jax.vmap(outliers.log_likelihood)(info.residual, info.residual_cov, seen)
        values = jnp.where(info.status >= Status.not_positive, -FAILED, values)
        return -jnp.sum(jnp.where(rows, values, 0.0)), (info.residual, doubted)

    return jax.value_and_grad(loss, has_aux=True)(logs)
