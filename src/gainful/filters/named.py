"""The filters everybody knows, as choices of parts."""

from __future__ import annotations

from ..estimates import Gaussian, SquareRoot
from ..linearization import Cubature, SigmaPoints, Taylor, Unscented
from ..updates import AbstractUpdate, Exact, Iterated
from .kalman import KalmanFilter


def _estimate(square_root: bool) -> type[Gaussian] | type[SquareRoot]:
    return SquareRoot if square_root else Gaussian


def kalman_filter(*, update: AbstractUpdate = Exact(), square_root: bool = False) -> KalmanFilter:  # noqa: B008
    """The Kalman filter, for linear models; on a nonlinear one it is the extended filter.

    Args:
        update: how strongly a measurement counts.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Kalman (1960), J. Basic Eng. 82(1):35-45.
    """
    return KalmanFilter(Taylor(), update, estimate=_estimate(square_root))


def extended_kalman_filter(*, update: AbstractUpdate = Exact(), square_root: bool = False) -> KalmanFilter:  # noqa: B008
    """The extended Kalman filter: first-order expansion at the mean, Jacobians by automatic differentiation.

    Args:
        update: how strongly a measurement counts.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Smith, Schmidt and McGee (1962), NASA TR R-135.
    """
    return KalmanFilter(Taylor(), update, estimate=_estimate(square_root))


def iterated_extended_kalman_filter(*, iterations: int = 5, square_root: bool = False) -> KalmanFilter:
    """The extended filter with the measurement linearised again where the update has led.

    Args:
        iterations: linearizations per measurement.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Bell and Cathey (1993), IEEE Trans. Autom. Control 38(2):294-297.
    """
    return KalmanFilter(Taylor(), Iterated(iterations=iterations), estimate=_estimate(square_root))


def unscented_kalman_filter(
    *,
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
    update: AbstractUpdate = Exact(),  # noqa: B008
    square_root: bool = False,
) -> KalmanFilter:
    """The unscented Kalman filter: `2 n + 1` sigma points, no Jacobian, drawn anew before each update.

    Args:
        alpha: spread of the points.
        beta: 2 is best for Gaussian states.
        kappa: secondary scaling.
        update: how strongly a measurement counts.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Julier and Uhlmann (2004), Proc. IEEE 92(3):401-422.
    """
    return KalmanFilter(SigmaPoints(Unscented(alpha, beta, kappa)), update, estimate=_estimate(square_root))


def cubature_kalman_filter(*, update: AbstractUpdate = Exact(), square_root: bool = False) -> KalmanFilter:  # noqa: B008
    """The cubature Kalman filter: `2 n` equally weighted points.

    Args:
        update: how strongly a measurement counts.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Arasaratnam and Haykin (2009), IEEE Trans. Autom. Control 54(6):1254-1269.
    """
    return KalmanFilter(SigmaPoints(Cubature()), update, estimate=_estimate(square_root))
