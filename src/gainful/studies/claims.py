"""What a publication claims, what was measured, and what comes of the comparison."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Literal

from ..errors import ConfigError
from .statistics import Measured

if TYPE_CHECKING:
    from .outcome import Outcome

Verdict = Literal["reproduced", "partly", "not reproduced", "undecided"]
"""What a claim comes to."""

VERDICTS: tuple[Verdict, ...] = ("reproduced", "partly", "not reproduced", "undecided")


@dataclasses.dataclass(frozen=True)
class Tolerance:
    """The numbers that would bear a claim out.

    Attributes:
        low: least of them.
        high: greatest of them.

    Example:
        >>> print(near(5.2, relative=0.1))
        4.68 to 5.72
        >>> print(below(1.0))
        below 1
    """

    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if not self.low <= self.high or (math.isinf(self.low) and math.isinf(self.high)):
            raise ConfigError(f"tolerance: expected low <= high and one of them finite, got {self.low} and {self.high}")

    def __str__(self) -> str:
        if math.isinf(self.low):
            return f"below {self.high:.4g}"
        if math.isinf(self.high):
            return f"above {self.low:.4g}"
        return f"{self.low:.4g} to {self.high:.4g}"

    def judge(self, found: Measured) -> bool | None:
        """True if the whole interval is inside, False if all of it is outside, None if it reaches across an end.

        What is no number bears nothing out.
        """
        if not found.known:
            return False
        if self.low <= found.low and found.high <= self.high:
            return True
        return False if found.high < self.low or found.low > self.high else None


def near(value: float, *, relative: float = 0.0, absolute: float = 0.0) -> Tolerance:
    """Numbers around a published one.

    Args:
        value: the published number.
        relative: share of it by which they may differ.
        absolute: what they may differ by besides.

    Raises:
        ConfigError: a tolerance below zero.
    """
    reach = relative * abs(value) + absolute
    if min(relative, absolute) < 0:
        raise ConfigError(f"relative and absolute: expected at least 0, got {relative} and {absolute}")
    return Tolerance(value - reach, value + reach)


def below(value: float) -> Tolerance:
    """Numbers below one."""
    return Tolerance(high=value)


def above(value: float) -> Tolerance:
    """Numbers above one."""
    return Tolerance(low=value)


def between(low: float, high: float) -> Tolerance:
    """Numbers between two."""
    return Tolerance(low, high)


@dataclasses.dataclass(frozen=True)
class Check:
    """One number of a claim, and what it would have to be.

    Attributes:
        what: the number in words, such as "RMSE, adaptive over tuned, wheel offset".
        measure: finds it in the outcome of a study.
        expected: the numbers that would bear the claim out.
    """

    what: str
    measure: Callable[[Outcome], Measured]
    expected: Tolerance


@dataclasses.dataclass(frozen=True)
class Claim:
    """A sentence or a number of a publication, and the checks that bear it out or not.

    Each check compares the interval of a measured number with what the claim expects of it. The claim is *reproduced*
    if all pass, *not reproduced* if all fail, *partly* if some do and some do not. Where an interval reaches across
    the end of what is expected, the runs were too few to tell; a claim that hangs on such a check is *undecided*.

    Attributes:
        name: a few words.
        statement: what is claimed, in one sentence.
        published: what the publication gives for it, in words and numbers.
        checks: what was measured for it, at least one.
        why: the reason for a verdict, by verdict. Only that of the verdict found is told, so that no explanation
            outlives the numbers it explains.
    """

    name: str
    statement: str
    published: str
    checks: tuple[Check, ...]
    why: Mapping[Verdict, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.checks:
            raise ConfigError(f"claim {self.name!r}: expected at least one check, got none")
        for verdict in self.why:
            if verdict not in VERDICTS:
                raise ConfigError(
                    f"claim {self.name!r}: why: expected a verdict ({', '.join(VERDICTS)}), got {verdict!r}"
                )

    def judge(self, outcome: Outcome) -> Finding:
        """What the claim comes to in the outcome of a study."""
        results = tuple(
            CheckResult(check.what, found := check.measure(outcome), check.expected, check.expected.judge(found))
            for check in self.checks
        )
        verdict = verdict_of([result.passed for result in results])
        return Finding(self, verdict, results, self.why.get(verdict, ""))


@dataclasses.dataclass(frozen=True)
class CheckResult:
    """What one check found.

    Attributes:
        what: the number in words.
        found: the number.
        expected: the numbers that would bear the claim out.
        passed: whether it does; None if its interval does not tell.
    """

    what: str
    found: Measured
    expected: Tolerance
    passed: bool | None

    def __str__(self) -> str:
        answer = {True: "yes", False: "no", None: "cannot tell"}[self.passed]
        note = f" ({self.found.note})" if self.found.note else ""
        return f"{self.what}: {self.found}{note}, expected {self.expected}: {answer}"


@dataclasses.dataclass(frozen=True)
class Finding:
    """A claim with its verdict.

    Attributes:
        claim: what was claimed.
        verdict: what it comes to.
        checks: what was found, one per check of the claim.
        why: the reason in the author's words, if there are any for this verdict.
    """

    claim: Claim
    verdict: Verdict
    checks: tuple[CheckResult, ...]
    why: str

    @property
    def passed(self) -> int:
        """How many checks bear the claim out."""
        return sum(check.passed is True for check in self.checks)

    @property
    def telling(self) -> CheckResult:
        """The check to tell where there is room for one: the first that fails, else one that cannot tell, else the first."""
        return min(self.checks, key=lambda check: {False: 0, None: 1, True: 2}[check.passed])

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in words and numbers."""
        told = self.checks
        if self.verdict in ("partly", "undecided"):
            # What stands in the way comes first.
            told = tuple(sorted(told, key=lambda check: check.passed is True))
        return "; ".join(map(str, told)) + (f". {self.why}" if self.why else "")


def verdict_of(passed: list[bool | None]) -> Verdict:
    """What several checks come to together.

    Example:
        >>> verdict_of([True, True]), verdict_of([True, False, None]), verdict_of([True, None])
        ('reproduced', 'partly', 'undecided')
    """
    if True in passed and False in passed:
        return "partly"
    if None in passed:
        return "undecided"
    return "reproduced" if True in passed else "not reproduced"
