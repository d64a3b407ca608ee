"""Which parts of a record a diagnosis may count."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from ..errors import Status
from ..running import Result

LEAST_WEIGHT = 0.5
"""A component that counted less than this is left out of the statistics, and reported."""


@dataclasses.dataclass(frozen=True)
class Innovations:
    """The filter's innovations on the rows that measured something and did not fail.

    Attributes:
        residual: measured minus expected (rows, m).
        cov: its covariance (rows, m, m).
        nis: normalised innovation squared of everything seen (rows,).
        seen: which components were measured (rows, m).
        weight: how far each component counted (rows, m).
    """

    residual: Float[np.ndarray, "rows m"]
    cov: Float[np.ndarray, "rows m m"]
    nis: Float[np.ndarray, " rows"]
    seen: Bool[np.ndarray, "rows m"]
    weight: Float[np.ndarray, "rows m"]

    @property
    def used(self) -> Bool[np.ndarray, "rows m"]:
        """Which measured components counted with at least `LEAST_WEIGHT`."""
        return self.seen & (self.weight >= LEAST_WEIGHT)

    @property
    def counts(self) -> dict[str, int]:
        """Rows not used in full, by what became of them; none is counted twice."""
        refused = self.seen & (self.weight <= 0)
        whole, some = (refused == self.seen).all(axis=1), refused.any(axis=1)
        faded = ~some & (self.used != self.seen).any(axis=1)
        kinds = {"rejected": whole, "partly rejected": some & ~whole, "down-weighted": faded}
        return {kind: int(rows.sum()) for kind, rows in kinds.items() if rows.any()}

    @property
    def share_left_out(self) -> float:
        """Measured components that were left out, per measured component."""
        return 1.0 - float(self.used.sum()) / max(int(self.seen.sum()), 1)


def failed_rows(result: Result) -> Bool[np.ndarray, " T"]:
    """Rows whose step could not be carried out."""
    return result.status >= Status.not_positive


def innovations_of(result: Result) -> Innovations:
    """The innovations to be judged; those of the filter where the result is smoothed."""
    source = result if result.filtered is None else result.filtered
    rows = source.log.kept & source.seen.any(axis=1) & ~failed_rows(source)
    rows &= np.isfinite(source.nis) & np.isfinite(source.residual).all(axis=1)
    given = (values[rows] for values in (source.residual, source.residual_cov, source.nis, source.seen, source.weight))
    return Innovations(*given)


def judged_rows(result: Result) -> Bool[np.ndarray, " T"]:
    """Rows whose estimate may be compared with the truth: of the record itself, and not failed."""
    return result.log.kept & ~failed_rows(result)
