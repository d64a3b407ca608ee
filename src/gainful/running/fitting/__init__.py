"""Fitting the noise of a model to records."""

from .entries import NoiseEntry
from .fit import fit_noise
from .noise_fit import FittedEntry, NoiseFit

__all__ = ["FittedEntry", "NoiseEntry", "NoiseFit", "fit_noise"]
