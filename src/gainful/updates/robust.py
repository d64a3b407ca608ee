"""Measurements with gross errors: the whitened innovation counts only up to a threshold."""

from __future__ import annotations

import math
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import ConfigError, did_you_mean
from ..estimates import AbstractEstimate, Affine
from ..estimates.base import residual_of
from ..linalg import chi_square_quantile, congruence, product, whitening_root
from ..linalg.whitening import Whitening, check_whitening
from ..models import AbstractModel
from ..spaces import Euclidean
from .base import AbstractUpdate, Likelihood, Update
from .influence import chosen_threshold, huber_fisher_information, huber_weight

FORMS = ("indicator", "expectation")


class MasreliezMartin(AbstractUpdate):
    """Huber's function of the innovation, whitened as a whole: an outlier pulls no further than the threshold.

    ```
    v = T r with T S T^T = I;  K = P H^T T^T
    x <- x [+] K psi(v);  P <- P - K Psi K^T;  psi(v) = clip(v, -k, k)
    Psi = diag(|v_i| <= k) ("indicator") or E[psi'] I ("expectation")
    ```

    With "indicator" the covariance does not shrink along a clipped component, so that the gain recovers when it was not
    outliers that clipped it but a change of the plant; with "expectation" it shrinks as much as it would on average.

    Attributes:
        contamination: share of measurements that may be outliers; sets the threshold by `huber_threshold`.
        threshold: in sigmas, in place of `contamination`; of the length of `v` if `joint`.
        covariance: "indicator" or "expectation".
        whitening: which root of the inverse innovation covariance, see `whitening_root`.
        joint: whether all components are shortened together, for sensors that fail together.

    Source: Masreliez and Martin (1977), IEEE Trans. Autom. Control 22(3):361-371; Kessy et al. (2018) for the root.
    Differs: covariance in Joseph form with noise added where a component is clipped, so that it holds in all coordinates.
    Reduces to: `Exact` for no contamination.
    """

    contamination: float = eqx.field(static=True, default=0.1)
    threshold: float | None = None
    covariance: Literal["indicator", "expectation"] = eqx.field(static=True, default="indicator")
    whitening: Whitening = eqx.field(static=True, default="zca-cor")
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        chosen_threshold(self.contamination, self.threshold)
        check_whitening(self.whitening)
        if self.covariance not in FORMS:
            raise ConfigError(
                f"covariance: {self.covariance!r} is not known; {did_you_mean(str(self.covariance), FORMS)}"
            )
        if self.joint and self.covariance != "indicator":
            raise ConfigError('joint: expected covariance = "indicator" with it, got "expectation"')

    def init(self, model: AbstractModel) -> None:
        return None

    def __call__(
        self, carry: None, prior: AbstractEstimate, likelihood: Likelihood, y: Float[Array, " output_size"]
    ) -> tuple[None, Update]:
        affine = likelihood.affine(prior)
        _, innovation = prior.condition(affine, y, likelihood.seen)
        whiten = whitening_root(innovation.cov, self.whitening)
        v = product(whiten, innovation.residual[:, None])[:, 0]
        weight, slope = self._influence(v, likelihood.seen)
        # The same posterior as an exact update whose gain and noise are scaled: mean K psi(v), covariance P - K Psi K^T.
        share = jnp.where(slope > 0, slope, 1.0)
        noise = (2.0 * share - share**2 - slope) / share**2
        white = _whitened(affine, prior, whiten).plus_noise(jnp.diag(noise))
        gain = product(prior.cov, white.matrix.T) * share
        posterior, _ = prior.condition(white, weight * v / share, likelihood.seen, gain=gain)
        postfit = residual_of(affine, posterior.mean, y, likelihood.seen)
        counted = jnp.where(likelihood.seen, weight, 0.0).astype(prior.mean.dtype)
        return carry, Update(prior, posterior, innovation, affine, postfit, counted)

    def _influence(self, v: Float[Array, " m"], seen: Array) -> tuple[Float[Array, " m"], Float[Array, " m"]]:
        """`psi(v) / v` and `Psi` of each whitened component."""
        threshold = chosen_threshold(self.contamination, self.threshold)
        if self.joint:
            if self.threshold is None:
                share = math.erf(threshold / math.sqrt(2.0))
                threshold = jnp.asarray(chi_square_quantile(share, len(v)))[jnp.sum(seen)] ** 0.5
            length = jnp.sqrt(jnp.sum(v**2))
            weight = jnp.broadcast_to(huber_weight(length, threshold), v.shape)
        else:
            weight = huber_weight(v, threshold)
        if self.covariance == "indicator":
            return weight, jnp.where(weight < 1.0, 0.0, 1.0).astype(v.dtype)
        return weight, jnp.broadcast_to(huber_fisher_information(threshold), v.shape).astype(v.dtype)


def _whitened(affine: Affine, prior: AbstractEstimate, whiten: Float[Array, "m m"]) -> Affine:
    """The map from a deviation of the prior to the whitened innovation that it explains."""
    m = len(whiten)
    return Affine(
        jnp.zeros(m, whiten.dtype),
        product(whiten, affine.matrix),
        prior.mean,
        congruence(whiten, affine.noise),
        product(whiten, affine.error),
        product(whiten, affine.deficit),
        affine.inner,
        Euclidean(tuple(f"v{i}" for i in range(m))),
    )
