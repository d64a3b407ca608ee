"""One experiment of a study: who is compared, on what, and by which numbers."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, Literal, get_args

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate
from ..filters import AbstractEstimator, Info
from ..models import AbstractModel, Sample
from ..running.run import scan

Statistic = Literal["mean", "median", "rms", "share"]
"""What is told of a quantity over runs."""


class Record(eqx.Module):
    """What a simulation hands to the contenders, and what only the judges see.

    Attributes:
        samples: stacked along time.
        truth: whatever the contenders are judged against, by name.
    """

    samples: Sample
    truth: dict[str, Float[Array, "..."]]


class Contender(eqx.Module):
    """An assembled filter: an estimator, the model that it believes in, and where it starts.

    Contenders that differ only in numbers share one compiled program.

    Attributes:
        estimator: what steps.
        model: that it believes in.
        prior: the estimate before the first sample, or a function that makes it of the record.
    """

    estimator: AbstractEstimator
    model: AbstractModel
    prior: AbstractEstimate | Callable[[Any], AbstractEstimate]

    def __call__(self, record: Any) -> Info:
        """The filter's reports along a record, stacked along time."""
        prior = self.prior if isinstance(self.prior, AbstractEstimate) else self.prior(record)
        return scan(self.estimator, self.model, prior, record.samples)[1]


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A number by which a run is judged.

    Attributes:
        name: under which `measure` returns it.
        title: in tables.
        unit: "1" for none.
        statistic: what is told of it over runs: "mean", "median" (for delays, where infinity stands for "never"), "rms" (for
            errors with their sign) or "share" (for what happens or not).
    """

    name: str
    title: str
    unit: str = "1"
    statistic: Statistic = "mean"

    def __post_init__(self) -> None:
        known = get_args(Statistic)
        if self.statistic not in known:
            hint = did_you_mean(str(self.statistic), known)
            raise ConfigError(f"quantity {self.name!r}: statistic {self.statistic!r} is not known; {hint}")


@dataclasses.dataclass(frozen=True)
class Experiment:
    """Contenders on the same simulated records, run by run.

    The functions are pure and see one run, so that they compile and batch. A run has the same key in all experiments of
    a study: those that want the same noise use it as it is, others fold a number of their own in.

    Attributes:
        name: by which claims, tables and figures ask for it.
        title: for people.
        simulate: from a random key to a record, usually a `Record`; any tree of arrays if all contenders can read it.
        contenders: by name; a `Contender`, or any function from a record to what `measure` reads.
        measure: from a record and what a contender made of it to numbers by the names of `quantities`; NaN where a
            quantity has no meaning for the contender.
        quantities: the numbers, in the order of tables.
        trace: from the same to series by name, of which the mean over runs and the first run are kept.
        baseline: the contender that has been tuned as fairly as the others, or "" if there is none.
        random: False for an experiment without noise, which is run once and whose numbers are exact.
        most_runs: of a costly experiment, whatever the study is asked for.
        kept: traces of which every run is kept, for what needs them all, such as the threshold of a detector.
    """

    name: str
    title: str
    simulate: Callable[[Array], Any]
    contenders: Mapping[str, Callable[[Any], Any]]
    measure: Callable[[Any, Any], Mapping[str, Any]]
    quantities: tuple[Quantity, ...]
    trace: Callable[[Any, Any], Mapping[str, Any]] | None = None
    baseline: str = ""
    random: bool = True
    most_runs: int | None = None
    kept: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.contenders:
            raise ConfigError(f"experiment {self.name!r}: contenders: expected at least one, got none")
        if self.baseline and self.baseline not in self.contenders:
            hint = did_you_mean(self.baseline, self.contenders)
            raise ConfigError(f"experiment {self.name!r}: baseline {self.baseline!r} is not a contender; {hint}")
        if self.most_runs is not None and self.most_runs < 1:
            raise ConfigError(f"experiment {self.name!r}: most_runs: expected at least 1, got {self.most_runs}")

    def runs(self, asked: int) -> int:
        """How many runs it makes of those asked for."""
        return 1 if not self.random else min(asked, self.most_runs or asked)
