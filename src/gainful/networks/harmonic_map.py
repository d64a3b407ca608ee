"""Sums of sines and cosines of angles, such as the deviation curve of a compass."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from .base import AbstractNetwork, AbstractTraining, TrainingReport, checked_examples
from .inputs import input_warnings, varying


class HarmonicMap(AbstractNetwork):
    """`y = offset + sum_j sum_h (a_jh sin h u_j + b_jh cos h u_j)` of angles `u` [rad].

    Attributes:
        amplitudes: `a`, then `b` (outputs, 2, inputs, harmonics).
        offset: what is left of all angles (outputs,).

    Source: National Geospatial-Intelligence Agency (2004), Handbook of Magnetic Compass Adjustment, for one angle and two
        harmonics.
    """

    amplitudes: Float[Array, "outputs 2 inputs harmonics"]
    offset: Float[Array, " outputs"]

    @property
    def inputs(self) -> int:
        return self.amplitudes.shape[2]

    @property
    def outputs(self) -> int:
        return self.offset.shape[0]

    def __call__(self, u: Float[Array, " inputs"]) -> Float[Array, " outputs"]:
        return self.offset + jnp.einsum("osjh,sjh->o", self.amplitudes, _waves(u, self.amplitudes.shape[3]))


class HarmonicTraining(AbstractTraining):
    """Least squares, of least norm where the examples do not tell all amplitudes.

    Attributes:
        harmonics: how many of each angle.

    Raises:
        ConfigError: fewer harmonics than one.

    Example:
        >>> u = np.linspace(-np.pi, np.pi, 100)[:, None]
        >>> network, _ = HarmonicTraining()(u, 1.0 + 2.0 * np.sin(2.0 * u), key=jax.random.key(0))
        >>> round(float(network.amplitudes[0, 0, 0, 1]), 9)
        2.0
    """

    harmonics: int = eqx.field(static=True, default=2)

    def __check_init__(self) -> None:
        if isinstance(self.harmonics, bool) or not isinstance(self.harmonics, int) or self.harmonics < 1:
            raise ConfigError(f"harmonics: expected a whole number of at least 1, got {self.harmonics!r}")

    def __call__(
        self, inputs: Float[np.ndarray, "N d"], targets: Float[np.ndarray, "N m"], *, key: Array
    ) -> tuple[HarmonicMap, TrainingReport]:
        inputs, targets = checked_examples(inputs, targets)
        waves = np.asarray(jax.vmap(lambda u: _waves(u, self.harmonics))(jnp.asarray(inputs)))
        terms = np.concatenate([np.ones((len(inputs), 1)), waves.reshape(len(inputs), -1)], axis=1)
        found = np.linalg.lstsq(terms, targets, rcond=1e-9)[0]
        left = targets - terms @ found
        amplitudes = found[1:].T.reshape(targets.shape[1], *waves.shape[1:])
        moving = varying(inputs)
        rank, warnings = input_warnings(inputs, moving)
        dropped = tuple(k for k in range(inputs.shape[1]) if k not in moving)
        before, after = np.mean(targets**2, axis=0), np.mean(left**2, axis=0)
        network = HarmonicMap(jnp.asarray(amplitudes), jnp.asarray(found[0]))
        return network, TrainingReport(len(inputs), before, after, dropped, rank, None, warnings)


def _waves(u: Float[Array, " inputs"], harmonics: int) -> Float[Array, "2 inputs harmonics"]:
    """Sines, then cosines."""
    phases = u[:, None] * jnp.arange(1.0, harmonics + 1.0)
    return jnp.stack([jnp.sin(phases), jnp.cos(phases)])
