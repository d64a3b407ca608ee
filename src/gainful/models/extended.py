"""What models that carry further states have in common."""

from collections.abc import Iterator
from typing import Self

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from .base import AbstractModel


def layers(model: AbstractModel) -> Iterator[AbstractModel]:
    """The model, the one that it extends, and so on."""
    yield model
    if isinstance(model, AbstractExtendedModel):
        yield from layers(model.base)


class AbstractExtendedModel(AbstractModel):
    """A model whose state ends with further ones; what they do not concern is asked of the model it extends.

    Attributes:
        base: the model it extends.
    """

    base: eqx.AbstractVar[AbstractModel]

    @property
    def sensors(self) -> tuple[tuple[str, int], ...]:
        return self.base.sensors

    @property
    def takes_dt(self) -> bool:
        return self.base.takes_dt

    @property
    def noise_takes_dt(self) -> bool:
        return self.base.noise_takes_dt

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        return self.base.cautions(x[:, : self.base.space.size])

    def with_parameters(self, values: dict[str, Array]) -> Self:
        base = self.base.with_parameters(values)
        return eqx.tree_at(lambda model: (model.base, model.parameters), self, (base, self.parameters | values))
