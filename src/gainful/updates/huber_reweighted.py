"""Huber's cost minimised step by step."""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float

from .influence import chosen_threshold, huber_weight
from .reweighted import AbstractReweighted, Residuals, check_iterations


class HuberReweighted(AbstractReweighted):
    """Minimises Huber's cost of measurement and prediction together, by least squares reweighted.

    ```
    min over d of  sum rho(L^-1 d) + sum rho(R^-1/2 (r - H d)),  P = L L^T;  weights min(1, k / |.|)
    ```

    A prediction that is far off loses weight like a measurement does.

    Attributes:
        contamination: share of measurements that may be outliers; sets the threshold by `huber_threshold`.
        threshold: in sigmas, in place of `contamination`.
        iterations: how often the weights are found.

    Source: Karlgaard and Schaub (2007), J. Guid. Control Dyn. 30(3):885-891; Boncelet and Dickinson (1983), Proc. 22nd CDC.
    Reduces to: `Exact` for no contamination.
    """

    contamination: float = eqx.field(static=True, default=0.1)
    threshold: float | None = None
    iterations: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        chosen_threshold(self.contamination, self.threshold)
        check_iterations(self.iterations)

    def weigh(self, residuals: Residuals) -> tuple[Float[Array, " m"], Float[Array, " dof"]]:
        threshold = chosen_threshold(self.contamination, self.threshold)
        return huber_weight(residuals.measured, threshold), huber_weight(residuals.moved, threshold)
