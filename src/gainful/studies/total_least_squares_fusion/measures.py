"""The numbers by which estimates along a record are judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import ndtri

from ...filters import Info
from ...regression import Fit
from ..experiment import Experiment, Quantity, Record
from .records import PARAMETERS, Axis, NoisyRows

EARLY = (50, 200, 500)
"""Samples after which errors are told besides those at the end."""
REACH = float(ndtri(0.975))
"""Standard deviations either way that a normal estimate's 95 % interval reaches."""
LOST = 1.0
"""Relative error from which an estimate is called lost."""
SHOWN = np.concatenate([np.arange(200), np.arange(209, 2000, 10)])
"""Rows of which every run is kept: all at first, one in ten later."""
AFTER = SHOWN + 1
"""The same as numbers of samples."""


def path_of(record: Record, reading: Info | Fit) -> Float[Array, "T 3"]:
    """Estimates along a record; a fit has but the last."""
    if isinstance(reading, Fit):
        return jnp.full_like(record.truth["theta"], jnp.nan).at[-1].set(reading.theta)
    return reading.estimate.mean


def relative_errors(record: Record, reading: Info | Fit) -> Float[Array, " T"]:
    """The distance from the true parameters over their size, sample by sample."""
    truth = record.truth["theta"]
    size = jnp.linalg.norm(truth, axis=1)
    return jnp.linalg.norm(path_of(record, reading) - truth, axis=1) / size


class Measure(eqx.Module):
    """From a record and what a contender made of it to the quantities."""

    def __call__(self, record: Record, reading: Info | Fit) -> dict[str, Array]:
        error = relative_errors(record, reading)
        off = path_of(record, reading)[-1] - record.truth["theta"][-1]
        return {
            "error": error[-1],
            "lost": error[-1] > LOST,
            **{name: off[i] for i, name in enumerate(PARAMETERS)},
            **{f"error_{k}": error[k - 1] for k in EARLY},
        }


class Traces(eqx.Module):
    """From the same to series at some of the samples.

    Attributes:
        rows: of the record.
    """

    rows: Array

    def __call__(self, record: Record, reading: Info | Fit) -> dict[str, Array]:
        return {
            "error": relative_errors(record, reading)[self.rows],
            "theta": path_of(record, reading)[self.rows],
        }


def quantities(axis: Axis) -> tuple[Quantity, ...]:
    """The quantities of `Measure` for an axis."""
    return (
        Quantity("error", "relative error"),
        *(Quantity(name, f"bias of {name}", unit) for name, unit in axis.unit_of.items()),
        *(Quantity(f"error_{k}", f"relative error after {k} samples") for k in EARLY),
        Quantity("lost", "lost", statistic="share"),
    )


def judged(
    name: str,
    title: str,
    axis: Axis,
    records: NoisyRows,
    contenders: Mapping[str, Callable[[Any], Any]],
    *,
    baseline: str = "",
    kept: tuple[str, ...] = (),
) -> Experiment:
    """An experiment of constant parameters: they differ in records and contenders, and all are judged alike."""
    return Experiment(
        name,
        title,
        records,
        contenders,
        Measure(),
        quantities(axis),
        Traces(jnp.asarray(SHOWN)),
        baseline=baseline,
        kept=kept,
    )
