"""Whether estimates and their uncertainties can be believed."""

from .accuracy import coverage, rmse
from .adaptation import Adaptation, adaptations
from .consistency import ConsistencyTest, nees_test, nis_test
from .cost import StepCost, step_cost, step_seconds
from .learning import Change, Learned, changes, learned
from .observability import Observability, observability
from .squares import chi_square_bounds, nees
from .verdict import Verdict, verdict
from .weights import Weighing, weighing
from .whiteness import WhitenessTest, ljung_box, whiteness_tests

__all__ = [
    "Adaptation",
    "Change",
    "ConsistencyTest",
    "Learned",
    "Observability",
    "StepCost",
    "Verdict",
    "Weighing",
    "WhitenessTest",
    "adaptations",
    "changes",
    "chi_square_bounds",
    "coverage",
    "learned",
    "ljung_box",
    "nees",
    "nees_test",
    "nis_test",
    "observability",
    "rmse",
    "step_cost",
    "step_seconds",
    "verdict",
    "weighing",
    "whiteness_tests",
]
