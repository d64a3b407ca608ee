"""Estimates: a state with its uncertainty, in several coordinates."""

from .affine import Affine
from .base import AbstractEstimate, Innovation
from .gaussian import Gaussian
from .square_root import SquareRoot

__all__ = ["AbstractEstimate", "Affine", "Gaussian", "Innovation", "SquareRoot"]
