"""Small problems, and what NumPy says about them."""

from fractions import Fraction
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import gainful as gf

PHASE, DAMPING = 0.7, 0.05  # rad/s, 1/s


def _drift(dt: Any) -> Any:
    """A damped rotation over any time step."""
    c, s = jnp.cos(PHASE * dt), jnp.sin(PHASE * dt)
    return jnp.exp(-DAMPING * dt) * jnp.array([[c, s], [-s, c]])


def _transition(x: Any, u: Any, t: Any, dt: Any) -> Any:
    return _drift(dt)


def _spread(x: Any, u: Any, t: Any, dt: Any) -> Any:
    return dt * jnp.array([[0.02, 0.005], [0.005, 0.03]])


B, D = np.array([[0.1], [0.4]]), np.array([[0.0], [0.2]])
H, R = np.array([[1.0, 0.2], [-0.3, 0.8]]), np.array([[0.05, 0.01], [0.01, 0.09]])
MEAN, COV = np.array([0.5, -1.0]), np.array([[0.8, 0.1], [0.1, 0.5]])


def linear_model() -> gf.models.model.Model:
    return gf.linear_model(_transition, H, Q=_spread, R=R, B=B, D=D, states=["a", "b"], inputs=["u"])


class Linear:
    """A linear problem with uneven steps, two rows at one moment, an early prior and missing components."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.model = linear_model()
        self.prior = gf.make_prior(self.model, MEAN, cov=COV)
        self.t = np.array([0.3, 0.8, 0.8, 1.9, 2.0, 2.6, 3.0, 3.3, 4.5, 4.9, 5.6, 6.0])
        rows = len(self.t)
        self.u, self.y = rng.normal(size=(rows, 1)), rng.normal(size=(rows, 2))
        self.y[2, 0] = self.y[5, 1] = np.nan
        self.y[7] = np.nan
        self.log = gf.make_log(self.model, self.t, self.y, self.u, start=0.0)
        self._states()

    def _states(self) -> None:
        """All distinct states as one linear map of the prior state and the process noises: X = A z + b."""
        n = 2
        rows, covs = [np.eye(n)], [COV]
        offsets = [np.zeros(n)]
        self.index = []
        for k, dt in enumerate(self.log.dt):
            if dt > 0:
                F = np.asarray(_drift(dt))
                rows.append(np.hstack([F @ rows[-1], np.eye(n)]))
                offsets.append(F @ offsets[-1] + B @ self.u[k])
                covs.append(np.asarray(_spread(None, None, None, dt)))
            self.index.append(len(rows) - 1)
        count = len(rows)
        self.map = np.vstack([np.pad(row, ((0, 0), (0, n * count - row.shape[1]))) for row in rows])
        self.offset = np.concatenate(offsets)
        self.covs = covs
        big = np.zeros((n * count, n * count))
        for i, cov in enumerate(covs):
            big[n * i : n * i + n, n * i : n * i + n] = cov
        start = np.zeros(n * count)
        start[:n] = MEAN
        self.state_mean = self.map @ start + self.offset
        self.state_cov = self.map @ big @ self.map.T

    def measurements(self, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """`y, C, d, N` of all components seen in the first rows: y = C X + d + v."""
        ys, Cs, ds, blocks = [], [], [], []
        for k in range(rows):
            seen = np.flatnonzero(np.isfinite(self.y[k]))
            C = np.zeros((len(seen), len(self.state_mean)))
            C[:, 2 * self.index[k] : 2 * self.index[k] + 2] = H[seen]
            ys.append(self.y[k][seen])
            Cs.append(C)
            ds.append((D @ self.u[k])[seen])
            blocks.append(R[np.ix_(seen, seen)])
        size = sum(map(len, ys))
        N, i = np.zeros((size, size)), 0
        for block in blocks:
            N[i : i + len(block), i : i + len(block)] = block
            i += len(block)
        return np.concatenate(ys), np.vstack(Cs), np.concatenate(ds), N

    def least_squares(self, rows: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of every row's state given the first rows, from the normal equations of the trajectory.

        Unknowns are the states themselves: the prior, each step and each measurement is one whitened equation.
        """
        n, size = 2, len(self.state_mean)
        y, C, d, N = self.measurements(rows)
        equations, right = [], []

        def add(matrix: np.ndarray, value: np.ndarray, cov: np.ndarray) -> None:
            whiten = np.linalg.inv(np.linalg.cholesky(cov))
            equations.append(whiten @ matrix)
            right.append(whiten @ value)

        add(np.eye(n, size), MEAN, COV)
        moves = [(k, dt) for k, dt in enumerate(self.log.dt) if dt > 0]
        for i, (k, dt) in enumerate(moves, start=1):
            step = np.zeros((n, size))
            step[:, n * i : n * i + n] = np.eye(n)
            step[:, n * i - n : n * i] = -np.asarray(_drift(dt))
            add(step, B @ self.u[k], self.covs[i])
        add(C, y - d, N)
        J, b = np.vstack(equations), np.concatenate(right)
        cov = np.linalg.inv(J.T @ J)
        mean = cov @ (J.T @ b)
        index = np.array(self.index)
        blocks = [cov[n * i : n * i + n, n * i : n * i + n] for i in index]
        return mean.reshape(-1, n)[index], np.array(blocks)

    def log_density(self, rows: int) -> float:
        """Joint log density of everything seen in the first rows."""
        y, C, d, N = self.measurements(rows)
        S = C @ self.state_cov @ C.T + N
        off = y - C @ self.state_mean - d
        return -0.5 * (off @ np.linalg.solve(S, off) + np.linalg.slogdet(2 * np.pi * S)[1])


