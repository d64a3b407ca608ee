"""Models: how a state moves and how it is measured."""

from .augment import AugmentedModel, augment
from .base import AbstractModel, Instant, Sample
from .discretize import forward_euler, runge_kutta_4, van_loan, zero_order_hold
from .functions import Sensor, sensor
from .model import Model, continuous_model, discrete_model, linear_model

__all__ = [
    "AbstractModel",
    "AugmentedModel",
    "Instant",
    "Model",
    "Sample",
    "Sensor",
    "augment",
    "continuous_model",
    "discrete_model",
    "linear_model",
    "forward_euler",
    "runge_kutta_4",
    "sensor",
    "van_loan",
    "zero_order_hold",
]
