"""The contract of a linearization."""

from __future__ import annotations

import abc
from collections.abc import Callable

import equinox as eqx
from jaxtyping import Array, Float

from ..estimates import AbstractEstimate, Affine
from ..spaces import AbstractSpace


class AbstractLinearization(eqx.Module):
    """Turns a function into an affine map near an estimate; exact where the function is affine."""

    @abc.abstractmethod
    def __call__(
        self,
        fn: Callable[[Float[Array, " in_size"]], Float[Array, " out_size"]],
        estimate: AbstractEstimate,
        out_space: AbstractSpace,
    ) -> Affine:
        """The map, with no model noise yet."""
