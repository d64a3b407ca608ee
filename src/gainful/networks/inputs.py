"""What examples tell of the inputs: which of them vary, where, and whether they say different things."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_STILL = 1e-9
"""Range, relative to one plus the size of the median, below which an input does not vary."""

_ALIKE = 1e-9
"""Singular values of the standardised inputs below this share of the largest add no direction."""


def varying(inputs: Float[np.ndarray, "N d"]) -> tuple[int, ...]:
    """The inputs that vary, such as an innovation, unlike the gain of a steady filter."""
    spread = inputs.max(axis=0) - inputs.min(axis=0)
    return tuple(np.flatnonzero(spread > _STILL * (1 + np.abs(np.median(inputs, axis=0)))).tolist())


def rank_of(inputs: Float[np.ndarray, "N d"], columns: tuple[int, ...]) -> int:
    """Independent directions among some inputs that vary: fewer than there are where one repeats another."""
    if not columns:
        return 0
    chosen = inputs[:, list(columns)]
    values = np.linalg.svd((chosen - chosen.mean(axis=0)) / chosen.std(axis=0), compute_uv=False)
    return int((values > _ALIKE * values[0]).sum())


def input_warnings(inputs: Float[np.ndarray, "N d"], columns: tuple[int, ...]) -> tuple[int, tuple[str, ...]]:
    """The rank of those of some inputs that vary, and what to say of it."""
    moving = tuple(column for column in columns if column in varying(inputs))
    rank = rank_of(inputs, moving)
    if not moving:
        return 0, ("no input varies: the network is a constant",)
    if rank < len(moving):
        said = f"{len(moving)} inputs vary, but in {rank} direction{'s' * (rank != 1)} only: some repeat others"
        return rank, (said,)
    return rank, ()