def _sway(x: Any, u: Any) -> Any:
    return jnp.stack([x[0], x[1] - 0.2 * jnp.sin(x[1]) * x[0] + 0.1 * u[0]])


def _look(x: Any) -> Any:
    return jnp.stack([jnp.sin(x[1]), x[0] * x[1]])


def pendulum(rng: np.random.Generator) -> tuple[Any, Any, Any]:
    """Model, prior and record of a slow pendulum with an unknown constant: curved, with a state that has no noise."""
    states, outputs = ["stiffness", "angle"], ["y", "z"]
    model = gf.discrete_model(_sway, _look, states=states, outputs=outputs, inputs=1, Q=[0.0, 1e-2], R=[0.02, 0.1])
    prior = gf.make_prior(model, [1.2, 0.4], [0.3, 0.3])
    y, u = 0.4 * rng.normal(size=(25, 2)), rng.normal(size=(25, 1))
    y[3, 0] = y[8, 1] = np.nan
    y[12:14] = np.nan
    return model, prior, gf.make_log(model, 0.2 * np.arange(25), y, u)


def single(tree: Any) -> Any:
    """The tree in single precision."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), tree)


class Exact:
    """Matrices of fractions: the Kalman filter without rounding."""

    def __init__(self, values: Any) -> None:
        self.rows = values if isinstance(values, list) else [[Fraction(float(v)) for v in row] for row in values]

    def __matmul__(self, other: "Exact") -> "Exact":
        return Exact(
            [[sum(a * b for a, b in zip(row, column, strict=True)) for column in other.T.rows] for row in self.rows]
        )

    def __add__(self, other: "Exact") -> "Exact":
        return Exact([[a + b for a, b in zip(*rows, strict=True)] for rows in zip(self.rows, other.rows, strict=True)])

    def __sub__(self, other: "Exact") -> "Exact":
        return Exact([[a - b for a, b in zip(*rows, strict=True)] for rows in zip(self.rows, other.rows, strict=True)])

    @property
    def T(self) -> "Exact":
        return Exact([list(column) for column in zip(*self.rows, strict=True)])

    def inverse(self) -> "Exact":
        n = len(self.rows)
        table = [row + [Fraction(int(i == j)) for j in range(n)] for i, row in enumerate(self.rows)]
        for i in range(n):
            pivot = next(k for k in range(i, n) if table[k][i] != 0)
            table[i], table[pivot] = table[pivot], table[i]
            table[i] = [value / table[i][i] for value in table[i]]
            for k in range(n):
                if k != i and table[k][i] != 0:
                    table[k] = [a - table[k][i] * b for a, b in zip(table[k], table[i], strict=True)]
        return Exact([row[n:] for row in table])

    def numbers(self) -> np.ndarray:
        return np.array([[float(value) for value in row] for row in self.rows])

    def condition(self, cov: "Exact", matrix: "Exact", noise: "Exact", y: "Exact") -> tuple["Exact", "Exact"]:
        """Mean (this, a column) and covariance given `y = matrix x + noise`."""
        cross = cov @ matrix.T
        gain = cross @ (matrix @ cross + noise).inverse()
        return self + gain @ (y - matrix @ self), cov - gain @ cross.T
