"""Running estimators along records."""

from .log import Log, make_log, split_long_steps
from .prior import make_prior
from .result import Result, Timing
from .run import log_likelihood, run, run_many, samples_of, scan
from .simulate import draw, draw_log
from .smooth import smooth

__all__ = [
    "Log",
    "Result",
    "Timing",
    "draw",
    "draw_log",
    "log_likelihood",
    "make_log",
    "make_prior",
    "run",
    "run_many",
    "samples_of",
    "scan",
    "smooth",
    "split_long_steps",
]
