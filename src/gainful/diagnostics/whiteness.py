"""Whether innovations carry no memory: what the filter could have predicted, it should have."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float
from scipy.special import chdtrc, ndtri

from ..errors import ConfigError
from ..running import Result
from .rows import innovations_of
from .squares import check_level

LEAST_SAMPLES = 30
"""Fewer innovations of a signal are not judged."""

PRACTICALLY_WHITE = 0.05
"""Autocorrelations below this pass however significant: a predictor using one would gain 0.25 % of the variance."""


@dataclasses.dataclass(frozen=True)
class WhitenessTest:
    """The autocorrelation of one signal's normalised innovations, and what became of it.

    Attributes:
        signal: name of the signal.
        samples: innovations counted.
        autocorrelation: at lags 1, 2, ... counted in measurements of this signal (lags,).
        statistic: Ljung-Box statistic, chi-square with as many degrees as lags where white.
        probability: of a statistic at least as large if the innovations are white.
        mean: of the normalised innovations, in sigmas.
        level: probability that white innovations pass.
        passed: not significantly correlated, or nowhere as much as `PRACTICALLY_WHITE`; None where there is too little
            to judge by.
    """

    signal: str
    samples: int
    autocorrelation: Float[np.ndarray, " lags"]
    statistic: float
    probability: float
    mean: float
    level: float
    passed: bool | None

    @property
    def worst_lag(self) -> int:
        """The lag of the largest autocorrelation, 0 without any."""
        return 1 + int(np.abs(self.autocorrelation).argmax()) if self.autocorrelation.size else 0

    @property
    def worst(self) -> float:
        """The largest autocorrelation, with its sign; 0 without any."""
        return float(self.autocorrelation[self.worst_lag - 1]) if self.autocorrelation.size else 0.0

    @property
    def biased(self) -> bool:
        """Whether the mean is off zero by more than chance at `level`, and by more than `PRACTICALLY_WHITE` sigmas."""
        if self.passed is None:
            return False
        chance = float(ndtri(0.5 + 0.5 * self.level)) / np.sqrt(self.samples)
        return bool(abs(self.mean) > max(chance, PRACTICALLY_WHITE))

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        name = f"innovation of {self.signal}"
        if self.passed is None:
            return f"{name} not judged: {self.samples} samples, at least {LEAST_SAMPLES} are needed"
        text = f"{name} white" if self.passed else f"{name} correlated (lag {self.worst_lag}: {self.worst:.2f})"
        if self.biased:
            text += f"{' but' if self.passed else ' and'} biased by {self.mean:.2g} sigma"
        return text


def whiteness_tests(result: Result, lags: int | None = None, level: float = 0.95) -> tuple[WhitenessTest, ...]:
    """Whether each signal's innovations are white, judged by Ljung and Box's statistic.

    ```
    z_k = r_k / sqrt(S_k,ii);   rho_j = sum_k z_k z_(k+j) / sum_k z_k^2;   Q = N (N + 2) sum_j rho_j^2 / (N - j)
    ```

    The autocorrelation is taken about zero, the mean innovations should have, so that a lasting bias counts as
    correlation. Only measurements that were used count; neighbours are neighbouring measurements of the signal, however
    far apart in time. The chance `1 - level` of a false alarm is shared out among the signals.

    Args:
        result: of a run; of a smoothed one, the filter's innovations are judged.
        lags: how many, at least 1; by default a tenth of the samples, at least 5 and at most 20: with many lags for few
            samples the statistic exceeds its quantiles too often.
        level: probability that all signals pass if all are white.

    Raises:
        ConfigError: a level outside (0, 1), or fewer than one lag.

    Source: Ljung and Box (1978), Biometrika 65(2):297-303; Mehra (1970), IEEE Trans. Autom. Control 15(2):175-184.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
        >>> prior = gf.make_prior(model, [0.0], [1.0])
        >>> log = gf.draw_log(model, prior, np.arange(500.0), key=jax.random.key(1))
        >>> whiteness_tests(gf.run(gf.kalman_filter(), model, prior, log))[0].sentence
        'innovation of y0 white'
    """
    check_level(level)
    if lags is not None and lags < 1:
        raise ConfigError(f"lags: expected at least 1, got {lags!r}")
    given = innovations_of(result)
    names = result.model.output.tangent_names
    own = 1 - (1 - level) / len(names)
    tests = []
    for i, name in enumerate(names):
        rows = given.used[:, i] & (given.cov[:, i, i] > 0)
        tests.append(_test(name, given.residual[rows, i] / np.sqrt(given.cov[rows, i, i]), lags, own))
    return tuple(tests)


def ljung_box(values: Float[np.ndarray, " n"], lags: int) -> tuple[Float[np.ndarray, " lags"], float, float]:
    """Autocorrelations about zero at lags 1 to `lags`, their Ljung-Box statistic and its probability if white.

    Args:
        values: a series whose mean should be zero (n,).
        lags: how many, fewer than values.

    Raises:
        ConfigError: as many lags as values, or none.

    Example:
        >>> ljung_box(np.array([1.0, -1.0, 1.0, -1.0]), 1)[0].tolist()
        [-0.75]
    """
    n = len(values)
    if not 1 <= lags < n:
        raise ConfigError(f"lags: expected 1 to {n - 1} for {n} values, got {lags!r}")
    power = float(values @ values)
    rho = np.array([values[:-k] @ values[k:] for k in range(1, lags + 1)]) / (power if power > 0 else 1.0)
    statistic = float(n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1))))
    return rho, statistic, float(chdtrc(lags, statistic))


def _test(name: str, values: Float[np.ndarray, " n"], lags: int | None, level: float) -> WhitenessTest:
    n = len(values)
    mean = float(values.mean()) if n else float("nan")
    if n < LEAST_SAMPLES:
        return WhitenessTest(name, n, np.zeros(0), float("nan"), float("nan"), mean, level, None)
    count = min(20, max(5, n // 10)) if lags is None else min(lags, n - 1)
    rho, statistic, probability = ljung_box(values, count)
    passed = bool(probability >= 1 - level or np.abs(rho).max() < PRACTICALLY_WHITE)
    return WhitenessTest(name, n, rho, statistic, probability, mean, level, passed)
