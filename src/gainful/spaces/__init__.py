"""Where states and measurements live: how a small change is added, and how two points differ."""

from .base import AbstractSpace
from .bounded import Interval, Positive
from .circle import Circle, wrap_angle
from .euclidean import Euclidean
from .product import Product
from .quaternion import Quaternion, quaternion_conjugate, quaternion_exp, quaternion_log, quaternion_multiply, rotate
from .signals import SpaceLike, make_space

__all__ = [
    "AbstractSpace",
    "Circle",
    "Euclidean",
    "Interval",
    "Positive",
    "Product",
    "Quaternion",
    "SpaceLike",
    "make_space",
    "quaternion_conjugate",
    "quaternion_exp",
    "quaternion_log",
    "quaternion_multiply",
    "rotate",
    "wrap_angle",
]
