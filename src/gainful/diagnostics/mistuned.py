"""What a stationary filter loses whose noise is wrong, and how much of it its innovations could give back."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float

from ..errors import ConfigError, ShapeError


@dataclasses.dataclass(frozen=True)
class MistunedError:
    """Exact moments of a filter of fixed gain on a plant with other noise than it was designed for.

    Attributes:
        cov: of the error after the update, truth minus estimate (n, n).
        innovation_cov: of the innovation (m, m).
        cross: covariance of error and innovation, 0 for the optimal gain (n, m).
        corrected: covariance of the error that is left by the best linear map of the present innovation (n, n).
    """

    cov: Float[np.ndarray, "n n"]
    innovation_cov: Float[np.ndarray, "m m"]
    cross: Float[np.ndarray, "n m"]
    corrected: Float[np.ndarray, "n n"]


def stationary_mistuned_error(F: Any, H: Any, K: Any, Q: Any, R: Any) -> MistunedError:
    """The error of `x <- F x + K (y - H F x)` when its start is forgotten.

    ```
    A = (I - K H) F;  P = A P A^T + (I - K H) Q (I - K H)^T + K R K^T;  M = F P F^T + Q
    S = H M H^T + R;  C = (I - K H) M H^T - K R;  best with the innovation: P - C S^-1 C^T
    ```

    Args:
        F: transition matrix (n, n).
        H: measurement matrix (m, n).
        K: the filter's gain, such as `stationary_gain` of the noise it believes in (n, m).
        Q: process noise of the plant (n, n).
        R: measurement noise of the sensors (m, m).

    Raises:
        ShapeError: sizes that do not fit.
        ConfigError: a gain that makes no stable filter.

    Source: Anderson and Moore (1979), Optimal Filtering, 4.4, 6.

    Example:
        >>> wrong = stationary_mistuned_error([[1.0]], [[1.0]], [[0.9]], [[1.0]], [[1.0]])
        >>> wrong.cov.round(3).tolist(), wrong.corrected.round(3).tolist()
        ([[0.828]], [[0.646]])
    """
    F, H, K, Q, R = _matrices(F, H, K, Q, R)
    keep = np.eye(len(F)) - K @ H
    A = keep @ F
    radius = float(np.abs(np.linalg.eigvals(A)).max())
    if not radius < 1:
        raise ConfigError(
            f"K: expected a gain that makes a stable filter, got one with a mode of {radius:.6g} per step"
        )
    P = scipy.linalg.solve_discrete_lyapunov(A, keep @ Q @ keep.T + K @ R @ K.T)
    M = F @ P @ F.T + Q
    S = H @ M @ H.T + R
    C = keep @ M @ H.T - K @ R
    return MistunedError(P, S, C, P - C @ np.linalg.solve(S, C.T))


def innovation_lag_bound(F: Any, H: Any, K: Any, Q: Any, R: Any, lags: int) -> Float[np.ndarray, "n n"]:
    """Covariance of the error that is left by the best linear map of the last `lags` innovations.

    ```
    cov(e_k, r_k-j) = A^j C;  cov(r_k, r_k-j) = H F A^(j-1) C
    ```

    What no output correction can get below, however it is learned, if it sees so many innovations; with many it is
    the error of the optimal filter.

    Args:
        F: transition matrix (n, n).
        H: measurement matrix (m, n).
        K: the filter's gain (n, m).
        Q: process noise of the plant (n, n).
        R: measurement noise of the sensors (m, m).
        lags: innovations seen, the present one included.

    Raises:
        ShapeError: sizes that do not fit.
        ConfigError: a gain that makes no stable filter, or no innovation.

    Example:
        >>> [innovation_lag_bound([[1.0]], [[1.0]], [[0.9]], [[1.0]], [[1.0]], n).round(3).item() for n in (1, 20)]
        [0.646, 0.618]
    """
    if isinstance(lags, bool) or not isinstance(lags, int) or lags < 1:
        raise ConfigError(f"lags: expected a whole number of at least 1, got {lags!r}")
    found = stationary_mistuned_error(F, H, K, Q, R)
    F, H, K, _, _ = _matrices(F, H, K, Q, R)
    A, C, m = (np.eye(len(F)) - K @ H) @ F, found.cross, len(H)
    with_error, later = [C], [found.innovation_cov]
    for _ in range(1, lags):
        later.append(H @ F @ with_error[-1])
        with_error.append(A @ with_error[-1])
    among = np.block([[later[j - i] if j >= i else later[i - j].T for j in range(lags)] for i in range(lags)])
    cross = np.concatenate(with_error, axis=1)
    assert among.shape == (lags * m, lags * m)
    return found.cov - cross @ np.linalg.solve(among, cross.T)


def _matrices(F: Any, H: Any, K: Any, Q: Any, R: Any) -> tuple[np.ndarray, ...]:
    given = {name: np.asarray(each, float) for name, each in zip("FHKQR", (F, H, K, Q, R), strict=True)}
    n, m = given["F"].shape[-1] if given["F"].ndim else 0, len(given["H"]) if given["H"].ndim else 0
    for name, shape in zip("FHKQR", ((n, n), (m, n), (n, m), (n, n), (m, m)), strict=True):
        if given[name].shape != shape:
            raise ShapeError(f"{name}: expected shape {shape}, got {given[name].shape}")
    return tuple(given.values())
