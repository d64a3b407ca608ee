"""Which faults can be told from a record, before it is made."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from ..diagnostics.observability import LEAST_INFORMATION, Observability, describe_directions
from ..errors import ConfigError, ShapeError
from ..estimates import AbstractEstimate, Gaussian
from ..filters import extended_kalman_filter
from ..models import AbstractModel, Instant
from ..running import Log, Result, make_log, run
from ..running.compiled import compiled_call
from .fault_free import moments_of
from .modelling import FaultModel


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two faults whose estimates go together so closely that one passes for the other.

    Attributes:
        names: of the two fault states.
        correlation: of their estimates at the last row.
        until: from when on they can be told apart [s]; infinite if never.
    """

    names: tuple[str, str]
    correlation: float
    until: float

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        both = " and ".join(self.names)
        if np.isinf(self.until):
            return f"{both} cannot be told apart (correlation {self.correlation:.3g})"
        return f"{both} ambiguous until t = {self.until:.4g} s"


@dataclasses.dataclass(frozen=True)
class Isolability:
    """What a record can tell of a model's faults if they are constant from the onset on.

    Attributes:
        names: of the fault states.
        information: rank, condition and unobserved directions of the faults, the plant's own states and noise being
            unknown, in units of the prior's standard deviations.
        t: times [s] (T,).
        sigma: smallest standard deviation with which each fault can be known at each time (T, k).
        correlation: of the estimates at the last row, 0 where a fault is known beforehand (k, k).
        pairs: faults that cannot be told apart, at the end or for a while.
        level: correlation from which on two faults count as ambiguous.
        result: the run that this was read off, with no walk in the faults; for `observability` of all states.
    """

    names: tuple[str, ...]
    information: Observability
    t: Float[np.ndarray, " T"]
    sigma: Float[np.ndarray, "T k"]
    correlation: Float[np.ndarray, "k k"]
    pairs: tuple[Pair, ...]
    level: float
    result: Result

    @property
    def isolable(self) -> bool:
        """Whether every fault is observed and none passes for another at the end."""
        whole = self.information.rank == len(self.information.names)
        return whole and all(np.isfinite(pair.until) for pair in self.pairs)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        information = self.information
        if information.rank < len(information.names):
            head = f"{information.rank} of {len(information.names)} faults observed; not observed: "
            head += ", ".join(information.unobserved)
        else:
            head = f"all {len(information.names)} faults observed (condition {information.condition:.2g})"
        head += f"; weakly observed: {', '.join(information.weak)}" if information.weak else ""
        return "; ".join([head, *(pair.sentence for pair in self.pairs)])


def nominal_log(model: AbstractModel, prior: AbstractEstimate, t: Any, u: Any = None) -> Log:
    """A record without noise along the prior's mean: what a run that is yet to be made would show.

    Args:
        model: of the plant.
        prior: where it starts.
        t: times [s] (T,).
        u: inputs (T, inputs).
    """
    moments = moments_of(model, t, u)
    (states, y), _ = compiled_call(_carry_forward, (model,), prior.mean, moments)
    truth = {name: np.asarray(states[:, i]) for i, name in enumerate(model.space.names)}
    return make_log(model, np.asarray(moments.t), np.asarray(y), np.asarray(moments.u), truth=truth)


def _carry_forward(fixed: tuple[AbstractModel], start: Array, moments: Instant) -> tuple[Array, Array]:
    (model,) = fixed

    def step(x: Array, when: Instant) -> tuple[Array, tuple[Array, Array]]:
        x = model.transition(x, when)
        return x, (x, model.observe(x, when))

    return jax.lax.scan(step, start, moments)[1]


