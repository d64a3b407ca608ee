"""One line that says whether a run's estimates and uncertainties can be believed."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import Status
from ..running import Result
from .accuracy import coverage
from .adaptation import adaptations
from .aiding import aiding_use
from .consistency import ConsistencyTest, nees_test, nis_test
from .learning import learned
from .rows import failed_rows, innovations_of
from .weights import weighing
from .whiteness import WhitenessTest, whiteness_tests

Check = ConsistencyTest | WhitenessTest

_TOLD = 3
"""Problems told in the one line; `problems` has them all."""


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Whether a run is consistent, the checks that say so, and what else its reader should know.

    Attributes:
        consistent: False if a check or a step failed; True if none did and the innovations could be judged; else None.
        checks: every check made, whatever came of it.
        facts: counts and shares worth knowing.
        problems: what is wrong, in words; empty unless `consistent` is False.
        warnings: of the run; signals that the filter no longer follows, parameters of which nothing was learned, noise that
            was given up.
    """

    consistent: bool | None
    checks: tuple[Check, ...]
    facts: tuple[str, ...]
    problems: tuple[str, ...]
    warnings: tuple[str, ...]

    def __str__(self) -> str:
        if self.consistent is False:
            more = len(self.problems) - _TOLD
            shown = [*self.problems[:_TOLD], f"and {more} more"] if more > 1 else self.problems
            head = "not consistent: " + "; ".join(shown)
            facts = [f"; {', '.join(self.facts)}"] if self.facts else []
        else:
            head = "consistent: " if self.consistent else "undecided: "
            facts = [", ".join([*_passed(self.checks), *self.facts])]
        return head + "".join(facts) + "".join(f"; warning: {text}" for text in self.warnings)


def verdict(result: Result, level: float = 0.99) -> Verdict:
    """Whether innovations and, where there is truth, errors are what the filter claims them to be.

    The NIS, the whiteness of all signals and the NEES are each judged at `level`: by default about three sound runs in
    a hundred fail one of them. A failed step is a problem by itself.

    Args:
        result: of a run. Of a smoothed one, the filter's innovations and the smoother's errors are judged.
        level: probability that a sound run passes each of the three.

    Raises:
        ConfigError: a level outside (0, 1).

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> wrong = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=0.25)
        >>> verdict(gf.run(gf.kalman_filter(), model, prior, log)).consistent
        True
        >>> verdict(gf.run(gf.kalman_filter(), wrong, prior, log)).consistent
        False
    """
    checks: list[Check] = [nis_test(result, level), *whiteness_tests(result, level=level)]
    bands = coverage(result)
    if bands:
        checks.append(nees_test(result, level))
    failed, rows = failed_rows(result) & result.log.kept, int(result.log.kept.sum())
    problems = [check.sentence for check in checks if check.passed is False]
    if failed.any():
        k = int(np.flatnonzero(failed)[0])
        why = Status(int(result.status[k])).sentence
        problems.append(f"{failed.sum()} of {rows} rows failed, first at t = {result.t[k]:.6g} s: {why}")
    consistent = False if problems else checks[0].passed
    facts = (*_band_facts(bands), *_count_facts(result, rows), *_bias_facts(checks))
    told = [
        each.warning
        for each in (*weighing(result), *learned(result), *aiding_use(result), *adaptations(result))
        if each.warning
    ]
    return Verdict(consistent, tuple(checks), facts, tuple(problems), (*result.warnings, *told))


def _passed(checks: tuple[Check, ...]) -> list[str]:
    """The checks in words, all white signals in one."""
    white = [check for check in checks if isinstance(check, WhitenessTest)]
    if white and all(test.passed for test in white):
        words = ["innovations white" if len(white) > 1 else "innovation white"]
    else:
        words = [test.sentence for test in white if test.samples and not test.passed]
    consistency = [check.sentence for check in checks if isinstance(check, ConsistencyTest)]
    return [consistency[0], *words, *consistency[1:]]


def _band_facts(bands: dict[str, float]) -> list[str]:
    if not bands:
        return []
    facts = [f"truth inside the 95 % bands in {100 * np.mean(list(bands.values())):.3g} % of cases"]
    worst = min(bands, key=lambda name: bands[name])
    if bands[worst] < 0.8 and len(bands) > 1:
        facts[0] += f" (only {100 * bands[worst]:.3g} % for {worst})"
    return facts


def _count_facts(result: Result, rows: int) -> list[str]:
    given = innovations_of(result)
    facts = [f"{count} of {len(given.nis)} rows {kind}" for kind, count in given.counts.items()]
    empty = int((result.log.kept & ~result.seen.any(axis=1)).sum())
    if empty:
        facts.append(f"{empty} of {rows} rows without a measurement")
    return facts


def _bias_facts(checks: list[Check]) -> list[str]:
    """A bias too small to fail the test of whiteness is still worth a word."""
    tests = [check for check in checks if isinstance(check, WhitenessTest) and check.passed and check.biased]
    return [f"innovation of {test.signal} biased by {test.mean:.2g} sigma" for test in tests]
