"""What the innovations say of the noise, before anything is fitted."""

from __future__ import annotations

import dataclasses

from ..running import Result
from .consistency import ConsistencyTest, nis_test
from .whiteness import WhitenessTest, whiteness_tests


@dataclasses.dataclass(frozen=True)
class NoiseAdvice:
    """What size and memory of the innovations say of Q and R.

    Attributes:
        nis: size of the innovations.
        whiteness: their memory, signal by signal.
        sentences: what to do, most telling first.
    """

    nis: ConsistencyTest
    whiteness: tuple[WhitenessTest, ...]
    sentences: tuple[str, ...]


def noise_advice(result: Result, level: float = 0.99) -> NoiseAdvice:
    """Reads off the innovations which of Q and R is wrong, and in which direction.

    Innovations that go on in the direction of the last one say that the filter follows too slowly, and those that turn back
    that it follows too quickly: Q is too small, or too large, beside R. White ones of the wrong size say that both are off
    by one factor.

    Args:
        result: of a run; of a smoothed one, the filter's innovations are judged.
        level: probability that sound noise passes each test.

    Raises:
        ConfigError: a level outside (0, 1).

    Source: Mehra (1970), IEEE Trans. Autom. Control 15(2):175-184.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> true, told = (gf.linear_model([[1.0]], [[1.0]], Q=Q, R=1.0) for Q in (1.0, 0.001))
        >>> prior = gf.make_prior(told, [0.0], [1.0])
        >>> log = gf.draw_log(true, prior, np.arange(500.0), key=jax.random.key(1))
        >>> noise_advice(gf.run(gf.kalman_filter(), told, prior, log)).sentences[0][:49]
        'y0: innovations go on in the direction of the las'
    """
    nis, white = nis_test(result, level), whiteness_tests(result, level=level)
    told = []
    for test in white:
        if test.passed is False and test.autocorrelation.size:
            first = float(test.autocorrelation[0])
            way, size = ("go on in the direction of", "small") if first > 0 else ("turn back from", "large")
            told.append(
                f"{test.signal}: innovations {way} the last one (correlation {first:.2f}): "
                f"Q is too {size} beside R for what it reads"
            )
        if test.biased:
            told.append(
                f"{test.signal}: innovations are off by {test.mean:.2g} sigma on average, which no noise explains: "
                "a bias, or a wrong model"
            )
    if nis.passed is False and all(test.passed for test in white):
        way = "small" if nis.mean > 1 else "large"
        told.append(f"innovations are white: Q and R are both too {way}, by about {nis.mean**0.5:.2g} in sigma")
    if not told:
        judged = nis.passed is not None and all(test.passed is not None for test in white)
        told.append("nothing speaks against Q and R" if judged else "too few innovations to judge Q and R by")
    return NoiseAdvice(nis, white, tuple(told))
