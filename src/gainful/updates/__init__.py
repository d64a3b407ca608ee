"""Updates: how strongly a measurement counts."""

from .base import AbstractUpdate, Likelihood, Update
from .considered import Considered
from .exact import Exact
from .gated import Gated
from .innovation_scaling import InnovationScaling
from .iterated import Iterated
from .strong_tracking import StrongTracking

__all__ = [
    "AbstractUpdate",
    "Considered",
    "Exact",
    "Gated",
    "InnovationScaling",
    "Iterated",
    "Likelihood",
    "StrongTracking",
    "Update",
]