def isolability(
    model: FaultModel,
    prior: AbstractEstimate,
    log: Log,
    *,
    onset: float | None = None,
    level: float = 0.95,
    least: float = LEAST_INFORMATION,
) -> Isolability:
    """Which faults a record can tell, how well, and which of them pass for one another.

    The covariance of a filter that takes the faults for constants is the best that can be known of them:

    ```
    D (P_k^-1 - P_0^-1) D = V diag(s) V^T over the faults,   D = diag(prior sigma)
    ```

    Along column `i` of `V` the record divides the prior variance by `1 + s_i`; a direction counts as observed where
    `s_i` exceeds `least`. Two faults are ambiguous while their estimates are correlated by `level` or more.

    Args:
        model: with faults.
        prior: of its whole state; the faults' part is their size to be told, for instance `extend_prior(...)`.
        log: a record, or `nominal_log` of a run that is yet to be made.
        onset: when the faults begin [s]; until then they are known to be absent. With the prior by default.
        level: correlation from which on two faults count as ambiguous.
        least: information, in units of the prior's, a direction must have to count as observed.

    Raises:
        ConfigError: a level outside (0, 1), or an onset without rows before and after it.
        ShapeError: a model without faults.

    Source: Ham and Brown (1983), IEEE Trans. Aerosp. Electron. Syst. 19(2):269-273: observability read off the covariance.
    Differs: of the faults alone, relative to what was known of them before.

    Example:
        >>> import numpy as np, gainful as gf
        >>> from gainful.faults import extend_prior, loss_of_effectiveness, with_faults
        >>> plant = gf.linear_model([[1.0]], [[1.0]], B=[[0.1]], Q=1e-4, R=0.01, inputs=["wheel"])
        >>> model = with_faults(plant, [loss_of_effectiveness("wheel", sigma=0.5)])
        >>> prior = extend_prior(model, gf.make_prior(plant, [0.0], [1.0]))
        >>> still = nominal_log(model, prior, np.arange(50.0), np.zeros((50, 1)))
        >>> isolability(model, prior, still).sentence
        '0 of 1 faults observed; not observed: loss_wheel'
    """
    if not isinstance(model, FaultModel):
        raise ShapeError(f"model: expected FaultModel, got {type(model).__name__}; make one with with_faults")
    if not 0 < level < 1:
        raise ConfigError(f"level: expected a correlation between 0 and 1, got {level!r}")
    count, estimator, quiet = len(model.fault_names), extended_kalman_filter(square_root=True), model.without_walk()
    if onset is not None:
        after = log.t > onset
        if after.all() or not after.any():
            raise ConfigError(f"onset: expected a time within {log.t[0]:.9g} to {log.t[-1]:.9g} s, got {onset!r}")
        known = Gaussian.start(prior.mean, _cut(prior.cov, count), prior.space)
        last = run(estimator, quiet, known, _rows(log, ~after)).estimates
        mean, cov = (jnp.asarray(values[-1]) for values in (last.mean, jax.vmap(lambda e: e.cov)(last)))
        prior = Gaussian.start(mean, cov + prior.cov - _cut(prior.cov, count), prior.space)
        log = _rows(log, after)
    result = run(estimator, quiet, prior, log)
    before = np.asarray(prior.cov)[-count:, -count:]
    covs = result.cov[:, -count:, -count:]
    free = np.diagonal(before) > 0
    names = tuple(name for name, uncertain in zip(model.fault_names, free, strict=True) if uncertain)
    gramian = _information(before[np.ix_(free, free)], covs[-1][np.ix_(free, free)])
    correlations = _correlations(covs)
    pairs = _pairs(model.fault_names, log.t, correlations, level)
    sigma = np.sqrt(np.maximum(np.diagonal(covs, axis1=1, axis2=2), 0.0))
    found = describe_directions(gramian, names, least)
    return Isolability(model.fault_names, found, log.t, sigma, correlations[-1], pairs, level, result)


def _cut(cov: Array, count: int) -> Array:
    """A covariance with the last states known exactly."""
    kept = jnp.arange(cov.shape[0]) < cov.shape[0] - count
    return jnp.where(kept[:, None] & kept[None, :], cov, 0.0)


def _rows(log: Log, rows: np.ndarray) -> Log:
    """Some rows of a record."""
    inserted = None if log.inserted is None else log.inserted[rows]
    truth = {name: values[rows] for name, values in log.truth.items()}
    return Log(log.t[rows], log.dt[rows], log.u[rows], log.y[rows], log.seen[rows], truth, inserted)


def _information(before: Float[np.ndarray, "k k"], after: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    """What was learned, in units of what was known: the inverse covariance's growth times the prior sigmas."""
    if not before.size:
        return before
    scale = np.sqrt(np.diagonal(before))
    before, after = (cov / np.outer(scale, scale) for cov in (before, after))
    # Relative to each other: a difference of inverses would drown small information in the rounding of the large.
    left, directions = scipy.linalg.eigh(after, before)
    grown = 1 / np.maximum(left, np.finfo(float).eps) - 1
    return directions @ np.diag(np.maximum(grown, 0.0)) @ directions.T


def _correlations(covs: Float[np.ndarray, "T k k"]) -> Float[np.ndarray, "T k k"]:
    """Correlations of each row, 0 with what is known exactly."""
    sigma = np.sqrt(np.maximum(np.diagonal(covs, axis1=1, axis2=2), 0.0))
    both = sigma[:, :, None] * sigma[:, None, :]
    return np.where(both > 0, covs / np.where(both > 0, both, 1.0), 0.0)


def _pairs(
    names: tuple[str, ...], t: Float[np.ndarray, " T"], correlations: Float[np.ndarray, "T k k"], level: float
) -> tuple[Pair, ...]:
    """The pairs that are ambiguous at some time, those that remain so first."""
    found = []
    for i, j in itertools.combinations(range(len(names)), 2):
        rows = np.flatnonzero(np.abs(correlations[:, i, j]) >= level)
        if rows.size:
            until = float(t[rows[-1] + 1]) if rows[-1] + 1 < len(t) else float("inf")
            found.append(Pair((names[i], names[j]), float(correlations[-1, i, j]), until))
    return tuple(sorted(found, key=lambda pair: -pair.until))
