"""Noise that is not Gaussian, drawn on purpose: outliers, heavy tails, bursts and one-sided errors.

A law is told a standard deviation per channel, as `R` or `Q` would be, and an estimator usually knows no more than that
nominal part. What was drawn comes with each value's own variance, for the filter that knows all.
"""

import abc
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..errors import ConfigError


class Drawn(eqx.Module):
    """A stretch of noise.

    Attributes:
        values: the noise (T, m).
        variance: mean square of each value for one who knows which law it came from: an outlier's own variance (T, m).
    """

    values: Float[Array, "T m"]
    variance: Float[Array, "T m"]


class AbstractDisturbance(eqx.Module):
    """A law of white noise, but for bursts: pure functions of a key, so `vmap` over keys and numbers applies."""

    @abc.abstractmethod
    def realise(self, key: Array, steps: int, sigma: Float[Array, " m"]) -> Drawn:
        """Noise of a number of samples with nominal standard deviations `sigma`, and the variance of each value."""

    @abc.abstractmethod
    def mean_square(self, sigma: Float[Array, " m"]) -> Float[Array, " m"]:
        """`E e^2` over everything: the variance that a filter told of one Gaussian should use; infinite if there is none."""

    def draw(self, key: Array, steps: int, sigma: Float[Array, " m"]) -> Float[Array, "steps m"]:
        """Noise of a number of samples with nominal standard deviations `sigma`."""
        return self.realise(key, steps, sigma).values


class GaussianNoise(AbstractDisturbance):
    """`e ~ N(0, sigma^2)`: what filters expect."""

    def realise(self, key: Array, steps: int, sigma: Array) -> Drawn:
        sigma = jnp.asarray(sigma, float)
        values = sigma * jax.random.normal(key, (steps, sigma.shape[0]))
        return Drawn(values, jnp.broadcast_to(sigma**2, values.shape))

    def mean_square(self, sigma: Array) -> Array:
        return jnp.asarray(sigma, float) ** 2


class GaussianMixture(AbstractDisturbance):
    """`e ~ (1 - eps) N(0, sigma^2) + eps N(0, (ratio sigma)^2)`: a sensor with a share of gross errors.

    Attributes:
        probability: share `eps` of gross errors.
        ratio: their standard deviation in multiples of `sigma`.
        joint: whether all channels have them at the same samples; each on its own if not.

    Source: Tukey (1960), in Contributions to Probability and Statistics, 448-485.

    Example:
        >>> float(GaussianMixture().mean_square(jnp.ones(1))[0])
        10.9
    """

    probability: Array | float = 0.1
    ratio: Array | float = 10.0
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        _check_share(self.probability, "probability")
        _check_positive(self.ratio, "ratio")

    def realise(self, key: Array, steps: int, sigma: Array) -> Drawn:
        sigma = jnp.asarray(sigma, float)
        when, own = jax.random.split(key)
        gross = _events(when, self.probability, steps, sigma.shape[0], self.joint)
        return _scaled(own, sigma, jnp.where(gross, self.ratio, 1.0))

    def mean_square(self, sigma: Array) -> Array:
        return jnp.asarray(sigma, float) ** 2 * (1.0 + self.probability * (jnp.asarray(self.ratio) ** 2 - 1.0))


class StudentTNoise(AbstractDisturbance):
    """Student's t with scale `sigma`: `e = sigma n / sqrt(g)`, `n ~ N(0, 1)`, `g ~ chi2(dof) / dof`.

    Attributes:
        dof: degrees of freedom; the fewer, the heavier the tails. At most 2: no variance.
        joint: whether `g` is the same for all channels of a sample, a multivariate t; each its own if not.

    Reduces to: `GaussianNoise` for `dof -> inf`.
    """

    dof: Array | float = 3.0
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        _check_positive(self.dof, "dof")

    def realise(self, key: Array, steps: int, sigma: Array) -> Drawn:
        sigma = jnp.asarray(sigma, float)
        mixing, own = jax.random.split(key)
        half = 0.5 * jnp.asarray(self.dof, float)
        g = jax.random.gamma(mixing, half, (steps, 1 if self.joint else sigma.shape[0])) / half
        return _scaled(own, sigma, jax.lax.rsqrt(g))

    def mean_square(self, sigma: Array) -> Array:
        dof = jnp.asarray(self.dof, float)
        factor = jnp.where(dof > 2.0, dof / jnp.where(dof > 2.0, dof - 2.0, 1.0), jnp.inf)
        return jnp.asarray(sigma, float) ** 2 * factor


