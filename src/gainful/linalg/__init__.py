"""Small dense linear algebra that stays valid for semi-definite matrices and compiles to few operations."""

from .checks import check_covariance
from .products import congruence, joseph, product, symmetrize, times_inverse
from .psd import inverse_lower, root, root_and_inverse
from .stationary import stationary_gain
from .stats import chi_square_quantile, gaussian_log_density
from .triangular import downdate, triangularize
from .whitening import whitening_root

__all__ = [
    "check_covariance",
    "chi_square_quantile",
    "congruence",
    "downdate",
    "gaussian_log_density",
    "inverse_lower",
    "joseph",
    "product",
    "root",
    "root_and_inverse",
    "stationary_gain",
    "symmetrize",
    "times_inverse",
    "triangularize",
    "whitening_root",
]
