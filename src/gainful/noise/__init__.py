"""Noise laws: what Q and R are now."""

from .base import AbstractNoise
from .nominal import Nominal

__all__ = ["AbstractNoise", "Nominal"]
