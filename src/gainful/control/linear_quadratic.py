"""Linear plants in discrete time: linearisation, regulators, and the poles of their loops."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError
from ..models import AbstractModel, Instant


def _numbers(value: Any) -> np.ndarray:
    return np.asarray(value, float)


class LinearPlant(eqx.Module):
    """`x(k+1) = A x(k) + B u(k)`, in deviations from an equilibrium.

    Attributes:
        A: (n, n).
        B: (n, m).

    Raises:
        ShapeError: matrices that do not fit each other.
    """

    A: np.ndarray = eqx.field(converter=_numbers)
    B: np.ndarray = eqx.field(converter=_numbers)

    def __check_init__(self) -> None:
        if self.A.ndim != 2 or self.A.shape[0] != self.A.shape[1]:
            raise ShapeError(f"A: expected a square matrix, got shape {self.A.shape}")
        if self.B.ndim != 2 or len(self.B) != len(self.A):
            raise ShapeError(f"B: expected {len(self.A)} rows, got shape {self.B.shape}")


def linearised(model: AbstractModel, x: Any, u: Any, dt: float, *, t: float = 0.0) -> LinearPlant:
    """How a model's state one step later changes with the state and the input about a point.

    Deviations are in the degrees of freedom of the model's space: a quaternion's is a rotation vector in body axes [rad].

    Args:
        model: any model.
        x: the state about which.
        u: the input, held over the step.
        dt: length of the step [s].
        t: time at its end [s].

    Raises:
        ShapeError: a state or an input of another size.

    Example:
        >>> from gainful.models import continuous_model
        >>> point = continuous_model(lambda x, u: jnp.stack([x[1], u[0]]), lambda x: x[:1],
        ...                          states={"p": "m", "v": "m/s"}, inputs={"a": "m/s^2"}, outputs={"y": "m"},
        ...                          Q=[0.0, 0.0], R=1.0)
        >>> linearised(point, [0.0, 0.0], [0.0], 1.0).B.tolist()
        [[0.5], [1.0]]
    """
    x, u = jnp.asarray(x, float), jnp.asarray(u, float)
    for name, value, size in (("x", x, model.space.size), ("u", u, len(model.inputs))):
        if value.shape != (size,):
            raise ShapeError(f"{name}: expected {size} numbers, got shape {value.shape}")
    space, still = model.space, jnp.zeros(model.space.dof)

    def moved(d: Array, v: Array) -> Array:
        return model.transition(space.plus(x, d), Instant(jnp.asarray(t, float), jnp.asarray(dt, float), v))

    there = moved(still, u)
    A, B = jax.jit(jax.jacfwd(lambda d, v: space.minus(moved(d, v), there), argnums=(0, 1)))(still, u)
    return LinearPlant(A, B)


def lqr(plant: LinearPlant, Q: Any, R: Any) -> tuple[Float[np.ndarray, "m n"], Float[np.ndarray, "n n"]]:
    """The gain of `u = -K x` that makes the sum of `x'Q x + u'R u` least, and the matrix P of what is left of that sum.

    Args:
        plant: to be regulated.
        Q: cost of the state (n, n), or its diagonal.
        R: cost of the input (m, m), or its diagonal.

    Raises:
        ShapeError: costs of another size.
        ModelError: no gain stabilises the plant, or the costs do not see one of its unstable modes.

    Source: Anderson and Moore (1990), Optimal Control: Linear Quadratic Methods, section 2.4.

    Example:
        >>> K, P = lqr(LinearPlant([[1.0]], [[1.0]]), [1.0], [1.0])
        >>> round(float(K[0, 0]), 6)  # the golden ratio less 1
        0.618034
    """
    Q, R = _cost("Q", Q, len(plant.A)), _cost("R", R, plant.B.shape[1])
    try:
        P = scipy.linalg.solve_discrete_are(plant.A, plant.B, Q, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ModelError(
            "plant: expected one that an input can stabilise and whose unstable modes the cost sees, got no solution of "
            "the Riccati equation"
        ) from error
    return np.linalg.solve(R + plant.B.T @ P @ plant.B, plant.B.T @ P @ plant.A), P


def lqi(
    plant: LinearPlant, C: Any, Q: Any, R: Any, integral: Any, interval: float
) -> tuple[Float[np.ndarray, "m n"], Float[np.ndarray, "m outputs"]]:
    """Gains of `u = -K x - K_i s`, where `s(k+1) = s(k) + interval C x(k)` integrates what shall have no lasting error.

    Args:
        plant: to be regulated.
        C: what is integrated (outputs, n).
        Q: cost of the state (n, n), or its diagonal.
        R: cost of the input (m, m), or its diagonal.
        integral: cost of the integrals (outputs, outputs), or its diagonal.
        interval: between samples [s].

    Raises:
        ShapeError: matrices of another size.
        ModelError: as `lqr`; also where there are more integrals than inputs can keep at rest.

    Source: Young and Willems (1972), Int. J. Control 15(5):961-978.
    """
    C = np.asarray(C, float)
    n, m = plant.B.shape
    if C.ndim != 2 or C.shape[1] != n:
        raise ShapeError(f"C: expected {n} columns, got shape {C.shape}")
    outputs = len(C)
    A = np.block([[plant.A, np.zeros((n, outputs))], [interval * C, np.eye(outputs)]])
    B = np.vstack([plant.B, np.zeros((outputs, m))])
    cost = scipy.linalg.block_diag(_cost("Q", Q, n), _cost("integral", integral, outputs))
    K, _ = lqr(LinearPlant(A, B), cost, R)
    return K[:, :n], K[:, n:]


def closed_loop_poles(plant: LinearPlant, gain: Any) -> np.ndarray:
    """Eigenvalues of `A - B K`, the largest in magnitude first; the loop is stable where that is below 1."""
    poles = np.linalg.eigvals(plant.A - plant.B @ np.asarray(gain, float))
    return poles[np.argsort(-np.abs(poles))]


def one_step_gain(plant: LinearPlant, weights: Any, desired: Any) -> Float[np.ndarray, "m n"]:
    """The gain of `u = -K x` by which the next state comes nearest to `D x`, in the sense of the weights.

    That is what an inversion of the exact model does about an equilibrium. Its poles tell whether the weights and the
    command make a stable loop: one step is looked ahead, and nothing else sees to it.

    Args:
        plant: the exact model.
        weights: of the next state (n,), or a matrix (n, n).
        desired: D, how the command depends on the state (n, n).

    Example:
        >>> double = LinearPlant([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
        >>> rate_command = [[0.0, 0.0], [-1.0, -0.1]]  # minus the place one step ahead
        >>> bool(abs(closed_loop_poles(double, one_step_gain(double, [0.0, 1.0], rate_command))[0]) < 1)
        True
    """
    W = _cost("weights", weights, len(plant.A))
    return np.linalg.solve(plant.B.T @ W @ plant.B, plant.B.T @ W @ (plant.A - np.asarray(desired, float)))


def _cost(name: str, given: Any, size: int) -> np.ndarray:
    value = np.asarray(given, float)
    if value.shape not in ((size,), (size, size)):
        raise ShapeError(f"{name}: expected {size} numbers or a matrix of that size, got shape {value.shape}")
    return np.diag(value) if value.ndim == 1 else value
