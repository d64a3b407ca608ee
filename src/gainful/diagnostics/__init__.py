"""Whether estimates and their uncertainties can be believed."""

from .accuracy import coverage, rmse
from .adaptation import Adaptation, adaptations
from .advice import NoiseAdvice, noise_advice
from .aiding import AidingUse, aiding_use
from .consistency import ConsistencyTest, nees_test, nis_test
from .cost import StepCost, step_cost, step_seconds
from .learning import Change, Learned, changes, learned
from .mistuned import MistunedError, innovation_lag_bound, stationary_mistuned_error
from .observability import Observability, observability
from .squares import chi_square_bounds, nees
from .verdict import Verdict, verdict
from .weights import Weighing, weighing
from .whiteness import WhitenessTest, ljung_box, whiteness_tests

__all__ = [
    "Adaptation",
    "AidingUse",
    "Change",
    "ConsistencyTest",
    "Learned",
    "MistunedError",
    "NoiseAdvice",
    "Observability",
    "StepCost",
    "Verdict",
    "Weighing",
    "WhitenessTest",
    "aiding_use",
    "adaptations",
    "changes",
    "chi_square_bounds",
    "coverage",
    "innovation_lag_bound",
    "learned",
    "ljung_box",
    "nees",
    "nees_test",
    "nis_test",
    "noise_advice",
    "observability",
    "rmse",
    "stationary_mistuned_error",
    "step_cost",
    "step_seconds",
    "verdict",
    "weighing",
    "whiteness_tests",
]
