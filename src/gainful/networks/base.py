"""The contract of a network, and of the recipe that makes one from data."""

from __future__ import annotations

import abc
import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..errors import DataError, ShapeError


class AbstractNetwork(eqx.Module):
    """A function learned from examples; its weights are array leaves, so that `grad` and `vmap` reach them."""

    @property
    @abc.abstractmethod
    def inputs(self) -> int:
        """How many numbers it takes."""

    @property
    @abc.abstractmethod
    def outputs(self) -> int:
        """How many it gives."""

    @abc.abstractmethod
    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        """The output at an input."""

    def visits(self, u: Float[Array, " inputs"]) -> Float[Array, ""]:
        """How often training visited what answers here, at its least visited part; infinite for networks that do not know."""
        return jnp.full((), jnp.inf, u.dtype)

    def contains(self, u: Float[Array, " inputs"]) -> Bool[Array, ""]:
        """Whether the input is within what the network was trained on; always, for networks that do not know."""
        return jnp.array(True)


@dataclasses.dataclass(frozen=True)
class TrainingReport:
    """What training did.

    Attributes:
        samples: how many examples there were.
        before: mean square of each target (outputs,).
        after: mean square of what is left of each on the training examples themselves (outputs,).
        dropped: inputs that do not vary, left out.
        rank: independent directions among the inputs that do.
        cells: cells of the table that the examples reached, and how many it has; None for networks without one.
        warnings: what a reader of the numbers should know.
    """

    samples: int
    before: np.ndarray
    after: np.ndarray
    dropped: tuple[int, ...] = ()
    rank: int = 0
    cells: tuple[int, int] | None = None
    warnings: tuple[str, ...] = ()


class AbstractTraining(eqx.Module):
    """A recipe: makes a network of one kind from examples, boxes and scales included."""

    @abc.abstractmethod
    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[AbstractNetwork, TrainingReport]:
        """The trained network, and what training did.

        Args:
            inputs: one row per example.
            targets: what the network should give, likewise.
            key: random key of the start and of the order in which the examples are seen.

        Raises:
            ShapeError, DataError: arrays that do not fit each other, hold no finite numbers, or are too few.
        """


LEAST_SAMPLES = 50
"""Examples per output without which nothing is trained."""


def checked_examples(inputs: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The examples as tables of numbers, if they can be learned from.

    Raises:
        ShapeError: not one row of each per example.
        DataError: numbers that are not finite, or too few examples.
    """
    inputs, targets = (np.asarray(values, dtype=float) for values in (inputs, targets))
    if inputs.ndim != 2 or targets.ndim != 2 or len(inputs) != len(targets):
        raise ShapeError(
            f"inputs and targets: expected one row of each per example, got shapes {inputs.shape} and {targets.shape}"
        )
    for name, values in (("inputs", inputs), ("targets", targets)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise DataError(
                f"{name}: expected finite numbers, got {values[bad[0]]} in row {bad[0]} ({bad.size} such rows)"
            )
    needed = LEAST_SAMPLES * targets.shape[1]
    if len(inputs) < needed:
        raise DataError(
            f"training: expected at least {needed} examples for {targets.shape[1]} outputs, got {len(inputs)}"
        )
    return inputs, targets
