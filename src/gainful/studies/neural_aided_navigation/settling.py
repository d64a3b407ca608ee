"""How long errors take to settle, over all runs of an experiment together."""

from __future__ import annotations

import functools
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from ...plants.track import STEP
from ..outcome import Outcome
from ..statistics import Measured
from .records import STEADY

BAND = 1.5
"""Settled is a root mean square error of at most so many times its own over the steady part."""
HOLD = 20
"""Rows for which it must stay so."""
COMMON_BAND = 0.25
"""A band that is the same for all [m, m/s]."""
RESAMPLED = 400
"""How often runs are drawn again for an interval."""

Rule = Literal["settles", "last exit", "common band"]
RULES: tuple[Rule, ...] = ("settles", "last exit", "common band")


def settling_rows(rms: Float[np.ndarray, "... T"], rule: Rule = "settles") -> Float[np.ndarray, "..."]:
    """The number of the first row from which an error stays within its band; infinite if it never does.

    Args:
        rms: root mean squares along a record.
        rule: "settles": within 1.5 times its own steady value for 20 rows; "last exit": the same for ever;
            "common band": within 0.25 for 20 rows.

    Example:
        >>> import numpy as np
        >>> rms = np.ones(300)
        >>> rms[:40], rms[100] = 9.0, 9.0
        >>> [float(settling_rows(rms, rule)) for rule in ("settles", "last exit", "common band")]
        [41.0, 102.0, inf]
    """
    steady = np.sqrt(np.mean(rms[..., STEADY:] ** 2, axis=-1, keepdims=True))
    outside = rms > (COMMON_BAND if rule == "common band" else BAND * steady)
    if rule == "last exit":
        return _after_last(outside)
    counted = np.cumsum(outside, axis=-1)
    before = np.concatenate([np.zeros_like(counted[..., :1]), counted[..., :-1]], axis=-1)
    length = rms.shape[-1] - HOLD + 1
    held = counted[..., HOLD - 1 :] == before[..., :length]
    return np.where(held.any(axis=-1), held.argmax(axis=-1) + 1.0, np.inf)


def _after_last(outside: Bool[np.ndarray, "... T"]) -> Float[np.ndarray, "..."]:
    length = outside.shape[-1]
    last = length - np.argmax(outside[..., ::-1], axis=-1)
    first = np.where(outside.any(axis=-1), last + 1.0, 1.0)
    return np.where(first > length, np.inf, first)


def settling(outcome: Outcome, experiment: str, contender: str, state: int, rule: Rule = "settles") -> Measured:
    """The time after which the root mean square error over runs stays within its band [s], with a bootstrap interval.

    Args:
        outcome: of the study.
        experiment: that keeps its errors.
        contender: by name.
        state: 0 for displacement, 1 for speed.
        rule: as in `settling_rows`.

    Source: Efron and Tibshirani (1993), An Introduction to the Bootstrap, chapter 13.
    """
    squares = outcome.every(experiment, contender, "error")[:, :, state] ** 2
    value = STEP * float(settling_rows(np.sqrt(squares.mean(axis=0)), rule))
    runs = len(squares)
    if runs < 2:
        return Measured(value, -np.inf, np.inf, runs, "s")
    again = STEP * settling_rows(np.sqrt(_shares(runs) @ squares), rule)
    low, high = np.quantile(again, [0.025, 0.975], method="inverted_cdf")
    return Measured(value, min(float(low), value), max(float(high), value), runs, "s")


def settling_difference(
    outcome: Outcome, experiment: str, contender: str, minus: str, state: int, rule: Rule = "settles"
) -> Measured:
    """How much later one contender settles than another on the same runs [s], runs drawn again for both alike.

    Args:
        outcome: of the study.
        experiment: that keeps its errors.
        contender: whose time is taken.
        minus: whose time is taken off.
        state: 0 for displacement, 1 for speed.
        rule: as in `settling_rows`.
    """
    both = [outcome.every(experiment, name, "error")[:, :, state] ** 2 for name in (contender, minus)]
    first, second = (STEP * float(settling_rows(np.sqrt(each.mean(axis=0)), rule)) for each in both)
    runs = len(both[0])
    if runs < 2 or not np.isfinite([first, second]).all():
        return Measured(first - second, -np.inf, np.inf, runs, "s")
    one, other = (STEP * settling_rows(np.sqrt(_shares(runs) @ each), rule) for each in both)
    known = np.isfinite(one) & np.isfinite(other)
    low, high = np.quantile((one - other)[known], [0.025, 0.975])
    value = first - second
    return Measured(value, min(float(low), value), max(float(high), value), runs, "s")


@functools.cache
def _shares(runs: int) -> Float[np.ndarray, "drawn runs"]:
    """Weights of the runs when as many are drawn again."""
    return np.random.default_rng(0).multinomial(runs, np.full(runs, 1.0 / runs), RESAMPLED) / runs
