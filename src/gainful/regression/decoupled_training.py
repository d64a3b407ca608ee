"""Training of a perceptron by a Kalman filter that neglects what groups of weights know of each other."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError, did_you_mean
from ..networks import MultilayerPerceptron
from .kalman_training import AbstractKalmanTraining

GROUPS = ("unit", "layer", "all")


class Blocks(eqx.Module):
    """Weights in groups, and the covariance of each.

    Attributes:
        weights: groups of one size together (groups, size).
        covs: of each (groups, size, size).
    """

    weights: tuple[Float[Array, "groups size"], ...]
    covs: tuple[Float[Array, "groups size size"], ...]


class DecoupledKalmanTraining(AbstractKalmanTraining):
    """The extended Kalman filter of a perceptron's weights, with a covariance for every group of them alone.

    ```
    S = R + sum_i H_i P_i H_i^T;   K_i = P_i H_i^T S^-1;   w_i <- w_i + K_i e;   P_i <- P_i - K_i H_i P_i + q I
    ```

    Groups share the error and nothing else, so that cost and memory grow with the square of a group and not of the network.

    Attributes:
        hidden: units of each hidden layer.
        groups: the weights into one "unit" and its bias, those of a "layer", or "all" of them.
        prior_variance: of every weight about its start.
        noise_variance: of the targets, in units of their variance.
        random_walk: variance that every weight gains per example.
        epochs: times through the examples, each in a new random order.

    Raises:
        ConfigError: an argument out of its range.

    Source: Puskorius and Feldkamp (1994), IEEE Trans. Neural Netw. 5(2):279-297.
    Reduces to: `KalmanTraining` whose covariance between groups is dropped after each example; to all of it for one group.

    Example:
        >>> u = np.linspace(-1.0, 1.0, 200)[:, None]
        >>> network, report = DecoupledKalmanTraining(hidden=(4,))(u, u**3, key=jax.random.key(0))
        >>> bool(report.after[0] < 1e-1 * report.before[0])
        True
    """

    hidden: tuple[int, ...] = eqx.field(static=True, default=(10,))
    groups: Literal["unit", "layer", "all"] = eqx.field(static=True, default="unit")
    prior_variance: float = 1.0
    noise_variance: float = 1e-3
    random_walk: float = 0.0
    epochs: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        if self.groups not in GROUPS:
            raise ConfigError(f"groups: {self.groups!r} is not known; {did_you_mean(str(self.groups), GROUPS)}")

    def start(self, network: MultilayerPerceptron) -> Blocks:
        weights = self._grouped(network)
        covs = (self.prior_variance * jnp.tile(jnp.eye(each.shape[1]), (len(each), 1, 1)) for each in weights)
        return Blocks(weights, tuple(covs))

    def learned(
        self, network: MultilayerPerceptron, known: Blocks, u: Array, y: Array
    ) -> tuple[Blocks, Bool[Array, ""]]:
        def said(weights: tuple[Array, ...]) -> Array:
            return self._with(network, weights)(u) / network.size

        error = y / network.size - said(known.weights)
        slopes = jax.jacrev(said)(known.weights)
        told = [jnp.einsum("mgs,gst->mgt", H, P) for H, P in zip(slopes, known.covs, strict=True)]
        S = sum(jnp.einsum("mgt,ngt->mn", HP, H) for HP, H in zip(told, slopes, strict=True))
        S = S + self.noise_variance * jnp.eye(len(y))
        inverse = jnp.linalg.inv(jnp.linalg.cholesky(S))
        whitened = [jnp.einsum("km,mgt->kgt", inverse, HP) for HP in told]
        move = inverse @ error
        weights = tuple(
            w + jnp.einsum("kgt,k->gt", each, move) for w, each in zip(known.weights, whitened, strict=True)
        )
        # P - W^T W, which is symmetric to the last bit.
        covs = tuple(
            P - jnp.einsum("kgs,kgt->gst", each, each) + self.random_walk * jnp.eye(P.shape[1])
            for P, each in zip(known.covs, whitened, strict=True)
        )
        positive = [jnp.all(jnp.diagonal(P, axis1=1, axis2=2) >= 0) for P in covs]
        finite = [jnp.all(jnp.isfinite(each)) for each in weights]
        return Blocks(weights, covs), jnp.all(jnp.stack(positive + finite))

    def trained(self, network: MultilayerPerceptron, known: Blocks) -> MultilayerPerceptron:
        return self._with(network, known.weights)

    def _grouped(self, network: MultilayerPerceptron) -> tuple[Array, ...]:
        layers = [
            jnp.concatenate([W, b[:, None]], axis=1) for W, b in zip(network.weights, network.biases, strict=True)
        ]
        if self.groups == "unit":
            return tuple(layers)
        flat = [layer.reshape(1, -1) for layer in layers]
        return tuple(flat) if self.groups == "layer" else (jnp.concatenate(flat, axis=1),)

    def _with(self, network: MultilayerPerceptron, weights: tuple[Array, ...]) -> MultilayerPerceptron:
        shapes = [(W.shape[0], W.shape[1] + 1) for W in network.weights]
        flat = jnp.concatenate([each.ravel() for each in weights])
        ends = np.cumsum([rows * columns for rows, columns in shapes])[:-1]
        layers = [each.reshape(shape) for each, shape in zip(jnp.split(flat, ends), shapes, strict=True)]
        return network.with_parameters((tuple(W[:, :-1] for W in layers), tuple(W[:, -1] for W in layers)))
