"""The filters everybody knows, as choices of parts."""

from __future__ import annotations

from ..estimates import Gaussian, SquareRoot, TwoStage
from ..linearization import Cubature, MarginalSigmaPoints, SigmaPoints, Taylor, Unscented
from ..updates import AbstractUpdate, Exact, InnovationScaling, Iterated
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


def two_stage_kalman_filter(*, update: AbstractUpdate = Exact()) -> KalmanFilter:  # noqa: B008
    """The optimal two-stage Kalman filter: states and biases (all that `augment` or faults added) filtered apart.

    Args:
        update: how strongly a measurement counts.

    Source: Friedland (1969), IEEE Trans. Autom. Control 14(4):359-367; Hsieh and Chen (1999), 44(1):194-199.
    Reduces to: `kalman_filter` of the augmented model, which it equals to rounding.
    """
    return KalmanFilter(Taylor(), update, estimate=TwoStage)


def two_stage_extended_kalman_filter(*, update: AbstractUpdate = Exact()) -> KalmanFilter:  # noqa: B008
    """The two-stage extended Kalman filter, linearised at the total estimate.

    Args:
        update: how strongly a measurement counts.

    Source: Caglayan and Lancraft (1983), Automatica; Hsieh and Chen (1999), IEEE Trans. Autom. Control 44(1):194-199.
    Reduces to: `extended_kalman_filter` of the augmented model, which it equals to rounding.
    """
    return KalmanFilter(Taylor(), update, estimate=TwoStage)


def two_stage_unscented_kalman_filter(
    *,
    form: str = "bias_free",
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
    update: AbstractUpdate = Exact(),  # noqa: B008
) -> KalmanFilter:
    """The two-stage unscented Kalman filter: sigma points over the states alone, no Jacobian.

    Args:
        form: "bias_free" or "rao_blackwell", see `MarginalSigmaPoints`; "augmented" for points over states and biases.
        alpha: spread of the points.
        beta: 2 is best for Gaussian states.
        kappa: secondary scaling.
        update: how strongly a measurement counts.

    Source: Chen et al. (2019), Acta Aeronaut. Astronaut. Sin. 40(5):322551.
    """
    rule = Unscented(alpha, beta, kappa)
    linearization = SigmaPoints(rule) if form == "augmented" else MarginalSigmaPoints(rule, form)
    return KalmanFilter(linearization, update, estimate=TwoStage)


def adaptive_two_stage_unscented_kalman_filter(
    *,
    update: AbstractUpdate = InnovationScaling(),  # noqa: B008
    form: str = "bias_free",
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
) -> KalmanFilter:
    """The two-stage unscented filter whose noise is scaled within the step until it explains the innovations.

    Args:
        update: the scaling; give it the largest possible biases as `bounds`.
        form: as for `two_stage_unscented_kalman_filter`.
        alpha: spread of the points.
        beta: 2 is best for Gaussian states.
        kappa: secondary scaling.

    Source: Chen et al. (2019), Acta Aeronaut. Astronaut. Sin. 40(5):322551; Hajiyev and Soken (2013).
    """
    return two_stage_unscented_kalman_filter(form=form, alpha=alpha, beta=beta, kappa=kappa, update=update)
