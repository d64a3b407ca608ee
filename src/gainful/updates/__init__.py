"""Updates: how strongly a measurement counts."""

from .aiding_features import AbstractFeatures, Context, InnovationHistory, JoinedFeatures, UpdateFeatures
from .base import AbstractUpdate, Likelihood, Update
from .change_detection import ChangeDetection, Changes
from .considered import Considered
from .corrected import Corrected, Correction
from .correntropy import MaximumCorrentropy
from .exact import Exact
from .gated import Gated
from .huber_reweighted import HuberReweighted
from .influence import huber_fisher_information, huber_psi, huber_rho, huber_threshold, huber_weight
from .innovation_scaling import InnovationScaling
from .iterated import Iterated
from .online_gate import OnlineGate, Usefulness
from .robust import MasreliezMartin
from .strong_tracking import StrongTracking
from .student_t import StudentT
from .variational_covariances import VariationalCovariances
from .variational_noise import VariationalNoise
from .weighted_likelihood import WeightedLikelihood

__all__ = [
    "AbstractFeatures",
    "AbstractUpdate",
    "ChangeDetection",
    "Changes",
    "Considered",
    "Context",
    "Corrected",
    "Correction",
    "Exact",
    "Gated",
    "HuberReweighted",
    "InnovationScaling",
    "InnovationHistory",
    "Iterated",
    "JoinedFeatures",
    "Likelihood",
    "MasreliezMartin",
    "MaximumCorrentropy",
    "OnlineGate",
    "StrongTracking",
    "StudentT",
    "Update",
    "UpdateFeatures",
    "Usefulness",
    "VariationalCovariances",
    "VariationalNoise",
    "WeightedLikelihood",
    "huber_fisher_information",
    "huber_psi",
    "huber_rho",
    "huber_threshold",
    "huber_weight",
]
