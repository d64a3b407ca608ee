"""Linearizations: from a function and an estimate to an affine map."""

from .base import AbstractLinearization
from .marginal_sigma_points import MarginalSigmaPoints
from .rules import AbstractRule, Cubature, GaussHermite, Unscented
from .sigma_points import SigmaPoints
from .taylor import Taylor

__all__ = [
    "AbstractLinearization",
    "AbstractRule",
    "Cubature",
    "GaussHermite",
    "MarginalSigmaPoints",
    "SigmaPoints",
    "Taylor",
    "Unscented",
]
