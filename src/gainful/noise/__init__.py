"""Noise laws: what Q and R are now."""

from .base import AbstractNoise
from .capped import Capped
from .innovation_matching import InnovationMatching
from .nominal import Nominal
from .sage_husa import SageHusa
from .scaled import Scaled, with_scaled_noise

__all__ = ["AbstractNoise", "Capped", "InnovationMatching", "Nominal", "SageHusa", "Scaled", "with_scaled_noise"]
