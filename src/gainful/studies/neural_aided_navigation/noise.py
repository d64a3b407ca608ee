"""What the filters believe of the noise: the design, what records tell, what truth tells, and the truth."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp

from ...filters import KalmanFilter, kalman_filter
from ...models import Model
from ...plants import TRACK_SCENARIOS, settled_track_covariance, track
from ...plants.track import FIX_SIGMA, POSITION_SIGMA, SPEED_SIGMA
from ...running import fit_noise
from ...updates import MasreliezMartin
from ..prepared import once
from .records import WIDE, lessons, priors

FITTED, FITTED_ROBUSTLY = 12, 6
"""Records that noise is fitted to; a filter that doubts readings takes longer over each."""
FLOOR = 0.05
"""Least standard deviation over that of the design: 0.02 m for a fix, which such records hardly tell from none."""
KNOWN = ("matched", "calibrated", "bias")
"""Scenarios whose noise is white, constant and all there is to know, but for a bias."""


@dataclasses.dataclass(frozen=True)
class Belief:
    """What a filter believes: standard deviations of displacement and speed per step and of a fix [m, m/s, m].

    Attributes:
        sigmas: these.
        cov: covariance of its start.
    """

    sigmas: tuple[float, float, float] = (POSITION_SIGMA, SPEED_SIGMA, FIX_SIGMA)
    cov: tuple[tuple[float, float], tuple[float, float]] = WIDE

    @property
    def model(self) -> Model:
        """The track as it is believed to be; its noise is arrays, so that all beliefs share programs."""
        return track(*(jnp.asarray(sigma) for sigma in self.sigmas))


@once
def design(*, wide: bool = False) -> Belief:
    """The designer's belief, started as if it had run for long, or from a start known to be poor."""
    if wide:
        return Belief()
    rows = settled_track_covariance().tolist()
    return Belief(cov=(tuple(rows[0]), tuple(rows[1])))


def fitted(scenario: str) -> Belief:
    """What the records of a scenario tell of the noise by their likelihood, without any truth."""
    return _fitted(scenario, "ml")


def fitted_robustly(scenario: str) -> Belief:
    """The same by a filter that does not believe outliers."""
    return _fitted(scenario, "ml", robust=True)


def fitted_to_truth(scenario: str) -> Belief:
    """The noise with which a filter is nearest to the truth of the training records."""
    return _fitted(scenario, "truth")


@once
def _fitted(scenario: str, method: str, *, robust: bool = False) -> Belief:
    estimator = robust_filter() if robust else kalman_filter()
    count = FITTED_ROBUSTLY if robust else FITTED
    found = fit_noise(
        estimator,
        Belief().model,
        priors(scenario)[:count],
        lessons(scenario)[1][:count],
        method=method,
        held_out=0.0,
        skip=2 if method == "ml" else 20,
        floor=FLOOR,
        iterations=80,
    )
    factors = (found.states["displacement"], found.states["speed"], found.outputs["fix"])
    position, speed, fix = (factor * sigma for factor, sigma in zip(factors, Belief().sigmas, strict=True))
    return Belief((position, speed, fix))


def robust_filter() -> KalmanFilter:
    """A filter whose innovations count up to two sigmas."""
    return kalman_filter(update=MasreliezMartin(threshold=jnp.asarray(2.0)))  # type: ignore[arg-type]  # tunable


def true_noise(scenario: str) -> Belief:
    """The noise as it is, where it is white and constant."""
    chosen = TRACK_SCENARIOS[scenario]
    return Belief((float(chosen.position_sigma), float(chosen.speed_sigma), float(chosen.fix_sigma)))
