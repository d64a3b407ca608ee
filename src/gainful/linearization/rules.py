"""Where to put sigma points and what they weigh."""

from __future__ import annotations

import abc
import itertools

import equinox as eqx
import numpy as np

from ..errors import ConfigError


class AbstractRule(eqx.Module):
    """Points for a standard normal vector, symmetric, matching its mean and covariance."""

    @abc.abstractmethod
    def points(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit points (n, k), weights of the mean (k,), weights of the covariance (k,)."""


class Unscented(AbstractRule):
    """`2 n + 1` points at distance `sqrt(n + lambda)`, `lambda = alpha^2 (n + kappa) - n`.

    With the defaults all weights are non-negative. A small `alpha` puts a large negative weight on the centre, which
    cancels digits; square-root estimates then need a downdate that can fail.

    Attributes:
        alpha: spread of the points, above 0.
        beta: 2 is best for Gaussian states.
        kappa: above -n.

    Source: Julier and Uhlmann (2004), Proc. IEEE 92(3):401-422; Wan and van der Merwe (2000), AS-SPCC.
    Reduces to: `Cubature` for alpha = 1, beta = 0, kappa = 0.
    """

    alpha: float = eqx.field(static=True, default=1.0)
    beta: float = eqx.field(static=True, default=2.0)
    kappa: float = eqx.field(static=True, default=0.0)

    def __check_init__(self) -> None:
        if not self.alpha > 0:
            raise ConfigError(f"alpha: expected a number above 0, got {self.alpha!r}")

    def points(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if not n + self.kappa > 0:
            raise ConfigError(f"kappa: expected more than -{n} for {n} states, got {self.kappa!r}")
        spread = self.alpha**2 * (n + self.kappa)
        unit = np.sqrt(spread) * np.eye(n)
        mean = np.full(2 * n + 1, 0.5 / spread)
        mean[0] = 1.0 - n / spread
        cov = mean.copy()
        cov[0] += 1.0 - self.alpha**2 + self.beta
        return np.concatenate([np.zeros((n, 1)), unit, -unit], axis=1), mean, cov


class Cubature(AbstractRule):
    """`2 n` equally weighted points at distance `sqrt(n)`.

    Source: Arasaratnam and Haykin (2009), IEEE Trans. Autom. Control 54(6):1254-1269.
    """

    def points(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        unit = np.sqrt(n) * np.eye(n)
        weights = np.full(2 * n, 0.5 / n)
        return np.concatenate([unit, -unit], axis=1), weights, weights


class GaussHermite(AbstractRule):
    """`order ** n` points: exact moments for polynomials of degree `2 order - 1` in each direction; for few states.

    Attributes:
        order: points per direction, at least 2.

    Source: Ito and Xiong (2000), IEEE Trans. Autom. Control 45(5):910-927.
    """

    order: int = eqx.field(static=True, default=3)

    def __check_init__(self) -> None:
        if not isinstance(self.order, int) or self.order < 2:
            raise ConfigError(f"order: expected a whole number of at least 2, got {self.order!r}")

    def points(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if self.order**n > 20_000:
            raise ConfigError(
                f"order: {self.order} points in each of {n} directions make {self.order**n}; use Unscented or Cubature"
            )
        nodes, weights = np.polynomial.hermite_e.hermegauss(self.order)
        weights = weights / weights.sum()
        grid = np.array(list(itertools.product(nodes, repeat=n))).T
        product = np.array([np.prod(row) for row in itertools.product(weights, repeat=n)])
        return grid, product, product
