"""Linearizations: from a function and an estimate to an affine map."""

from .base import AbstractLinearization
from .rules import AbstractRule, Cubature, GaussHermite, Unscented
from .sigma_points import SigmaPoints
from .taylor import Taylor

__all__ = [
    "AbstractLinearization",
    "AbstractRule",
    "Cubature",
    "GaussHermite",
    "SigmaPoints",
    "Taylor",
    "Unscented",
]
