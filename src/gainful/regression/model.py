"""Regression as a model: the parameters are the state, and the measurement matrix is the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError
from ..linalg import check_covariance
from ..models import AbstractModel, Instant
from ..spaces import AbstractSpace, Euclidean, SpaceLike, make_space


class RegressionModel(AbstractModel):
    """`z = H x` for constant parameters `x`; the rows of `H`, one per sensor, are the inputs. Made by `regression_model`.

    Attributes:
        space: of the parameters.
        output: of the regressands, one per sensor.
        inputs: names of the regressor columns, sensor by sensor.
        input_units: their units.
        parameters: none; what is estimated is the state.
        walk: spectral density with which the parameters wander (n, n).
        noise: covariance of the regressands (s, s).
    """

    space: AbstractSpace
    output: AbstractSpace
    inputs: tuple[str, ...] = eqx.field(static=True)
    input_units: tuple[str, ...] = eqx.field(static=True)
    parameters: dict[str, Array]
    walk: Float[Array, "n n"]
    noise: Float[Array, "s s"]

    @property
    def sensors(self) -> tuple[tuple[str, int], ...]:
        return tuple((name, 1) for name in self.output.names)

    @property
    def takes_dt(self) -> bool:
        return True

    @property
    def noise_takes_dt(self) -> bool:
        return True

    def with_parameters(self, values: dict[str, Array]) -> RegressionModel:
        return self

    def regressors(self, when: Instant) -> Float[Array, "s n"]:
        """The rows of `H`, one per sensor."""
        return jnp.reshape(when.u, (self.output.size, self.space.size))

    def transition(self, x: Float[Array, " n"], when: Instant) -> Float[Array, " n"]:
        return x

    def observe(self, x: Float[Array, " n"], when: Instant) -> Float[Array, " s"]:
        return self.regressors(when) @ x

    def process_noise(self, x: Float[Array, " n"], when: Instant) -> Float[Array, "n n"]:
        return self.walk.astype(x.dtype) * when.dt

    def measurement_noise(self, x: Float[Array, " n"], when: Instant) -> Float[Array, "s s"]:
        return self.noise.astype(x.dtype)


def regression_model(
    parameters: SpaceLike,
    sensors: Sequence[str] = ("z",),
    *,
    columns: Mapping[str, str] | Sequence[str] | None = None,
    unit: str = "1",
    Q: Any = 0.0,
    R: Any = 1.0,
) -> RegressionModel:
    """A model that is linear in unknown constants: `z = h_1 x_1 + ... + h_n x_n` at each sensor.

    The regressors `h` are inputs of the model, called `<sensor>_<column>`, so that every filter, `run`, `run_many` and
    `OnlineFilter` work on it as on any other. A Kalman filter of it is recursive least squares.

    Args:
        parameters: names and units of what is estimated.
        sensors: names of the regressands, each with regressors of its own.
        columns: names and units of the regressors; by default called as the parameters.
        unit: of the regressands.
        Q: spectral density of the parameters' wandering: scalar, variances or matrix; their variance grows by `Q dt`.
        R: covariance of the regressands' noise: scalar, variances or matrix.

    Raises:
        ModelError: names given twice, parameters that are angles or bounded, or columns that are not as many.
        ShapeError, CovarianceError: Q or R of the wrong size, or no covariances.

    Example:
        >>> model = regression_model({"mass": "kg", "drag": "N s/m"}, ("a", "b"), unit="N")
        >>> model.inputs
        ('a_mass', 'a_drag', 'b_mass', 'b_drag')
    """
    space = make_space(parameters, prefix="x")
    if not all(isinstance(part, Euclidean) for part in space.parts):
        raise ModelError("parameters: expected plain numbers with units, got angles, quaternions or bounds")
    if isinstance(sensors, str) or not sensors or len(set(sensors)) != len(sensors):
        raise ModelError(f"sensors: expected at least one name, each once, got {sensors!r}")
    named = dict(columns) if isinstance(columns, Mapping) else dict.fromkeys(columns or space.names, "1")
    if len(named) != space.size:
        raise ModelError(f"columns: expected {space.size}, one per parameter, got {list(named)}")
    output = Euclidean(tuple(sensors), (unit,) * len(sensors))
    names = tuple(f"{sensor}_{column}" for sensor in sensors for column in named)
    clash = sorted({*space.names, *names} & set(output.names)) or sorted({*space.names} & {*names})
    if clash:
        raise ModelError(f"sensors: {clash[0]!r} is already the name of a parameter or an input")
    units = tuple(named.values()) * len(sensors)
    walk, noise = _matrix(Q, "Q", space.names), _matrix(R, "R", output.names)
    return RegressionModel(Euclidean(space.names, space.units), output, names, units, {}, walk, noise)


def readings(rows: Float[Any, "T s p"]) -> tuple[np.ndarray, np.ndarray]:
    """Measurements and inputs of a regression's record, for `make_log(model, t, *readings(rows))`.

    A row in which anything is missing measures nothing.

    Args:
        rows: of every sensor, regressors first and regressand last; NaN where a number is missing.

    Returns:
        The regressands, NaN where the row is not complete (T, s), and the regressors (T, s n).

    Raises:
        ShapeError: rows without one axis each for time, sensor and column.

    Example:
        >>> y, u = readings([[[1.0, 2.0, 3.0]], [[float("nan"), 2.0, 3.0]]])
        >>> y.tolist(), u.tolist()
        ([[3.0], [nan]], [[1.0, 2.0], [0.0, 0.0]])
    """
    table = np.asarray(rows, dtype=float)
    if table.ndim != 3 or table.shape[-1] < 2:
        raise ShapeError(f"rows: expected shape (times, sensors, columns and regressand), got {table.shape}")
    whole = np.asarray(np.isfinite(table).all(axis=-1))
    y = np.where(whole, table[..., -1], np.nan)
    u = np.where(whole[..., None], table[..., :-1], 0.0)
    return y, u.reshape(len(table), -1)


def _matrix(given: Any, role: str, names: tuple[str, ...]) -> Float[Array, "n n"]:
    """A covariance given as a scalar, variances or a matrix."""
    array = jnp.asarray(given, dtype=float)
    if array.ndim == 0:
        array = jnp.full(len(names), array)
    if array.ndim == 1:
        array = jnp.diag(array)
    if array.shape != (len(names), len(names)):
        raise ShapeError(f"{role}: expected shape ({len(names)}, {len(names)}), got {array.shape}")
    if not isinstance(array, Tracer):
        check_covariance(np.asarray(array), role, names)
    return array
