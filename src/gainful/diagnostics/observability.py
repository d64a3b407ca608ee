"""What the record can tell about the state at its start, and what it cannot."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from ..errors import ConfigError, NumericalError
from ..estimates import Gaussian
from ..linalg import root_and_inverse
from ..linearization import Taylor
from ..models import AbstractModel, Sample
from ..running import Result, samples_of
from ..running.compiled import compiled_call
from ..spaces import AbstractSpace

LEAST_INFORMATION = 0.1
"""A direction with less information, in units of the prior's, counts as unobserved: a tenth is 9 % of the variance."""


@dataclasses.dataclass(frozen=True)
class Observability:
    """The observability Gramian in units of the prior, and the directions it does not reach.

    Attributes:
        names: states examined, those the prior is uncertain of.
        gramian: information about them in units of the prior's standard deviations (n, n).
        singular_values: of the Gramian, falling; along each direction the data alone divide the prior variance by
            1 plus its value (n,).
        rank: how many are above `least`.
        condition: largest over smallest, infinite where the smallest is zero.
        unobserved: directions at or below `least`, as combinations of states, each counted in its prior sigma.
        weak: directions above `least` whose prior variance is not even halved.
        least: the information a direction must have to count as observed.
    """

    names: tuple[str, ...]
    gramian: Float[np.ndarray, "n n"]
    singular_values: Float[np.ndarray, " n"]
    rank: int
    condition: float
    unobserved: tuple[str, ...]
    weak: tuple[str, ...]
    least: float

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        total = len(self.names)
        if not total:
            return "nothing to observe: the prior is certain of every state"
        if self.rank == total:
            text = f"all {total} states observed (condition {self.condition:.2g})"
        else:
            text = f"{self.rank} of {total} directions observed; not observed: {', '.join(self.unobserved)}"
        return text + (f"; weakly observed: {', '.join(self.weak)}" if self.weak else "")


def observability(
    result: Result, window: tuple[float, float] | None = None, least: float = LEAST_INFORMATION
) -> Observability:
    """Which directions of the state the record tells about, for the model linearised along the estimates.

    ```
    W = sum_k Phi_k^T H_k^T R_k^-1 H_k Phi_k,  Phi_k = F_k ... F_1;   D W D = V diag(s) V^T,  D = diag(prior sigma)
    ```

    Rows of `H` that were not measured are zero. Without process noise, the record divides the prior variance along
    column `i` of `V` by `1 + s_i`, whatever the units; a direction counts as observed where `s_i` exceeds `least`.

    Args:
        result: of a run.
        window: first and last time [s] to look at; the whole record, from the prior on, by default.
        least: information, in units of the prior's, a direction must have to count as observed.

    Raises:
        ConfigError: a window without rows.
        NumericalError: the Gramian overflows, as an unstable model's does over a long record.

    Source: Gelb (1974), Applied Optimal Estimation, 3.5; Krener and Ide (2009), Proc. 48th IEEE CDC, 6401-6406.
    Differs: scaled by the prior, as Ham and Brown (1983), IEEE Trans. Aerosp. Electron. Syst. 19(2):269-273, scale P.

    Example:
        >>> import jax, numpy as np, gainful as gf
        >>> F, H = [[1.0, 0.1], [0.0, 1.0]], [[0.0, 1.0]]
        >>> model = gf.linear_model(F, H, Q=[1e-6, 1e-4], R=0.01, states={"position": "m", "velocity": "m/s"})
        >>> prior = gf.make_prior(model, [0.0, 0.0], [1.0, 1.0])
        >>> log = gf.draw_log(model, prior, np.arange(0.0, 5.0, 0.1), key=jax.random.key(0))
        >>> observability(gf.run(gf.kalman_filter(), model, prior, log)).sentence
        '1 of 2 directions observed; not observed: position'
    """
    rows = np.arange(len(result.t))
    if window is not None:
        rows = np.flatnonzero((result.t >= window[0]) & (result.t <= window[1]))
        if not rows.size:
            first, last = result.t[0], result.t[-1]
            raise ConfigError(f"window: expected times within {first:.9g} to {last:.9g} s, got {window!r}")
    before = np.concatenate([np.asarray(result.prior.mean)[None], result.mean[:-1]])
    samples = samples_of(result.log, result.prior.mean.dtype)
    cut = jax.tree.map(lambda values: jnp.asarray(values[rows]), (samples, before, result.mean))
    scale = np.sqrt(np.maximum(np.diagonal(np.asarray(result.prior.cov)), 0.0))
    summed, _ = compiled_call(_gramian, (result.model, result.model.space), *cut, jnp.asarray(scale))
    gramian = np.asarray(summed)
    if not np.isfinite(gramian).all():
        raise NumericalError("the observability Gramian is not finite: the model diverges from its start; use a window")
    free = scale > 0
    names = tuple(name for name, uncertain in zip(result.model.space.tangent_names, free, strict=True) if uncertain)
    return describe_directions(gramian[np.ix_(free, free)], names, least)


