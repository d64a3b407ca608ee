"""Differential equations without differentiating: both sides against the same smooth test function."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from .rates import filtered, quadratic_rate

WINDOW = 15
"""Samples a test function is wide by default: for 20 Hz and motion below 1 Hz."""


def weak_taps(window: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of a test function and of the derivative it takes over.

    ```
    phi_j ~ (1 - (j / ((W + 1) / 2))^2)^3,  sum phi_j = 1;   g_j ~ -phi'_j,  sum g_j j dt = 1,   j = -(W - 1)/2 .. (W - 1)/2
    ```

    Args:
        window: samples, odd.
        dt: time between samples [s].

    Raises:
        ConfigError: a window that is even or shorter than 3, or a step that is not above 0.

    Example:
        >>> phi, g = weak_taps(5, 0.1)
        >>> round(float(phi.sum()), 12), round(float(g @ np.arange(-2, 3) * 0.1), 12)
        (1.0, 1.0)
    """
    if not isinstance(window, int) or window < 3 or window % 2 == 0:
        raise ConfigError(f"window: expected an odd number of samples of at least 3, got {window!r}")
    if not dt > 0:
        raise ConfigError(f"dt: expected a time above 0 s, got {dt!r}")
    j = np.arange(window) - window // 2
    x = j / ((window + 1) / 2)
    phi, g = (1 - x**2) ** 3, x * (1 - x**2) ** 2
    return phi / phi.sum(), g / (g @ j * dt)


def weak_curvature_taps(window: int, dt: float) -> np.ndarray:
    """Weights of the second derivative that a test function takes over: exact for parabolas, 0 for ramps.

    ```
    h_j ~ phi''_j - phi_j sum phi'' / sum phi,   sum h_j (j dt)^2 = 2
    ```

    Args:
        window: samples, odd.
        dt: time between samples [s].

    Raises:
        ConfigError: a window that is even or shorter than 3, or a step that is not above 0.

    Example:
        >>> h = weak_curvature_taps(7, 0.1)
        >>> t = np.arange(-3, 4) * 0.1
        >>> abs(round(float(h @ (1.0 + t)), 9)), round(float(h @ t**2), 9)
        (0.0, 2.0)
    """
    phi, _ = weak_taps(window, dt)
    j = np.arange(window) - window // 2
    x = j / ((window + 1) / 2)
    bend = 24.0 * x**2 * (1 - x**2) - 6.0 * (1 - x**2) ** 2
    bend = bend - phi * bend.sum()
    return 2.0 * bend / (bend @ (j * dt) ** 2)


def weak_form(
    signals: Float[Array, "*batch T"], dt: float, window: int = WINDOW
) -> tuple[Float[Array, "*batch T_inner"], Float[Array, "*batch T_inner"]]:
    """Signals smoothed by a test function, and their derivatives smoothed by the same one.

    `int phi x' = -int phi' x`, so a derivative costs no difference of neighbours. Apply the same window to every term of
    an equation: then smoothing biases none of them.

    Args:
        signals: along the last axis.
        dt: time between samples [s].
        window: samples of the test function, odd.

    Returns:
        The smoothed signals and derivatives, at all samples but half a window at either end.

    Raises:
        ConfigError: a window that is even or shorter than 3, or a step that is not above 0.
        ShapeError: fewer samples than the window has.

    Source: Messenger and Bortz (2021), Multiscale Model. Simul. 19(3):1474-1497.

    Example:
        >>> smooth, slope = weak_form(2.0 * jnp.arange(5.0), 1.0, window=3)
        >>> smooth.round(9).tolist(), slope.round(9).tolist()
        ([2.0, 4.0, 6.0], [2.0, 2.0, 2.0])
    """
    phi, g = weak_taps(window, dt)
    x = jnp.asarray(signals)
    return filtered(x, phi), filtered(x, g)


def weak_rows(
    rate: Float[Array, "*batch T"],
    wrench: Float[Array, "*batch T"],
    dt: float,
    *,
    std: float | Array | None = None,
    window: int = WINDOW,
) -> Float[Array, "*batch T_inner 4"]:
    """Rows `[rdot, r, r|r|, tau]` in weak form.

    Args:
        rate: measured, along the last axis.
        wrench: force or moment at the same times.
        dt: time between samples [s].
        std: standard deviation of the rate's noise, to take its mean out of `r|r|`.
        window: samples of the test function, odd.
    """
    smooth, slope = weak_form(rate, dt, window)
    square, force = (weak_form(each, dt, window)[0] for each in (quadratic_rate(rate, std), wrench))
    return jnp.stack(jnp.broadcast_arrays(slope, smooth, square, force), axis=-1)
