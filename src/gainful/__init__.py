"""Estimation when the textbook assumptions fail: states, parameters and faults with honest uncertainty."""

from .runtime import prepare as _prepare

_prepare()

from .diagnostics import observability, verdict
from .estimates import Gaussian, SquareRoot
from .filters import (
    KalmanFilter,
    cubature_kalman_filter,
    extended_kalman_filter,
    iterated_extended_kalman_filter,
    kalman_filter,
    unscented_kalman_filter,
)
from .io import Column, LocalFrame, Source, read_log
from .linearization import Cubature, GaussHermite, SigmaPoints, Taylor, Unscented
from .live import OnlineFilter
from .models import augment, continuous_model, discrete_model, linear_model, sensor
from .noise import Nominal
from .running import (
    Log,
    Result,
    draw_log,
    log_likelihood,
    make_log,
    make_prior,
    run,
    run_many,
    samples_of,
    scan,
    smooth,
)
from .updates import Exact, Gated, Iterated
from .version import __version__

__all__ = [
    "Column",
    "Cubature",
    "Exact",
    "Gated",
    "GaussHermite",
    "Gaussian",
    "Iterated",
    "KalmanFilter",
    "LocalFrame",
    "Log",
    "Nominal",
    "OnlineFilter",
    "Result",
    "SigmaPoints",
    "Source",
    "SquareRoot",
    "Taylor",
    "Unscented",
    "__version__",
    "augment",
    "continuous_model",
    "cubature_kalman_filter",
    "discrete_model",
    "draw_log",
    "extended_kalman_filter",
    "iterated_extended_kalman_filter",
    "kalman_filter",
    "linear_model",
    "log_likelihood",
    "make_log",
    "make_prior",
    "observability",
    "read_log",
    "run",
    "run_many",
    "samples_of",
    "scan",
    "sensor",
    "smooth",
    "unscented_kalman_filter",
    "verdict",
]
