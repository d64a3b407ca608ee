"""What aiding a filter was worth."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from ..networks import TrainingReport


@dataclasses.dataclass(frozen=True)
class AidingReport:
    """What training a network beside a filter came to, on records held out and, for comparison, on its own.

    Squares are means over the steady rows of all records, in tangent units squared.

    Attributes:
        states: names of the components, as the covariance has them.
        accepted: which of them the correction made better on held-out records, beyond chance.
        base: mean square error of the filter alone on held-out records (n,).
        aided: that of the aided filter there, gates and all (n,).
        low: lower end of the 95 % interval of `base - aided`, paired by record (n,).
        high: upper end (n,).
        base_in_sample: as `base` on the training records (n,).
        aided_in_sample: as `aided` there (n,).
        passed: share of measured rows whose correction the online gate let through.
        flagged: share of measured rows at which the network was asked where it had learned nothing.
        nees_of_filter: mean normalised square of the aided errors under the filter's own covariance.
        nees: the same under the validated covariance, each half of the records judged by the other; ideal is the number of
            states with a reference.
        trainings: report of each pass.
        warnings: what a reader of the numbers should know.
    """

    states: tuple[str, ...]
    accepted: tuple[bool, ...]
    base: Float[np.ndarray, " n"]
    aided: Float[np.ndarray, " n"]
    low: Float[np.ndarray, " n"]
    high: Float[np.ndarray, " n"]
    base_in_sample: Float[np.ndarray, " n"]
    aided_in_sample: Float[np.ndarray, " n"]
    passed: float
    flagged: float
    nees_of_filter: float
    nees: float
    trainings: tuple[TrainingReport, ...]
    warnings: tuple[str, ...] = ()

    @property
    def components(self) -> tuple[str, ...]:
        """The states that were accepted."""
        return tuple(name for name, passed in zip(self.states, self.accepted, strict=True) if passed)

    def __str__(self) -> str:
        width = max(len(name) for name in ("state", *self.states))
        lines = [f"{'state':<{width}}  {'filter':>9}  {'aided':>9}  95 % interval of the gain  in sample"]
        for k, name in enumerate(self.states):
            interval = f"[{self.low[k]:.3g}, {self.high[k]:.3g}]"
            inside = f"{self.base_in_sample[k]:.3g} -> {self.aided_in_sample[k]:.3g}"
            verdict = "" if self.accepted[k] else "  (not corrected)"
            lines.append(
                f"{name:<{width}}  {self.base[k]:>9.3g}  {self.aided[k]:>9.3g}  {interval:<25}  {inside}{verdict}"
            )
        lines.append(
            f"corrected in {100 * self.passed:.3g} % of rows, unknown to the network {100 * self.flagged:.3g} %"
        )
        lines.append(f"NEES of the aided estimate: {self.nees_of_filter:.3g} by the filter, {self.nees:.3g} validated")
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])
