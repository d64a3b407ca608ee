"""Noise laws: what Q and R are now."""

from .base import AbstractNoise
from .capped import Capped
from .nominal import Nominal
from .scaled import Scaled

__all__ = ["AbstractNoise", "Capped", "Nominal", "Scaled"]
