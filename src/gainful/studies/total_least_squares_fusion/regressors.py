"""Estimators for rows whose columns all come from one noisy rate, from the simplest to those that know why it is noisy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float
from scipy.signal import savgol_coeffs

from ...regression import (
    Fit,
    RateRowNoise,
    accumulated_noise,
    bias_compensated_least_squares,
    generalized_total_least_squares,
    information,
    instrumental_variables,
    least_squares,
    rate_rows,
    total_least_squares,
    weak_rows,
)
from ...regression.rates import filtered
from ...regression.weak_form import WINDOW
from .rates import RateRecord
from .records import STEP

PLAIN, ISOTROPIC, SCALED = "LS", "isotropic TLS", "TLS, columns scaled"
GENERAL, COMPENSATED, CROSS = "GTLS, row covariance", "BCLS, row covariance", "IV across sensors"
WEAK, WEAK_CROSS, SMOOTHED = "weak LS", "weak IV", "LS, smoothed"
SMOOTHING = 9
"""Samples of the cubic Savitzky-Golay filters."""


def plain(record: RateRecord) -> Fit:
    """Least squares of the mean rate and its central difference."""
    return least_squares(information(_rows(record)))


def isotropic(record: RateRecord) -> Fit:
    """The paper's: equal noise in all columns."""
    return total_least_squares(information(_rows(record)))


def scaled(record: RateRecord) -> Fit:
    """Total least squares of columns brought to equal noise, which leaves out that their noise is correlated."""
    rows = _rows(record)
    noise = accumulated_noise(rows, _noise(record))
    return generalized_total_least_squares(information(rows), jnp.diag(jnp.diagonal(noise)))


def general(record: RateRecord) -> Fit:
    """Total least squares with the covariance of every row."""
    rows = _corrected(record)
    return generalized_total_least_squares(information(rows), accumulated_noise(rows, _noise(record)))


def compensated(record: RateRecord) -> Fit:
    """Least squares with the noise taken out of its sums."""
    rows = _corrected(record)
    return bias_compensated_least_squares(information(rows), accumulated_noise(rows, _noise(record)))


def smoothed(record: RateRecord) -> Fit:
    """Least squares of what cubic Savitzky-Golay filters make of the mean rate and the wrench."""
    smooth = savgol_coeffs(SMOOTHING, 3, use="dot")
    slope = tuple(float(each) for each in savgol_coeffs(SMOOTHING, 3, deriv=1, use="dot"))
    rate, wrench = (filtered(each, smooth) for each in (record.mean_rate, record.wrench))
    acceleration = filtered(record.mean_rate, [each / STEP for each in slope])
    rows = jnp.stack([acceleration, rate, rate * jnp.abs(rate), wrench], axis=1)
    return least_squares(information(rows[:, None]))


def weak(record: RateRecord) -> Fit:
    """Least squares of the mean rate in weak form."""
    rows = weak_rows(record.mean_rate, record.wrench, STEP, std=record.mean_std)
    return least_squares(information(rows[:, None]))


class AcrossRates(eqx.Module):
    """One rate sensor as the instrument of the other, which asks for nothing but the mean of `r|r|`.

    Attributes:
        window: of the weak form, in samples; 0 for central differences.
    """

    window: int = eqx.field(static=True, default=0)

    def __call__(self, record: RateRecord) -> Fit:
        if self.window:
            rows = weak_rows(record.rates, record.wrench, STEP, std=record.rate_std, window=self.window)
        else:
            rows = rate_rows(record.rates, record.wrench, STEP, std=record.rate_std)
        return instrumental_variables(rows[0], rows[1], lag=2 * (self.window or 5))


def everybody() -> dict[str, Callable[[Any], Fit]]:
    """All estimators of the chapter."""
    return {
        PLAIN: plain,
        SMOOTHED: smoothed,
        ISOTROPIC: isotropic,
        SCALED: scaled,
        GENERAL: general,
        COMPENSATED: compensated,
        CROSS: AcrossRates(),
        WEAK: weak,
        WEAK_CROSS: AcrossRates(WINDOW),
    }


def _rows(record: RateRecord, std: Float[Array, ""] | None = None) -> Float[Array, "T 1 4"]:
    return rate_rows(record.mean_rate, record.wrench, STEP, std=std)[:, None]


def _corrected(record: RateRecord) -> Float[Array, "T 1 4"]:
    """With what noise adds to `r|r|` on average taken away."""
    return _rows(record, record.mean_std)


def _noise(record: RateRecord) -> RateRowNoise:
    return RateRowNoise(record.mean_std, record.wrench_std, STEP)  # type: ignore[arg-type]  # arrays will do
