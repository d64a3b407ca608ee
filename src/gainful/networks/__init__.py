"""Networks: functions learned from examples. They know arrays only, nothing of filters, models or files."""

from .affine_map import AffineMap, AffineTraining, zero_map
from .base import AbstractNetwork, AbstractTraining, TrainingReport
from .cmac import CMAC, empty_cmac
from .cmac_training import CMAC_PRESETS, CMACTraining, train_by_credit, train_by_least_squares
from .harmonic_map import HarmonicMap, HarmonicTraining
from .linear_in_weights import LinearInWeights
from .perceptron import MultilayerPerceptron
from .perceptron_training import PerceptronTraining, make_perceptron, train_perceptron
from .product_features import ProductFeatures, product_features_of
from .radial_basis import RadialBasisNetwork, make_radial_basis, thin_plate
from .summed import SummedNetwork
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
    "LinearInWeights",
    "MultilayerPerceptron",
    "PerceptronTraining",
    "ProductFeatures",
    "RadialBasisNetwork",
    "SummedNetwork",
    "Tiling",
    "TrainingReport",
    "empty_cmac",
    "make_perceptron",
    "make_radial_basis",
    "make_tiling",
    "product_features_of",
    "thin_plate",
    "train_by_credit",
    "train_by_least_squares",
    "train_perceptron",
    "zero_map",
]
