"""Running estimators along records, and plants in closed loops."""

from .closed_loop import simulate
from .disturbances import (
    AbstractDisturbance,
    Drawn,
    GaussianMixture,
    GaussianNoise,
    ImpulseBursts,
    SkewedOutliers,
    StudentTNoise,
)
from .drawing import draw, draw_log
from .fitting import FittedEntry, NoiseEntry, NoiseFit, fit_noise
from .fixed_lag import fixed_lag
from .log import Log, make_log, split_long_steps
from .loop import Observer, Rates, Simulated
from .outages import with_outage
from .plant import AbstractController, AbstractPlant, Reading
from .prior import make_prior
from .result import Result, Timing
from .run import log_likelihood, run, run_many, samples_of, scan
from .smooth import smooth

__all__ = [
    "AbstractController",
    "AbstractDisturbance",
    "AbstractPlant",
    "Drawn",
    "FittedEntry",
    "GaussianMixture",
    "GaussianNoise",
    "ImpulseBursts",
    "Log",
    "NoiseEntry",
    "NoiseFit",
    "Observer",
    "Rates",
    "Reading",
    "Result",
    "Simulated",
    "SkewedOutliers",
    "StudentTNoise",
    "Timing",
    "draw",
    "draw_log",
    "fit_noise",
    "fixed_lag",
    "log_likelihood",
    "make_log",
    "make_prior",
    "run",
    "run_many",
    "samples_of",
    "scan",
    "simulate",
    "smooth",
    "split_long_steps",
    "with_outage",
]
