"""Whether innovations and errors are as large as the filter claims: NIS and NEES against their chi-square bounds."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.special import chdtr, chdtrc, gammaincinv

from ..running import Result
from .rows import innovations_of, judged_rows
from .squares import check_level, chi_square_bounds, correlation_time, nees, whiten

LEAST_DEGREES = 10
"""With fewer effective degrees of freedom, only a mean above its upper bound is judged."""

MARGIN = 0.05
"""A mean this close to 1 passes however long the record: 2.5 % in sigma is below what any noise model is good for."""

MOST_LEFT_OUT = 0.2
"""If the update left out more than this share of the measurements, the rest cannot vouch for them."""


@dataclasses.dataclass(frozen=True)
class ConsistencyTest:
    """A mean of squares that should be 1 per degree of freedom, and what became of it.

    Attributes:
        name: "NIS" or "NEES".
        mean: sum of squares per degree of freedom; infinite where a state claimed to be exact is off, NaN without data.
        degrees: degrees of freedom counted.
        effective_degrees: the same, were the samples independent; less for errors correlated in time.
        lower: lower bound of the mean at `level`.
        upper: upper bound.
        level: probability that a sound filter's mean lies between the bounds.
        probability: of a mean at least as far out if the filter is sound (two-sided).
        share_left_out: measured components left out, because the update rejected or down-weighted them.
        passed: inside the bounds, or within `MARGIN` of 1; None where there is too little to judge by.
    """

    name: str
    mean: float
    degrees: int
    effective_degrees: float
    lower: float
    upper: float
    level: float
    probability: float
    share_left_out: float
    passed: bool | None

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        if np.isinf(self.mean):
            return f"{self.name} infinite: a state with zero variance is off"
        if not self.degrees:
            return f"{self.name} not judged: no row could be counted"
        head = f"{self.name} {_short(self.mean)} per degree"
        bounds = f"{_short(self.lower)} to {_short(self.upper)}"
        inside = self.lower <= self.mean <= self.upper
        if self.passed is False:
            return f"{head} (expected {bounds}): {self._cause()}"
        if self.passed is None and self.effective_degrees < LEAST_DEGREES:
            return f"{head}, not judged: {self.effective_degrees:.2g} effective degrees, {LEAST_DEGREES} are needed"
        extra = f", from {self.effective_degrees:.3g} effective degrees" if self.name == "NEES" else ""
        text = f"{head} ({100 * self.level:.3g} % bounds {bounds}{extra})"
        if not inside and self.passed:
            text += f", outside but within {100 * MARGIN:.0f} % of 1"
        if self.share_left_out:
            share = f"{100 * self.share_left_out:.2g} % of the measurements left out"
            text += f", not judged: {share}" if self.passed is None else f", biased low by {share}"
        return text

    def _cause(self) -> str:
        size = np.sqrt(self.mean if self.mean > 1 else 1 / max(self.mean, 1e-12))
        ratio = f"{size:.2g}" if size > 1.2 else f"{size:.3g}"
        if self.name == "NEES":
            return f"errors are about {ratio} times {'larger' if self.mean > 1 else 'smaller'} than claimed"
        side = "under-stated" if self.mean > 1 else "over-stated"
        return f"noise is {side} by about {ratio} in sigma" + (", or the model is off" if self.mean > 1 else "")


def nis_test(result: Result, level: float = 0.95) -> ConsistencyTest:
    """Whether the innovations are as large as their covariance says.

    ```
    mean = sum_k r_k^T S_k^-1 r_k / D,  D = components used;   D mean ~ chi-square(D) for a sound filter
    ```

    Rows that failed, that measured nothing or that only split a long interval do not count. Components the update
    rejected or weighted below one half are left out, with their rows and columns of `S`: their squares would say
    how bad the outliers are, not how good the filter is. What remains has lost its upper tail, so the lower bound is
    widened as if the share `q` left out were all sound: by `F_3(c) / F_1(c)`, `c` the chi-square quantile at `1 - q`.

    Args:
        result: of a run; of a smoothed one, the filter's innovations are judged.
        level: probability between the bounds.

    Raises:
        ConfigError: a level outside (0, 1).

    Source: Bar-Shalom, Li and Kirubarajan (2001), Estimation with Applications to Tracking and Navigation, 5.4.2.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> test = nis_test(gf.run(gf.kalman_filter(), model, prior, log))
        >>> test.degrees, test.passed
        (500, True)
    """
    check_level(level)
    given = innovations_of(result)
    whole = (given.used == given.seen).all(axis=1)
    part = np.where(given.used, given.residual, np.nan)[~whole]
    total = given.nis[whole].sum() + nees(part, given.cov[~whole]).sum()
    degrees = int(given.used.sum())
    return _judge("NIS", total, degrees, float(degrees), level, given.share_left_out)


def nees_test(result: Result, level: float = 0.95) -> ConsistencyTest:
    """Whether the errors against the truth are as large as the covariance says.

    ```
    mean = sum_k e_k^T P_k^-1 e_k / D,  D = components with truth;   tau = 1 + 2 sum_j (1 - j / N) |C_j|^2 / |C_0|^2
    ```

    Errors of neighbouring rows are alike, so `D` independent degrees would make the bounds too narrow: they are those
    of `D / tau` degrees, where `C_j` is the autocovariance at lag `j` of the whitened errors. Its squared Frobenius
    norm is the autocovariance of the NEES for Gaussian errors, and, taken about zero, it also sees an error that never
    changes. Slow errors that happen to be small all along look more independent than they are: in that case a mean
    below its bounds proves little.

    Args:
        result: of a run along a record with truth. Smoothed results are judged as they are.
        level: probability between the bounds.

    Raises:
        ConfigError: a level outside (0, 1).

    Source: Bar-Shalom, Li and Kirubarajan (2001), Estimation with Applications to Tracking and Navigation, 5.4.2.
    Differs: the bounds count effective samples of one run, not several runs; for those see `nees`, `chi_square_bounds`.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> test = nees_test(gf.run(gf.kalman_filter(), model, prior, log))
        >>> test.passed, test.effective_degrees < test.degrees
        (True, True)
    """
    check_level(level)
    rows = judged_rows(result)
    errors = without_rounding(result, result.error())[rows]
    squares, whitened, degrees = whiten(errors, result.cov[rows])
    counted = degrees > 0
    total, count = squares[counted | np.isinf(squares)].sum(), int(degrees.sum())
    tau = correlation_time(whitened[counted])
    return _judge("NEES", total, count, count / tau, level, 0.0)


def without_rounding(result: Result, errors: Float[np.ndarray, "T dof"]) -> Float[np.ndarray, "T dof"]:
    """The errors, zero where they are rounding of the state itself, which matters where it has no variance."""
    size, i = [], 0
    for part in result.model.space.parts:
        here = np.abs(result.mean[:, i : i + part.size])
        size.append(here if part.size == part.dof else np.ones((len(here), part.dof)))
        i += part.size
    eps = np.finfo(np.asarray(result.mean).dtype).eps
    return np.where(np.abs(errors) <= 64 * eps * np.concatenate(size, axis=1), 0.0, errors)


def _judge(name: str, total: float, degrees: int, effective: float, level: float, left_out: float) -> ConsistencyTest:
    if not degrees:
        mean = float("inf") if np.isinf(total) else float("nan")
        nan = float("nan")
        verdict = False if np.isinf(total) else None
        return ConsistencyTest(name, mean, 0, 0.0, nan, nan, level, nan, left_out, verdict)
    mean = float(total / degrees)
    # At worst, what was left out was the upper tail of sound measurements.
    cut = 2 * gammaincinv(0.5, 1 - left_out)
    factor = float(chdtr(3, cut) / chdtr(1, cut)) if 0 < left_out < 1 else 1.0
    lower, upper = (bound / effective for bound in chi_square_bounds(effective, 1, level))
    lower *= factor
    tails = chdtr(effective, effective * mean / factor), chdtrc(effective, effective * mean)
    passed: bool | None = lower <= mean <= upper or abs(mean - 1) <= MARGIN
    few = effective < LEAST_DEGREES and mean <= upper
    if few or (passed and left_out > MOST_LEFT_OUT):
        passed = None
    probability = min(1.0, 2 * float(min(tails)))
    return ConsistencyTest(name, mean, degrees, effective, lower, upper, level, probability, left_out, passed)


def _short(value: float) -> str:
    return f"{value:.2f}" if abs(value) < 100 else f"{value:.3g}"
