"""What a study came to: numbers by name, and what they say of its claims."""

from __future__ import annotations

import dataclasses
import functools
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from ..errors import ConfigError, did_you_mean
from .claims import VERDICTS, Finding, Verdict
from .experiment import Quantity
from .figures import Table, heading
from .monte_carlo import Results, Trace
from .statistics import (
    Measured,
    difference_interval,
    exactly,
    mean_interval,
    median_interval,
    ratio_interval,
    rms_interval,
    share_interval,
)

if TYPE_CHECKING:
    from .base import Study


@dataclasses.dataclass(frozen=True)
class Outcome:
    """The numbers of a study, asked for by the names of experiment, contender and quantity.

    Numbers of an experiment without noise are exact: their interval has no width.

    Attributes:
        study: that was run.
        runs: asked for.
        seed: of the random keys.
        results: by experiment.
    """

    study: Study
    runs: int
    seed: int
    results: dict[str, Results]

    def values(self, experiment: str, contender: str, quantity: str) -> Float[np.ndarray, "n"]:
        """One number per run (n,).

        Raises:
            ConfigError: there is nothing of that name.
        """
        by_contender = self._results(experiment).values
        by_quantity = _named(by_contender, contender, f"contender of experiment {experiment!r}")
        return _named(by_quantity, quantity, f"quantity of experiment {experiment!r}")

    def trace(self, experiment: str, contender: str, name: str) -> Trace:
        """A series: of the first run, and its mean over runs.

        Raises:
            ConfigError: there is nothing of that name.
        """
        traces = _named(self._results(experiment).traces, contender, f"contender of experiment {experiment!r}")
        return _named(traces, name, f"trace of experiment {experiment!r}")

    def every(self, experiment: str, contender: str, name: str) -> Float[np.ndarray, "n ..."]:
        """A series of every run, one that the experiment keeps.

        Raises:
            ConfigError: there is nothing of that name.
        """
        kept = _named(self._results(experiment).every, contender, f"contender of experiment {experiment!r}")
        return _named(kept, name, f"kept trace of experiment {experiment!r}")

    def record(self, experiment: str) -> Any:
        """What was simulated in the first run, as NumPy arrays."""
        return self._results(experiment).record

    def mean(self, experiment: str, contender: str, quantity: str) -> Measured:
        """The mean over runs with its Student-t interval."""
        return self._told(mean_interval, experiment, contender, quantity)

    def median(self, experiment: str, contender: str, quantity: str) -> Measured:
        """The median over runs between order statistics."""
        return self._told(median_interval, experiment, contender, quantity)

    def rms(self, experiment: str, contender: str, quantity: str) -> Measured:
        """The root mean square over runs."""
        return self._told(rms_interval, experiment, contender, quantity)

    def share(self, experiment: str, contender: str, quantity: str) -> Measured:
        """The share of runs in which something happened, with Wilson's interval."""
        if not self._results(experiment).experiment.random:
            return self._told(mean_interval, experiment, contender, quantity)
        return share_interval(self.values(experiment, contender, quantity))

    def summary(self, experiment: str, contender: str, quantity: str) -> Measured:
        """The statistic that the quantity asks for."""
        statistic = self.quantity(experiment, quantity).statistic
        return {"mean": self.mean, "median": self.median, "rms": self.rms, "share": self.share}[statistic](
            experiment, contender, quantity
        )

    def ratio(self, experiment: str, quantity: str, contender: str, *, over: str) -> Measured:
        """The mean of one contender over that of another, on the same runs."""
        a, b = (self.values(experiment, name, quantity) for name in (contender, over))
        if not self._results(experiment).experiment.random:
            return exactly(a[0] / b[0])
        return ratio_interval(a, b)

    def difference(self, experiment: str, quantity: str, contender: str, *, minus: str) -> Measured:
        """The mean of one contender less that of another, on the same runs."""
        a, b = (self.values(experiment, name, quantity) for name in (contender, minus))
        unit = self.quantity(experiment, quantity).unit
        if not self._results(experiment).experiment.random:
            return exactly(a[0] - b[0], unit)
        return difference_interval(a, b, unit=unit)

    def quantity(self, experiment: str, name: str) -> Quantity:
        """A quantity of an experiment."""
        known = {quantity.name: quantity for quantity in self._results(experiment).experiment.quantities}
        return _named(known, name, f"quantity of experiment {experiment!r}")

    def table(self, experiment: str, quantities: Sequence[str] = (), *, title: str = "") -> Table:
        """Contenders by quantities: all of an experiment, or those named."""
        about = self._results(experiment).experiment
        chosen = [self.quantity(experiment, name) for name in quantities] or list(about.quantities)
        rows = [
            (self._titled([experiment], name), *(self.summary(experiment, name, quantity.name) for quantity in chosen))
            for name in about.contenders
        ]
        heads = [heading(quantity.title, quantity.unit) for quantity in chosen]
        return Table(title or about.title, ("Contender", *heads), tuple(rows))

    def compared(self, title: str, quantity: str, experiments: Iterable[str] = ()) -> Table:
        """Contenders by experiments for one quantity; a dash where an experiment has no such contender."""
        chosen = list(experiments) or list(self.results)
        names = dict.fromkeys(name for each in chosen for name in self._results(each).experiment.contenders)
        heads = [heading(self._results(each).experiment.title, self.quantity(each, quantity).unit) for each in chosen]
        rows = [
            (
                self._titled(chosen, name),
                *(
                    self.summary(each, name, quantity) if name in self._results(each).values else None
                    for each in chosen
                ),
            )
            for name in names
        ]
        return Table(title, ("Contender", *heads), tuple(rows))

    @functools.cached_property
    def findings(self) -> tuple[Finding, ...]:
        """The claims with their verdicts."""
        return tuple(claim.judge(self) for claim in self.study.claims)

    @property
    def counts(self) -> dict[Verdict, int]:
        """How many claims came to each verdict, those that occur."""
        found = Counter(finding.verdict for finding in self.findings)
        return {verdict: found[verdict] for verdict in VERDICTS if found[verdict]}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the numbers should know: steps that failed, and numbers that are none."""
        out = []
        for name, results in self.results.items():
            for contender, failed in results.failed.items():
                if failed.any():
                    runs = f"{(failed > 0).sum()} of {len(failed)} runs"
                    out.append(f"{contender} in experiment {name!r}: {failed.sum():,} steps failed, in {runs}")
            for contender, quantities in results.values.items():
                for quantity, values in quantities.items():
                    bad = int(np.isnan(values).sum())
                    # Everywhere means that it has no meaning for this contender.
                    if 0 < bad < len(values):
                        out.append(f"{contender} in experiment {name!r}: no {quantity} in {bad} of {len(values)} runs")
        return tuple(out)

    def _results(self, experiment: str) -> Results:
        return _named(self.results, experiment, f"experiment of study {self.study.name!r}")

    def _told(self, statistic: Any, experiment: str, contender: str, quantity: str) -> Measured:
        values, unit = self.values(experiment, contender, quantity), self.quantity(experiment, quantity).unit
        random = self._results(experiment).experiment.random
        return statistic(values, unit=unit) if random else exactly(values[0], unit)

    def _titled(self, experiments: Sequence[str], contender: str) -> str:
        fair = any(self._results(name).experiment.baseline == contender for name in experiments)
        return f"{contender} (fair baseline)" if fair else contender


def _named(known: dict[str, Any], name: str, what: str) -> Any:
    if name not in known:
        raise ConfigError(f"{what}: {name!r} is not known; {did_you_mean(name, known)}")
    return known[name]
