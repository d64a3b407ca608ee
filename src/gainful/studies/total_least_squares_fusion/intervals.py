"""What a record says of its own uncertainty: intervals by several formulas, and the bias of least squares."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...regression import (
    count_rows,
    errors_in_variables_scores,
    information,
    instrumental_variables,
    least_squares_bias,
    sandwich_covariance,
    total_least_squares,
)
from ..chapter import Chapter
from ..claims import Check, Claim, Tolerance, above, between
from ..experiment import Experiment, Quantity, Record
from ..figures import Table
from ..outcome import Outcome
from ..statistics import Measured
from .contenders import CROSS
from .fusion import CASES, HEADS, title
from .measures import REACH
from .records import PARAMETERS, WORDS, noisy_rows, rows_of

SINGLE, STACKED, MEAN = "TLS, one sensor", "TLS, stacked", "TLS of the mean"
FULL, SANDWICH, SHORT = "full", "sandwich", "first order"
KINDS = (FULL, SANDWICH, SHORT)
"""Formulas for the covariance; the last leaves out what noise of the regressors adds to itself."""


def asked(name: str) -> str:
    """The experiment with the records of another."""
    return f"intervals-{name}"


class Told(eqx.Module):
    """What a record says.

    Attributes:
        theta: the parameters (3,).
        std: their standard deviations by formula (3,).
        bias: that least squares of the same rows would have (3,).
    """

    theta: Float[Array, "3"]
    std: dict[str, Float[Array, "3"]]
    bias: Float[Array, "3"]


class TotalLeastSquares(eqx.Module):
    """A contender: all rows at once, of one sensor, of both or of their mean.

    Attributes:
        mixing: of the sensors' rows; one without any counts for nothing (2, 2).
    """

    mixing: Float[Array, "2 2"]

    def __call__(self, record: Record) -> Told:
        counted = jnp.any(self.mixing != 0, axis=1)[:, None]
        rows = jnp.where(counted, jnp.einsum("ij,tjp->tip", self.mixing, rows_of(record)), jnp.nan)
        S, count = information(rows), count_rows(rows)
        fit = total_least_squares(S, count)
        n, p = len(fit.theta), len(S)
        excess = S[:n, :n] - jnp.linalg.eigvalsh(S)[0] * jnp.eye(n)
        noise = fit.noise_scale * jnp.eye(p)
        scores = errors_in_variables_scores(rows.reshape(-1, p), fit.theta, noise)
        short = fit.noise_scale * (1.0 + fit.theta @ fit.theta) * jnp.linalg.inv(excess)
        std = {
            FULL: fit.std,
            SANDWICH: jnp.sqrt(jnp.diagonal(sandwich_covariance(scores, excess))),
            SHORT: jnp.sqrt(jnp.diagonal(short)),
        }
        return Told(fit.theta, std, least_squares_bias(excess / count, fit.theta, noise))


class AcrossSensors(eqx.Module):
    """A contender: one sensor as the instrument of the other, with its sandwich."""

    def __call__(self, record: Record) -> Told:
        rows = rows_of(record)
        fit = instrumental_variables(rows[:, 0], rows[:, 1])
        none = jnp.full_like(fit.theta, jnp.nan)
        return Told(fit.theta, {FULL: none, SANDWICH: fit.std, SHORT: none}, none)


class Measure(eqx.Module):
    """From a record and what it says to the quantities."""

    def __call__(self, record: Record, told: Told) -> dict[str, Array]:
        off = jnp.abs(told.theta - record.truth["theta"][-1])
        inside = {
            f"{kind}_{name}": jnp.where(jnp.isfinite(std[i]), off[i] <= REACH * std[i], jnp.nan)
            for kind, std in told.std.items()
            for i, name in enumerate(PARAMETERS)
        }
        return inside | {f"bias_{name}": told.bias[i] for i, name in enumerate(PARAMETERS)}


CONTENDERS = {
    SINGLE: TotalLeastSquares(jnp.array([[1.0, 0.0], [0.0, 0.0]])),
    STACKED: TotalLeastSquares(jnp.eye(2)),
    MEAN: TotalLeastSquares(jnp.array([[0.5, 0.5], [0.0, 0.0]])),
    CROSS: AcrossSensors(),
}


def experiment(name: str) -> Experiment:
    """The records of an experiment, asked for their own uncertainty."""
    axis, variance = CASES[name]
    quantities = (
        *(Quantity(f"{kind}_{each}", f"{kind}, {each}", statistic="share") for kind in KINDS for each in PARAMETERS),
        *(Quantity(f"bias_{each}", f"bias of least squares in {each}", unit) for each, unit in axis.unit_of.items()),
    )
    records = noisy_rows(axis, (variance, variance))
    return Experiment(asked(name), f"Intervals, {title(name)}", records, CONTENDERS, Measure(), quantities)


def tables(outcome: Outcome) -> list[Table]:
    """How often intervals hold the truth."""
    chosen = [(name, kind) for name in CONTENDERS for kind in (KINDS if name != CROSS else (SANDWICH,))]
    return [
        Table(
            f"How often 95 % intervals hold the truth: {words}",
            ("Estimator: formula", *HEADS[1:]),
            tuple(
                (f"{name}: {kind}", *(outcome.share(asked(case), name, f"{kind}_{each}") for case in CASES))
                for name, kind in chosen
            ),
        )
        for each, words in WORDS.items()
    ]


def _least(contender: str, kind: str, expected: Tolerance) -> Check:
    def least(outcome: Outcome) -> Measured:
        shares = [outcome.share(asked(name), contender, f"{kind}_{each}") for name in CASES for each in PARAMETERS]
        return min(shares, key=lambda found: found.value)

    return Check(f"least share in 95 % intervals over parameters and experiments, {contender}, {kind}", least, expected)


CLAIMS = (
    Claim(
        "intervals",
        "Intervals hold the truth as often as they say, by the full formula or without a model of the noise.",
        "not in the paper, which has none",
        (
            *(_least(each, kind, between(0.85, 1.0)) for each in (SINGLE, STACKED, MEAN) for kind in KINDS[:2]),
            _least(CROSS, SANDWICH, between(0.85, 1.0)),
        ),
    ),
    Claim(
        "first-order intervals",
        "A formula of first order in the noise will do.",
        "not in the paper",
        tuple(_least(each, SHORT, above(0.85)) for each in (SINGLE, STACKED, MEAN)),
        dict.fromkeys(
            ("not reproduced", "partly"),
            "What noise of the regressors adds to itself widens intervals the more, the weaker a direction is excited.",
        ),
    ),
)


def chapter() -> Chapter:
    """The same records as in the fusion, all rows at once."""
    return Chapter(tuple(map(experiment, CASES)), CLAIMS, tables)
