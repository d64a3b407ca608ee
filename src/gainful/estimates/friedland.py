"""Friedland's separate-bias form, optimal for constant biases only."""

from __future__ import annotations

from typing import Self

from ..linalg import congruence, product, root_and_inverse, symmetrize
from .affine import Affine
from .two_stage import TwoStage


class Friedland(TwoStage):
    """The two-stage estimate whose state stage knows nothing of the biases' process noise.

    ```
    push       Pb' = G Pb G^T + Qb;  V' = (F11 V + F12) G^-1;  P~' = F11 P~ F11^T + Qx
    ```

    Published for constant biases, where it is optimal; for biases that walk it is not, and its covariance is not the
    true one. It is here to be compared with. The biases may not depend on the state.

    Source: Friedland (1969), IEEE Trans. Autom. Control 14(4):359-367; Ignagni (1981), 26(6):1248-1250.
    Reduces to: `TwoStage` for biases without process noise.
    """

    def push(self, affine: Affine) -> Self:
        n, m = self.base_cov.shape[0], affine.outer.dof - affine.outer.added
        state, across, along = affine.matrix[:m, :n], affine.matrix[:m, n:], affine.matrix[m:, n:]
        noise = affine.covariance()
        # G^-1 = (G^T G)^-1 G^T, which needs no pivoting.
        _, inverse, _ = root_and_inverse(product(along.T, along))
        coupling = product(product(state, self.coupling) + across, product(inverse.T, product(inverse, along.T)))
        stages = (
            symmetrize(congruence(state, self.base_cov) + noise[:m, :m]),
            symmetrize(congruence(along, self.bias_cov) + noise[m:, m:]),
            coupling,
        )
        # The constructor is that of TwoStage, which type checkers do not see.
        return type(self)(affine.predict(self.mean), *stages, affine.outer)  # type: ignore[call-arg]
