"""Noise laws: what Q and R are now."""

from .base import AbstractNoise
from .nominal import Nominal
from .scaled import Scaled

__all__ = ["AbstractNoise", "Nominal", "Scaled"]
