"""Identification: equations written as text, their parameters from recorded signals, and whether to believe them."""

from .assessment import Assessment, assess
from .equations import Equation, parse_equation
from .free_run import FreeRun, free_run_of
from .identify import Identification, identify
from .lagged_model import LaggedModel, Lags
from .methods import BASES, METHODS, RECURSIVE
from .network_models import NetworkIdentification, NetworkRecipe, identify_network, linear_equation
from .one_step import OneStepFit, OneStepModel, OneStepReport, fit_one_step
from .recordings import Recording
from .recursion import Track
from .terms import FUNCTIONS, Reference, Term, parse_term
from .windows import Window, against_test_function, pointwise

__all__ = [
    "BASES",
    "FUNCTIONS",
    "METHODS",
    "RECURSIVE",
    "Assessment",
    "Equation",
    "FreeRun",
    "Identification",
    "LaggedModel",
    "Lags",
    "NetworkIdentification",
    "NetworkRecipe",
    "OneStepFit",
    "OneStepModel",
    "OneStepReport",
    "Recording",
    "Reference",
    "Term",
    "Track",
    "Window",
    "against_test_function",
    "assess",
    "fit_one_step",
    "free_run_of",
    "identify",
    "identify_network",
    "linear_equation",
    "parse_equation",
    "parse_term",
    "pointwise",
]
