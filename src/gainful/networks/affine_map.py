"""The simplest network: a straight line, against which the others are to be judged."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .base import AbstractNetwork, AbstractTraining, TrainingReport, checked_examples
from .inputs import input_warnings, varying


class AffineMap(AbstractNetwork):
    """`y = offset + matrix u`.

    Attributes:
        matrix: slopes (outputs, inputs).
        offset: value at 0 (outputs,).
    """

    matrix: Float[Array, "outputs inputs"]
    offset: Float[Array, " outputs"]

    @property
    def inputs(self) -> int:
        return self.matrix.shape[1]

    @property
    def outputs(self) -> int:
        return self.matrix.shape[0]

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return self.offset + self.matrix @ u


def zero_map(inputs: int, outputs: int) -> AffineMap:
    """The network that gives zero everywhere.

    Args:
        inputs: how many numbers it takes.
        outputs: how many it gives.
    """
    return AffineMap(jnp.zeros((outputs, inputs)), jnp.zeros(outputs))


class AffineTraining(AbstractTraining):
    """Least squares, of least norm where inputs repeat each other.

    Example:
        >>> import jax
        >>> u = np.linspace(-1.0, 1.0, 100)[:, None]
        >>> round(float(AffineTraining()(u, 3.0 * u + 1.0, key=jax.random.key(0))[0].matrix[0, 0]), 9)
        3.0
    """

    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[AffineMap, TrainingReport]:
        inputs, targets = checked_examples(inputs, targets)
        columns = varying(inputs)
        rank, warnings = input_warnings(inputs, columns)
        chosen = inputs[:, list(columns)]
        centre, spread = chosen.mean(axis=0), chosen.std(axis=0)
        scaled = np.concatenate([np.ones((len(inputs), 1)), (chosen - centre) / spread], axis=1)
        # Directions in which the inputs move by rounding alone tell nothing.
        solved = np.linalg.lstsq(scaled, targets, rcond=1e-9)[0]
        matrix = np.zeros((targets.shape[1], inputs.shape[1]))
        matrix[:, list(columns)] = (solved[1:] / spread[:, None]).T
        network = AffineMap(jnp.asarray(matrix), jnp.asarray(solved[0] - matrix[:, list(columns)] @ centre))
        left = targets - scaled @ solved
        dropped = tuple(k for k in range(inputs.shape[1]) if k not in columns)
        before, after = np.mean(targets**2, axis=0), np.mean(left**2, axis=0)
        return network, TrainingReport(len(inputs), before, after, dropped, rank, None, warnings)
