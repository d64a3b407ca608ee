"""The filters as textbooks print them, in plain NumPy: inverses, no factors, no missing data. Slow, short, independent."""

from collections.abc import Callable
from typing import Any

import numpy as np

STEP = 0.1  # s


def log_density(residual: np.ndarray, S: np.ndarray) -> float:
    return float(-0.5 * (residual @ np.linalg.inv(S) @ residual + np.log(np.linalg.det(2 * np.pi * S))))


def kalman(x: np.ndarray, P: np.ndarray, F: Any, H: Any, Q: Any, R: Any, ys: np.ndarray) -> dict[str, np.ndarray]:
    """Kalman (1960) with the smoother of Rauch, Tung and Striebel (1965); the first row is not predicted."""
    xs, Ps, densities, predicted = [], [], [], []
    for k, y in enumerate(ys):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        predicted.append((x, P))
        seen = np.isfinite(y)
        C, N = H[seen], R[np.ix_(seen, seen)]
        if seen.any():
            S = C @ P @ C.T + N
            K = P @ C.T @ np.linalg.inv(S)
            residual = y[seen] - C @ x
            densities.append(log_density(residual, S))
            x, P = x + K @ residual, P - K @ S @ K.T
        else:
            densities.append(0.0)
        xs.append(x)
        Ps.append(P)
    smooth, smooth_cov = [xs[-1]], [Ps[-1]]
    for k in reversed(range(len(ys) - 1)):
        ahead, ahead_cov = predicted[k + 1]
        G = Ps[k] @ F.T @ np.linalg.inv(ahead_cov)
        smooth.insert(0, xs[k] + G @ (smooth[0] - ahead))
        smooth_cov.insert(0, Ps[k] + G @ (smooth_cov[0] - ahead_cov) @ G.T)
    found = {"mean": xs, "cov": Ps, "log_likelihood": densities, "smooth": smooth, "smooth_cov": smooth_cov}
    return {name: np.array(values) for name, values in found.items()}


def extended(
    x: np.ndarray, P: np.ndarray, f: Callable, F: Callable, h: Callable, H: Callable, Q: Any, R: Any, ys: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The extended filter with Jacobians written by hand: F before the step, H after it."""
    xs, Ps = [], []
    for k, y in enumerate(ys):
        if k:
            A = F(x)
            x, P = f(x), A @ P @ A.T + Q
        C = H(x)
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        x, P = x + K @ (y - h(x)), (np.eye(len(x)) - K @ C) @ P
        xs.append(x)
        Ps.append(P)
    return np.array(xs), np.array(Ps)


def unscented(
    x: np.ndarray, P: np.ndarray, f: Callable, h: Callable, Q: Any, R: Any, ys: np.ndarray, kappa: float
) -> tuple[np.ndarray, np.ndarray]:
    """The unscented filter of Julier and Uhlmann (2004), boxes 1 and 2, points drawn anew before the update."""
    n = len(x)

    def transform(g: Callable, x: np.ndarray, P: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        columns = np.linalg.cholesky((n + kappa) * P).T
        points = np.array([x, *(x + c for c in columns), *(x - c for c in columns)])
        weights = np.array([kappa / (n + kappa)] + [0.5 / (n + kappa)] * (2 * n))
        images = np.array([g(point) for point in points])
        mean = weights @ images
        off, away = images - mean, points - x
        return mean, (weights * off.T) @ off, (weights * away.T) @ off

    xs, Ps = [], []
    for k, y in enumerate(ys):
        if k:
            x, P, _ = transform(f, x, P)
            P = P + Q
        z, S, cross = transform(h, x, P)
        K = cross @ np.linalg.inv(S + R)
        x, P = x + K @ (y - z), P - K @ (S + R) @ K.T
        xs.append(x)
        Ps.append(P)
    return np.array(xs), np.array(Ps)


class Pendulum:
    """A pendulum seen by its sideways position and its rate: functions, Jacobians and noise, in NumPy or JAX numbers."""

    Q = np.array([[1e-4, 2e-5], [2e-5, 1e-3]])
    R = np.array([[0.01, 0.002], [0.002, 0.04]])
    mean, cov = np.array([0.8, 0.0]), np.array([[0.1, 0.02], [0.02, 0.2]])

    def __init__(self, numpy: Any = np) -> None:
        self.numpy = numpy

    def f(self, x: Any) -> Any:
        return self.numpy.stack([x[0] + STEP * x[1], x[1] - STEP * 9.81 * self.numpy.sin(x[0])])  # 1/s^2

    def h(self, x: Any) -> Any:
        return self.numpy.stack([self.numpy.sin(x[0]), x[1] + 0.1 * x[1] ** 2])

    def F(self, x: np.ndarray) -> np.ndarray:
        return np.array([[1.0, STEP], [-STEP * 9.81 * np.cos(x[0]), 1.0]])

    def H(self, x: np.ndarray) -> np.ndarray:
        return np.array([[np.cos(x[0]), 0.0], [0.0, 1.0 + 0.2 * x[1]]])

    def record(self, rows: int) -> np.ndarray:
        rng = np.random.default_rng(12)
        x, ys = np.array([1.0, -0.3]), []
        for k in range(rows):
            x = self.f(x) if k else x
            ys.append(self.h(x) + np.linalg.cholesky(self.R) @ rng.normal(size=2))
        return np.array(ys)
