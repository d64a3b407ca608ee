"""The filters everybody knows, as choices of parts."""

from __future__ import annotations

from ..estimates import Gaussian, SquareRoot, TwoStage
from ..linearization import Cubature, MarginalSigmaPoints, SigmaPoints, Taylor, Unscented
from ..updates import (
    AbstractUpdate,
    Exact,
    HuberReweighted,
    InnovationScaling,
    Iterated,
    MasreliezMartin,
    MaximumCorrentropy,
    StudentT,
    WeightedLikelihood,
)
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


def robust_extended_kalman_filter(*, contamination: float = 0.1, square_root: bool = False) -> KalmanFilter:
    """The extended filter in which an outlier pulls no further than Huber's threshold.

    Args:
        contamination: share of measurements that may be outliers.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Masreliez and Martin (1977), IEEE Trans. Autom. Control 22(3):361-371.
    Reduces to: `extended_kalman_filter` for no contamination.
    """
    return extended_kalman_filter(update=MasreliezMartin(contamination), square_root=square_root)


def robust_unscented_kalman_filter(
    *,
    contamination: float = 0.1,
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
    square_root: bool = False,
) -> KalmanFilter:
    """The unscented filter in which an outlier pulls no further than Huber's threshold.

    Args:
        contamination: share of measurements that may be outliers.
        alpha: spread of the points.
        beta: 2 is best for Gaussian states.
        kappa: secondary scaling.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Masreliez and Martin (1977), IEEE Trans. Autom. Control 22(3):361-371; Julier and Uhlmann (2004).
    Reduces to: `unscented_kalman_filter` for no contamination.
    """
    update = MasreliezMartin(contamination)
    return unscented_kalman_filter(alpha=alpha, beta=beta, kappa=kappa, update=update, square_root=square_root)


def huber_kalman_filter(*, contamination: float = 0.1, iterations: int = 5, square_root: bool = False) -> KalmanFilter:
    """The extended filter that minimises Huber's cost of measurement and prediction, by least squares reweighted.

    Args:
        contamination: share of measurements that may be outliers.
        iterations: how often the weights are found.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Karlgaard and Schaub (2007), J. Guid. Control Dyn. 30(3):885-891.
    """
    update = HuberReweighted(contamination=contamination, iterations=iterations)
    return extended_kalman_filter(update=update, square_root=square_root)


def student_t_kalman_filter(*, dof: float = 6.0, iterations: int = 5, square_root: bool = False) -> KalmanFilter:
    """The extended filter for measurement noise with the tails of Student's t.

    Args:
        dof: degrees of freedom of the noise; fewer have heavier tails.
        iterations: how often state and noise scales take turns.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Agamennoni, Nieto and Nebot (2012), IEEE Trans. Signal Process. 60(10):5024-5037.
    """
    return extended_kalman_filter(update=StudentT(dof=dof, iterations=iterations), square_root=square_root)


def maximum_correntropy_kalman_filter(
    *, bandwidth: float = 3.0, iterations: int = 5, square_root: bool = False
) -> KalmanFilter:
    """The extended filter in which measurements far off lose all weight.

    Args:
        bandwidth: in sigmas.
        iterations: how often the weights are found.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Chen, Liu, Zhao and Principe (2017), Automatica 76:70-77.
    """
    return extended_kalman_filter(
        update=MaximumCorrentropy(bandwidth=bandwidth, iterations=iterations), square_root=square_root
    )


def weighted_likelihood_kalman_filter(*, scale: float = 3.0, square_root: bool = False) -> KalmanFilter:
    """The extended filter whose measurements count less the further they are from what was expected (WoLF).

    Args:
        scale: distance, in sigmas of R, beyond which weights fall.
        square_root: carry the root of the covariance in place of the covariance.

    Source: Duran-Martin et al. (2024), Outlier-robust Kalman filtering through generalised Bayes, ICML.
    """
    return extended_kalman_filter(update=WeightedLikelihood(scale=scale), square_root=square_root)