def _gramian(
    parts: tuple[AbstractModel, AbstractSpace], samples: Sample, before: Array, after: Array, scale: Array
) -> Float[Array, "n n"]:
    """The Gramian along stacked estimates before and after each row, times the prior's standard deviations."""
    (model, space), linearize = parts, Taylor()
    exact = jnp.zeros((space.dof, space.dof), scale.dtype)

    def step(carry: tuple[Array, Array], row: tuple[Sample, Array, Array]) -> tuple[tuple[Array, Array], None]:
        moved, total = carry
        sample, last, here = row
        when = sample.when
        motion = linearize(lambda x: model.transition(x, when), Gaussian(last, exact, space), space)
        moved = jnp.where(when.dt > 0, motion.matrix @ moved, moved)
        reading = linearize(lambda x: model.observe(x, when), Gaussian(here, exact, space), model.output)
        reading = reading.plus_noise(model.measurement_noise(here, when)).masked(sample.seen)
        effect = reading.matrix @ moved
        # A sensor without noise would be infinitely informative; a million times the prior's sigma will do.
        noise = reading.noise + jnp.diag(1e-12 * jnp.sum(effect**2, axis=1))
        informed = root_and_inverse(noise)[1] @ effect
        return (moved, total + informed.T @ informed), None

    return jax.lax.scan(step, (jnp.diag(scale), exact), (samples, before, after))[0][1]


def describe_directions(gramian: Float[np.ndarray, "n n"], names: tuple[str, ...], least: float) -> Observability:
    """What a Gramian in units of the prior says of some states.

    Args:
        gramian: information about them in units of the prior's standard deviations (n, n).
        names: of the states.
        least: information a direction must have to count as observed.
    """
    if not names:
        return Observability(names, gramian, np.zeros(0), 0, 1.0, (), (), least)
    values, vectors = np.linalg.eigh(gramian)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    # Below rounding of the largest, a value is zero.
    values = np.where(values > len(values) * np.finfo(gramian.dtype).eps * values[0], values, 0.0)
    rank = int((values > least).sum())
    condition = float(values[0] / values[-1]) if values[-1] > 0 else float("inf")
    weak = tuple(_words(vectors[:, i], names) for i in range(rank) if values[i] < 1)
    unobserved = tuple(_words(direction, names) for direction in _plainest(vectors[:, rank:]))
    return Observability(names, gramian, values, rank, condition, unobserved, weak, least)


def _plainest(basis: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "k n"]:
    """Directions that span the same plane with few states in each: the basis is arbitrary, so make it readable."""
    k = basis.shape[1]
    if k < 2:
        return basis.T
    _, triangle, order = scipy.linalg.qr(basis.T, pivoting=True)  # type: ignore[misc]  # three with pivoting
    echelon = np.empty_like(triangle)
    echelon[:, order] = np.linalg.solve(triangle[:, :k], triangle)
    return echelon / np.linalg.norm(echelon, axis=1, keepdims=True)


def _words(direction: Float[np.ndarray, " n"], names: tuple[str, ...]) -> str:
    """A direction as a sum of states, such as "0.71 x - 0.71 bias_y"."""
    large = np.abs(direction) > 0.2 * np.abs(direction).max()
    if large.sum() == 1:
        return names[int(large.argmax())]
    sign = np.sign(direction[large][0])
    terms = [(sign * value, name) for value, name, shown in zip(direction, names, large, strict=True) if shown]
    text = " ".join(f"{'+' if value > 0 else '-'} {abs(value):.2g} {name}" for value, name in terms)
    return text.removeprefix("+ ")