class ImpulseBursts(AbstractDisturbance):
    """Noise that is `ratio` times as strong for a few samples in a row: interference, a loose contact.

    A burst may start at any sample, also before the first and during another one, so that the share of disturbed samples
    is `1 - (1 - probability)^length` throughout.

    Attributes:
        probability: that a burst starts at a sample.
        length: samples it lasts.
        ratio: standard deviation during a burst in multiples of `sigma`.
        joint: whether all channels have their bursts together; each its own if not.

    Example:
        >>> round(float(ImpulseBursts().share), 4)
        0.0961
    """

    probability: Array | float = 0.02
    length: int = eqx.field(static=True, default=5)
    ratio: Array | float = 16.7
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        _check_share(self.probability, "probability")
        _check_positive(self.ratio, "ratio")
        if not isinstance(self.length, int) or self.length < 1:
            raise ConfigError(f"length: expected a whole number of samples of at least 1, got {self.length!r}")

    @property
    def share(self) -> Float[Array, ""]:
        """Of the samples that a burst disturbs."""
        return 1.0 - (1.0 - jnp.asarray(self.probability)) ** self.length

    def realise(self, key: Array, steps: int, sigma: Array) -> Drawn:
        sigma = jnp.asarray(sigma, float)
        when, own = jax.random.split(key)
        starts = _events(when, self.probability, steps + self.length - 1, sigma.shape[0], self.joint)
        during = jnp.stack([starts[k : k + steps] for k in range(self.length)]).any(axis=0)
        return _scaled(own, sigma, jnp.where(during, self.ratio, 1.0))

    def mean_square(self, sigma: Array) -> Array:
        return jnp.asarray(sigma, float) ** 2 * (1.0 + self.share * (jnp.asarray(self.ratio) ** 2 - 1.0))


class SkewedOutliers(AbstractDisturbance):
    """`e ~ (1 - eps) N(0, sigma^2) + eps |N(0, (ratio sigma)^2)|`: gross errors that all point one way.

    The mean is `eps ratio sigma sqrt(2 / pi)`, 0.80 sigma by default, so that no filter without a bias state is unbiased.

    Attributes:
        probability: share `eps` of gross errors.
        ratio: root mean square of a gross error in multiples of `sigma`; negative ones point down.
        joint: whether all channels have them at the same samples; each on its own if not.
    """

    probability: Array | float = 0.1
    ratio: Array | float = 10.0
    joint: bool = eqx.field(static=True, default=False)

    def __check_init__(self) -> None:
        _check_share(self.probability, "probability")

    def realise(self, key: Array, steps: int, sigma: Array) -> Drawn:
        sigma = jnp.asarray(sigma, float)
        when, own = jax.random.split(key)
        gross = _events(when, self.probability, steps, sigma.shape[0], self.joint)
        normal = jax.random.normal(own, (steps, sigma.shape[0]))
        values = sigma * jnp.where(gross, self.ratio * jnp.abs(normal), normal)
        return Drawn(values, (sigma * jnp.where(gross, self.ratio, 1.0)) ** 2)

    def mean_square(self, sigma: Array) -> Array:
        return jnp.asarray(sigma, float) ** 2 * (1.0 + self.probability * (jnp.asarray(self.ratio) ** 2 - 1.0))

    def mean(self, sigma: Float[Array, " m"]) -> Float[Array, " m"]:
        """`E e`."""
        return jnp.asarray(sigma, float) * self.probability * self.ratio * math.sqrt(2.0 / math.pi)


def _events(key: Array, probability: Array | float, steps: int, channels: int, joint: bool) -> Bool[Array, "steps _"]:
    """Where something happens: of one column if it happens to all channels alike."""
    return jax.random.bernoulli(key, probability, (steps, 1 if joint else channels))


def _scaled(key: Array, sigma: Float[Array, " m"], factor: Float[Array, "T _"]) -> Drawn:
    """Gaussian noise whose standard deviation is `factor sigma`, sample by sample."""
    spread = sigma * factor
    return Drawn(spread * jax.random.normal(key, spread.shape), spread**2)


def _check_share(value: Array | float, name: str) -> None:
    if isinstance(value, int | float) and not 0 <= value < 1:
        raise ConfigError(f"{name}: expected a number from 0 to below 1, got {value!r}")


def _check_positive(value: Array | float, name: str) -> None:
    if isinstance(value, int | float) and not value > 0:
        raise ConfigError(f"{name}: expected a number above 0, got {value!r}")
