"""Which fault explains an alarm best."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError, ShapeError

MARGIN = 6.0
"""Twice the log likelihood ratio by which one fault must beat another: odds of 20 to 1."""


@dataclasses.dataclass(frozen=True)
class Explanation:
    """The fault that explains the data best, and those that explain them nearly as well.

    Attributes:
        fault: name of the best.
        score: twice its log likelihood ratio against no fault.
        rivals: others within the margin, best first.
        margin: score by which the best must lead to be certain.
    """

    fault: str
    score: float
    rivals: tuple[str, ...]
    margin: float

    @property
    def ambiguous(self) -> bool:
        """Whether another fault explains the data nearly as well."""
        return bool(self.rivals)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        if self.ambiguous:
            return f"ambiguous: {' or '.join((self.fault, *self.rivals))}"
        return f"{self.fault} (score {self.score:.3g})"


def single_fault_scores(
    mean: Float[Array, "... size"], cov: Float[Array, "... dof dof"], count: int
) -> Float[Array, "... k"]:
    """Twice the log likelihood ratio of each fault alone against none, read off the estimate of all together.

    ```
    i = P_b^-1 b,   score_j = i_j^2 / (P_b^-1)_jj
    ```

    Exact for faults that do not change, of zero mean and uncorrelated before the data; a good guide while their walk is
    small. Unlike an estimate in its own sigmas it is right for faults that pass for one another: of four offsets of
    which three are observed, the one that alone explains the data stands out.

    Args:
        mean: estimated states, faults last, for any number of rows and runs.
        cov: their covariances, positive definite for the faults.
        count: how many states are faults.

    Source: Willsky and Jones (1976), IEEE Trans. Autom. Control 21(1):108-112, with the prior as ridge.

    Example:
        >>> single_fault_scores(jnp.array([2.0, 0.0]), jnp.diag(jnp.array([0.25, 1.0])), 2).tolist()
        [16.0, 0.0]
    """
    b, P = mean[..., -count:], cov[..., -count:, -count:]
    # Scaled to unit variances first, so that sizes of different units do not spoil the inverse.
    sigma = jnp.sqrt(jnp.diagonal(P, axis1=-2, axis2=-1))
    inverse = jnp.linalg.inv(P / (sigma[..., :, None] * sigma[..., None, :]))
    informed = jnp.einsum("...ij,...j->...i", inverse, b / sigma)
    return informed**2 / jnp.diagonal(inverse, axis1=-2, axis2=-1)


def explain(names: Sequence[str], scores: Float[Array, " k"], margin: float = MARGIN) -> Explanation:
    """The fault with the largest score, and those too near to be ruled out.

    Args:
        names: of the faults.
        scores: twice the log likelihood ratio of each against no fault: from `single_fault_scores`, or a bank's.
        margin: by how much the best must lead; twice the log of the odds.

    Raises:
        ShapeError: not one score per name, or none that is a number.
        ConfigError: a negative margin.

    Example:
        >>> explain(["offset_x", "loss_x", "offset_y"], np.array([40.0, 37.0, 2.0])).sentence
        'ambiguous: offset_x or loss_x'
    """
    values = np.asarray(scores, float)
    if values.shape != (len(names),):
        raise ShapeError(f"scores: expected shape ({len(names)},), got {values.shape}")
    if not margin >= 0:
        raise ConfigError(f"margin: expected at least 0, got {margin!r}")
    if np.isnan(values).all():
        raise ShapeError("scores: expected at least one number, got only NaN")
    order = [int(k) for k in np.argsort(-np.where(np.isnan(values), -np.inf, values), kind="stable")]
    best = order[0]
    rivals = tuple(names[k] for k in order[1:] if values[k] > values[best] - margin)
    return Explanation(names[best], float(values[best]), rivals, float(margin))
