"""Means, medians, root mean squares, proportions and ratios over Monte Carlo runs, with their intervals."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.special import bdtr, ndtri, stdtrit

from ..errors import ConfigError

LEVEL = 0.95
"""Probability that an interval covers what it is about, unless said otherwise."""


@dataclasses.dataclass(frozen=True)
class Measured:
    """A number found by experiment, with the interval that says how well it is known.

    Attributes:
        value: the number.
        low: lower end of the interval; minus infinity where the runs are too few for one.
        high: upper end.
        runs: how many it was found from.
        unit: "1" for none.
        note: what a reader must know, such as runs that came to nothing.

    Example:
        >>> print(Measured(0.0230, 0.0228, 0.0232, 20, "N m"))
        0.02300 ± 0.00020 N m
        >>> print(Measured(0.5, 0.46, 0.61, 20))
        0.500 [0.460, 0.610]
    """

    value: float
    low: float
    high: float
    runs: int
    unit: str = "1"
    note: str = ""

    @property
    def known(self) -> bool:
        """Whether there is a number at all: NaN stands for none."""
        return not math.isnan(self.value)

    @property
    def number(self) -> str:
        """The number and its interval without the unit, for tables whose headings have it."""
        return _with_interval(self.value, self.low, self.high)

    def __str__(self) -> str:
        if self.unit == "1" or not math.isfinite(self.value):
            return self.number
        head, note, _ = self.number.partition(_NO_INTERVAL)
        return f"{head} {self.unit}{note}"


def exactly(value: float, unit: str = "1") -> Measured:
    """A number without chance in it, such as the outcome of an experiment without noise."""
    return Measured(float(value), float(value), float(value), 1, unit)


def mean_interval(values: Any, *, unit: str = "1", level: float = LEVEL) -> Measured:
    """The mean of independent runs with its Student-t interval: `mean ± t s / sqrt(n)`.

    A run that is not finite leaves no mean: leaving it out would flatter whatever failed in it.

    Args:
        values: one number per run (n,).
        unit: of the numbers.
        level: probability that the interval covers the mean.

    Raises:
        ConfigError: no values, or a level outside (0, 1).

    Example:
        >>> print(mean_interval([1.0, 2.0, 3.0]))
        2.0 ± 2.5
    """
    x = _runs(values, level)
    n, note = len(x), _note(x)
    if note:
        return Measured(math.nan, *_NOTHING, n, unit, note)
    mean, reach = float(np.mean(x)), _reach(x, level)
    return Measured(mean, mean - reach, mean + reach, n, unit)


def rms_interval(values: Any, *, unit: str = "1", level: float = LEVEL) -> Measured:
    """The root mean square of independent runs: the root of the mean of the squares, and of its interval's ends.

    Where that interval reaches below zero the lower end is zero.

    Args:
        values: one number per run (n,), such as an error with its sign.
        unit: of the numbers.
        level: probability that the interval covers the root mean square.

    Raises:
        ConfigError: no values, or a level outside (0, 1).

    Example:
        >>> print(rms_interval([3.0, -3.0, 3.0], unit="m"))
        3 m
    """
    found = mean_interval(_runs(values, level) ** 2, level=level)
    low = found.low if math.isinf(found.low) else math.sqrt(max(found.low, 0.0))
    value, high = (math.sqrt(each) if each >= 0 else each for each in (found.value, found.high))
    return Measured(value, low, high, found.runs, unit, found.note)


def median_interval(values: Any, *, unit: str = "1", level: float = LEVEL) -> Measured:
    """The median of independent runs between two of their order statistics, whatever the distribution.

    The interval from the j-th smallest to the j-th largest misses the median with probability
    `2 P(B < j)`, B binomial (n, 1/2); j is the greatest that keeps the level. Six runs are the fewest for 95 %.

    Args:
        values: one number per run (n,); infinity stands for "never".
        unit: of the numbers.
        level: least probability that the interval covers the median.

    Raises:
        ConfigError: no values, or a level outside (0, 1).

    Source: Conover (1999), Practical Nonparametric Statistics, section 3.2.

    Example:
        >>> found = median_interval([3.0, 1.0, 2.0, 5.0, 4.0, 6.0])
        >>> found.value, found.low, found.high
        (3.5, 1.0, 6.0)
    """
    x = np.sort(_runs(values, level))
    n = len(x)
    if np.isnan(x).any():
        return Measured(math.nan, *_NOTHING, n, unit, _note(x))
    lower, upper = x[(n - 1) // 2], x[n // 2]
    middle = float(lower if lower == upper else (lower + upper) / 2)
    ranks = np.arange(1, n // 2 + 1)
    sure = ranks[2 * bdtr(ranks - 1, n, 0.5) <= 1 - level]
    ends = (float(x[sure[-1] - 1]), float(x[n - sure[-1]])) if len(sure) else (-math.inf, math.inf)
    never = int(np.isinf(x).sum())
    return Measured(middle, *ends, n, unit, f"never in {never} of {n} runs" if never else "")


def share_interval(successes: Any, *, level: float = LEVEL) -> Measured:
    """The share of runs in which something happened, with Wilson's interval.

    Args:
        successes: true or false, or 1 and 0, per run (n,).
        level: probability that the interval covers the share, about.

    Raises:
        ConfigError: no values, values other than true and false, or a level outside (0, 1).

    Source: Wilson (1927), JASA 22(158), 209-212.

    Example:
        >>> found = share_interval([True] * 20)
        >>> round(found.value, 3), round(found.low, 3), round(found.high, 3)
        (1.0, 0.839, 1.0)
    """
    x = _runs(successes, level)
    n = len(x)
    if np.isnan(x).any():
        return Measured(math.nan, *_NOTHING, n, "1", _note(x))
    if not np.isin(x, (0.0, 1.0)).all():
        raise ConfigError(f"successes: expected true or false per run, got {x[~np.isin(x, (0.0, 1.0))][0]:g}")
    share, z = float(np.mean(x)), float(ndtri(0.5 + 0.5 * level))
    middle = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    reach = z / (1 + z**2 / n) * math.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    # Exactly 0 and 1 at the ends, which rounding would miss.
    low = 0.0 if share == 0 else middle - reach
    return Measured(share, low, 1.0 if share == 1 else middle + reach, n)


def ratio_interval(above: Any, below: Any, *, level: float = LEVEL) -> Measured:
    """The ratio of two means over the same runs, by the delta method on its logarithm.

    With `d = above / mean(above) - below / mean(below)`, run by run, the interval is `ratio exp(±t s_d / sqrt(n))`.
    Runs that share their noise make it narrower than the two means alone would.

    Args:
        above: one number per run (n,), with a mean above zero.
        below: one number per run (n,), the same runs, with a mean above zero.
        level: probability that the interval covers the ratio, about.

    Raises:
        ConfigError: no values, different numbers of runs, or a level outside (0, 1).

    Source: Casella and Berger (2002), Statistical Inference, section 5.5.4.

    Example:
        >>> print(ratio_interval([1.0, 2.0, 3.0], [2.0, 4.0, 6.0]))
        0.5
    """
    a, b = _runs(above, level), _runs(below, level)
    if len(a) != len(b):
        raise ConfigError(f"above and below: expected the same runs, got {len(a)} and {len(b)}")
    note = _note(a) or _note(b)
    if not note and min(a.mean(), b.mean()) <= 0:
        note = "a mean is not above zero"
    if note:
        return Measured(math.nan, *_NOTHING, len(a), "1", note)
    ratio, reach = float(a.mean() / b.mean()), _reach(a / a.mean() - b / b.mean(), level)
    if math.isinf(reach):
        return Measured(ratio, *_NOTHING, len(a))
    # A difference of nothing but rounding is none; an interval beyond all numbers ends there.
    factor = math.exp(min(reach, 700.0)) if reach > 1e-14 else 1.0
    return Measured(ratio, ratio / factor, ratio * factor, len(a))


def difference_interval(first: Any, second: Any, *, unit: str = "1", level: float = LEVEL) -> Measured:
    """The mean of `first - second` over the same runs, with its Student-t interval.

    Args:
        first: one number per run (n,).
        second: one number per run (n,), the same runs.
        unit: of the numbers.
        level: probability that the interval covers the difference.

    Raises:
        ConfigError: no values, different numbers of runs, or a level outside (0, 1).

    Example:
        >>> print(difference_interval([1.0, 2.0, 4.0], [0.5, 1.4, 3.2], unit="s"))
        0.63 ± 0.38 s
    """
    a, b = _runs(first, level), _runs(second, level)
    if len(a) != len(b):
        raise ConfigError(f"first and second: expected the same runs, got {len(a)} and {len(b)}")
    return mean_interval(a - b, unit=unit, level=level)


_NOTHING = (-math.inf, math.inf)
_NO_INTERVAL = " (no interval)"


def _runs(values: Any, level: float) -> Float[np.ndarray, "n"]:
    x = np.asarray(values, dtype=float).ravel()
    if not len(x):
        raise ConfigError("values: expected at least one run, got none")
    if not 0 < level < 1:
        raise ConfigError(f"level: expected a probability between 0 and 1, got {level}")
    return x


def _note(x: np.ndarray) -> str:
    off = int((~np.isfinite(x)).sum())
    return f"not finite in {off} of {len(x)} runs" if off else ""


def _reach(x: np.ndarray, level: float) -> float:
    """Half the Student-t interval of a mean; one run tells nothing of it."""
    n = len(x)
    return float(stdtrit(n - 1, 0.5 + 0.5 * level) * np.std(x, ddof=1) / math.sqrt(n)) if n > 1 else math.inf


_ROUNDING = 1e-6
"""A number is told without its interval where that is less than this share of it: what rounding makes of equal filters."""


def _with_interval(value: float, low: float, high: float) -> str:
    """A number with its interval, as "±" where that is about even on both sides."""
    if math.isnan(value):
        return "\N{EN DASH}"
    if math.isinf(value):
        return "never" if value > 0 else "-inf"
    if not (math.isfinite(low) and math.isfinite(high)):
        end = "never" if math.isinf(high) and math.isfinite(low) else ""
        return f"{_brief(value)} [{_brief(low)}, {end}]" if end else f"{_brief(value)}{_NO_INTERVAL}"
    half = (high - low) / 2
    if half <= _ROUNDING * abs(value):
        return f"{value:.4g}"
    if abs((low + high) / 2 - value) > 0.05 * half:
        return "{} [{}, {}]".format(*(_brief(x, "#") for x in (value, low, high)))
    # Two digits of the interval, and as many places of the number.
    size = math.floor(math.log10(max(abs(value), half)))
    scaled = not -5 < size < 6
    by = 10.0**size if scaled else 1.0
    places = min(max(0, 1 - math.floor(math.log10(half / by) + 1e-9)), 9)
    text = f"{value / by:.{places}f} ± {half / by:.{places}f}"
    return f"({text})e{size}" if scaled else text


def _brief(x: float, form: str = "") -> str:
    """Three digits, or all before the point where there are more, up to a million."""
    return f"{x:.0f}" if 1e3 <= abs(x) < 1e6 else f"{x:{form}.3g}".rstrip(".")
