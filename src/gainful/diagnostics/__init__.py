"""Whether estimates and their uncertainties can be believed."""

from .accuracy import coverage, rmse
from .consistency import ConsistencyTest, nees_test, nis_test
from .observability import Observability, observability
from .squares import chi_square_bounds, nees
from .verdict import Verdict, verdict
from .whiteness import WhitenessTest, ljung_box, whiteness_tests

__all__ = [
    "ConsistencyTest",
    "Observability",
    "Verdict",
    "WhitenessTest",
    "chi_square_bounds",
    "coverage",
    "ljung_box",
    "nees",
    "nees_test",
    "nis_test",
    "observability",
    "rmse",
    "verdict",
    "whiteness_tests",
]
