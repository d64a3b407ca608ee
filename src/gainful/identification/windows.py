"""How terms are taken from samples: at the samples with differences of neighbours, or against a test function."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

from ..errors import ShapeError
from ..regression import CENTRAL_DIFFERENCE
from ..regression.weak_form import WINDOW, weak_curvature_taps, weak_taps

SECOND_DIFFERENCE = (-1 / 12, 16 / 12, -30 / 12, 16 / 12, -1 / 12)
"""The five-point stencil of the second derivative, exact for polynomials of degree 5."""


@dataclasses.dataclass(frozen=True)
class Window:
    """Weights over neighbouring samples for a value, its derivative and its second derivative.

    Attributes:
        taps: by order of the derivative, all of one odd length.
        weak: whether all of a term goes through them, so that smoothing biases nothing; else only what is differentiated.
    """

    taps: tuple[np.ndarray, np.ndarray, np.ndarray]
    weak: bool

    @property
    def width(self) -> int:
        """Samples that the weights are for."""
        return len(self.taps[0])

    def apply(self, signal: Float[np.ndarray, "T"], order: int) -> Float[np.ndarray, "T"]:
        """A signal, or its derivative, at each sample; NaN where some of the neighbours are missing.

        Raises:
            ShapeError: fewer samples than weights.
        """
        if order == 0 and not self.weak:
            return signal
        if len(signal) < self.width:
            raise ShapeError(f"signals: expected at least {self.width} samples, got {len(signal)}")
        inner = np.convolve(signal, self.taps[order][::-1], mode="valid")
        return np.pad(inner, self.width // 2, constant_values=np.nan)


def pointwise(dt: float) -> Window:
    """Values as sampled, derivatives by five-point differences.

    Args:
        dt: time between samples [s].
    """
    here = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    return Window((here, np.array(CENTRAL_DIFFERENCE) / dt, np.array(SECOND_DIFFERENCE) / dt**2), weak=False)


def against_test_function(dt: float, window: int = WINDOW) -> Window:
    """Values and derivatives against one test function, see `weak_form`.

    Args:
        dt: time between samples [s].
        window: samples of the test function, odd.

    Raises:
        ConfigError: a window that is even or too short for a second derivative.
    """
    smooth, slope = weak_taps(window, dt)
    return Window((smooth, slope, weak_curvature_taps(window, dt)), weak=True)


def make_window(dt: float, width: int, *, weak: bool) -> Window:
    """The window of a method.

    Args:
        dt: time between samples [s].
        width: samples of a test function, odd.
        weak: whether there is one.
    """
    return against_test_function(dt, width) if weak else pointwise(dt)
