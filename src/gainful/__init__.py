"""Estimation when the textbook assumptions fail: states, parameters and faults with honest uncertainty."""

from .runtime import prepare as _prepare

_prepare()

from .diagnostics import observability, verdict
from .estimates import Gaussian, SquareRoot, TwoStage
from .faults import Fault, with_faults
from .filters import (
    GeneralizedLikelihoodRatio,
    InteractingMultipleModel,
    KalmanFilter,
    adaptive_two_stage_unscented_kalman_filter,
    cubature_kalman_filter,
    extended_kalman_filter,
    iterated_extended_kalman_filter,
    kalman_filter,
    two_stage_extended_kalman_filter,
    two_stage_kalman_filter,
    two_stage_unscented_kalman_filter,
    unscented_kalman_filter,
)
from .io import Column, LocalFrame, Source, read_log
from .linearization import Cubature, GaussHermite, MarginalSigmaPoints, SigmaPoints, Taylor, Unscented
from .live import OnlineFilter
from .models import augment, continuous_model, discrete_model, linear_model, sensor
from .noise import Nominal, Scaled
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
    simulate,
    smooth,
)
from .updates import Exact, Gated, InnovationScaling, Iterated, StrongTracking
from .version import __version__

__all__ = [
    "Column",
    "Cubature",
    "Exact",
    "Fault",
    "Gated",
    "GaussHermite",
    "Gaussian",
    "GeneralizedLikelihoodRatio",
    "InnovationScaling",
    "InteractingMultipleModel",
    "Iterated",
    "KalmanFilter",
    "LocalFrame",
    "Log",
    "MarginalSigmaPoints",
    "Nominal",
    "OnlineFilter",
    "Result",
    "Scaled",
    "SigmaPoints",
    "Source",
    "SquareRoot",
    "StrongTracking",
    "Taylor",
    "TwoStage",
    "Unscented",
    "__version__",
    "adaptive_two_stage_unscented_kalman_filter",
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
    "simulate",
    "smooth",
    "two_stage_extended_kalman_filter",
    "two_stage_kalman_filter",
    "two_stage_unscented_kalman_filter",
    "unscented_kalman_filter",
    "verdict",
    "with_faults",
]
