"""Estimates: a state with its uncertainty, in several coordinates."""

from .affine import Affine
from .base import AbstractEstimate, Innovation
from .friedland import Friedland
from .gaussian import Gaussian
from .square_root import SquareRoot
from .two_stage import TwoStage

__all__ = ["AbstractEstimate", "Affine", "Friedland", "Gaussian", "Innovation", "SquareRoot", "TwoStage"]
