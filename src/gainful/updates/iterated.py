"""Linearising again where the update has led."""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..estimates import AbstractEstimate
from ..models import AbstractModel
from .base import AbstractUpdate, Likelihood, Update
from .exact import Exact


class Iterated(AbstractUpdate):
    """Repeats an update with the measurement linearised at the last posterior; the prior stays, so nothing counts twice.

    With `Taylor` this is Gauss-Newton on the posterior density (the iterated extended filter), with `SigmaPoints` the
    iterated posterior linearization filter.

    Attributes:
        inner: the update repeated.
        iterations: how often the measurement is linearised, at least 1.

    Source: Bell and Cathey (1993), IEEE Trans. Autom. Control 38(2):294-297; Garcia-Fernandez et al. (2015), IEEE
        Trans. Signal Process. 63(20):5561-5573.
    Reduces to: `inner` for affine measurements, or with one iteration.
    """

    inner: AbstractUpdate = Exact()
    iterations: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        if not isinstance(self.iterations, int) or self.iterations < 1:
            raise ConfigError(f"iterations: expected a whole number of at least 1, got {self.iterations!r}")

    def init(self, model: AbstractModel) -> object:
        return self.inner.init(model)

    def added(
        self, carry: object, prior: AbstractEstimate, process: Float[Array, "dof dof"]
    ) -> Float[Array, "dof dof"] | None:
        return self.inner.added(carry, prior, process)

    def reported(self, carry: object, estimate: AbstractEstimate) -> AbstractEstimate:
        return self.inner.reported(carry, estimate)

    def __call__(
        self, carry: object, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[object, Update]:
        memory, update = self.inner(carry, prior, likelihood, y)
        first = update.innovation
        for _ in range(self.iterations - 1):
            memory, update = self.inner(carry, prior, likelihood.linearised_around(update.posterior), y)
        # Consistency is judged against the prediction, which is the first pass.
        return memory, eqx.tree_at(lambda part: part.innovation, update, first)
