"""Laws that every part keeps, as plain functions: run them on a part of your own before you trust it.

Each raises `AssertionError` with the law that is broken, what was expected and what came. No test framework is needed.
"""

from .estimates import check_estimate
from .estimators import check_estimator
from .linearizations import check_linearization, check_rule
from .models import check_model
from .noise import check_noise
from .spaces import check_space, point_of
from .updates import check_update

__all__ = [
    "check_estimate",
    "check_estimator",
    "check_linearization",
    "check_model",
    "check_noise",
    "check_rule",
    "check_space",
    "check_update",
    "point_of",
]
