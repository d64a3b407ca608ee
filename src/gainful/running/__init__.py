"""Running estimators along records, and plants in closed loops."""

from .closed_loop import simulate
from .drawing import draw, draw_log
from .log import Log, make_log, split_long_steps
from .loop import Observer, Rates, Simulated
from .plant import AbstractController, AbstractPlant, Reading
from .prior import make_prior
from .result import Result, Timing
from .run import log_likelihood, run, run_many, samples_of, scan
from .smooth import smooth

__all__ = [
    "AbstractController",
    "AbstractPlant",
    "Log",
    "Observer",
    "Rates",
    "Reading",
    "Result",
    "Simulated",
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
    "simulate",
    "smooth",
    "split_long_steps",
]
