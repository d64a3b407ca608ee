"""Networks: functions learned from examples. They know arrays only, nothing of filters, models or files."""

from .affine_map import AffineMap, AffineTraining, zero_map
from .base import AbstractNetwork, AbstractTraining, TrainingReport
from .cmac import CMAC, empty_cmac
from .cmac_training import CMAC_PRESETS, CMACTraining, train_by_credit, train_by_least_squares
from .harmonic_map import HarmonicMap, HarmonicTraining
from .perceptron import MultilayerPerceptron
from .perceptron_training import PerceptronTraining, make_perceptron, train_perceptron
from .tiling import Tiling, make_tiling

__all__ = [
    "CMAC",
    "CMAC_PRESETS",
    "AbstractNetwork",
    "AbstractTraining",
    "AffineMap",
    "AffineTraining",
    "CMACTraining",
    "HarmonicMap",
    "HarmonicTraining",
    "MultilayerPerceptron",
    "PerceptronTraining",
    "Tiling",
    "TrainingReport",
    "empty_cmac",
    "make_perceptron",
    "make_tiling",
    "train_by_credit",
    "train_by_least_squares",
    "train_perceptron",
    "zero_map",
]
