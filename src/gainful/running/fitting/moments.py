"""Moments: the noise that explains how the innovations of a fixed gain are correlated in time."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
import scipy.optimize
from jaxtyping import Array, Float

from ...errors import ConfigError
from ...linalg import stationary_gain
from ...models import AbstractModel, Instant, Sample
from ..compiled import compiled_call
from .entries import TypicalNoise
from .problem import Problem
from .records import Record
from .search import Search

LAGS = 15
"""Autocovariances that are matched."""

FORGOTTEN = 0.02
"""Share of the start that is left in the innovations counted first."""


def by_moments(problem: Problem, typical: TypicalNoise, bounds: tuple[float, float]) -> Search:
    """The factors whose innovations, under the stationary gain of the noise at the start, would be correlated as they are.

    ```
    C_0 = H P H^T + R,  C_j = H A^j P H^T - H A^(j-1) F K R,  A = F (I - K H),  P = A P A^T + Q + F K R K^T F^T
    ```

    All are linear in the variances, which least squares finds between bounds. Quick, without iterations, and a good start; less
    precise than the likelihood.

    Raises:
        ConfigError: a model that is not linear with constant matrices, steps that vary, missing readings, or a gain that is
            never stationary or never forgets.

    Source: Odelson, Rajamani and Rawlings (2006), Automatica 42(2):303-308.
    Differs: variances by name only; lags weighted alike, outputs by their own size.
    """
    F, H = _matrices(problem, typical)
    K = stationary_gain(F, H, typical.process, typical.measurement)
    if K is None:
        raise ConfigError('method: "moments" needs a gain that becomes stationary; use "ml"')
    A = F @ (np.eye(len(F)) - K @ H)
    radius = float(np.abs(np.linalg.eigvals(A)).max())
    if not radius < 1 - 1e-6:
        raise ConfigError(
            f'method: "moments" needs a filter that forgets its start, got one with a slowest mode of {radius:.6g} per step; '
            'use "ml"'
        )
    wait = int(np.ceil(np.log(FORGOTTEN) / np.log(max(radius, 1e-12))))
    found = _autocovariances(problem, K, wait)
    size = np.sqrt(np.diag(found[0]))
    columns = [_column(problem, typical, index, (F, H, K, A)) for index in range(len(problem.entries))]
    unfitted = _column(problem, typical, None, (F, H, K, A))
    scale = 1.0 / np.outer(size, size)
    design = np.stack([(each * scale).ravel() for each in columns], axis=1)
    target = ((found - unfitted) * scale).ravel()
    least, most = np.exp(2 * np.array(bounds))
    solved = scipy.optimize.lsq_linear(design, target, bounds=(least, most))
    return Search(0.5 * np.log(solved.x), int(solved.nit), bool(solved.success), (float(solved.cost),), solved.message)


def _matrices(problem: Problem, typical: TypicalNoise) -> tuple[np.ndarray, np.ndarray]:
    """F and H, the same at the first record's start, middle and end."""
    model, record = problem.model, problem.records[0]
    if model.space.size != model.space.dof or model.output.size != model.output.dof:
        raise ConfigError('method: "moments" needs a linear model, got one with quaternions; use "ml"')
    for each in problem.records:
        steps = each.log.dt[each.log.dt > 0]
        if steps.size and np.ptp(steps) > 1e-6 * typical.step:
            raise ConfigError('method: "moments" needs equal steps, got some that vary; use "ml"')
        if (each.fitted & ~each.samples.seen.all(axis=1)).any() or _gaps(each):
            raise ConfigError('method: "moments" needs a record without missing readings; use "ml"')
    dtype = record.prior.mean.dtype
    log, mean = record.log, np.asarray(record.prior.mean)
    pairs = []
    for row, shift in ((0, 0.0), (len(log) // 2, 1.0), (len(log) - 1, -0.5)):
        when = Instant(*(jnp.asarray(v, dtype) for v in (log.t[row], typical.step, log.u[row])))
        x = jnp.asarray(mean + shift, dtype)
        pairs.append([np.asarray(each) for each in compiled_call(_slopes, model, x, when)[0]])
    F, H = pairs[0]
    for other in pairs[1:]:
        if not all(np.allclose(a, b, rtol=1e-9, atol=1e-12) for a, b in zip(other, (F, H), strict=True)):
            raise ConfigError(
                'method: "moments" needs a linear model with constant matrices, got slopes that vary; use "ml"'
            )
    return F, H


def _gaps(record: Record) -> bool:
    """Whether rows between the first and the last fitted one were not measured."""
    rows = np.flatnonzero(record.fitted)
    return bool(rows.size and (~record.samples.seen[rows[0] : rows[-1] + 1].all(axis=1)).any())


def _slopes(model: AbstractModel, x: Array, when: Instant) -> tuple[Array, Array]:
    return jax.jacfwd(lambda at: model.transition(at, when))(x), jax.jacfwd(lambda at: model.observe(at, when))(x)


def _column(
    problem: Problem, typical: TypicalNoise, index: int | None, matrices: tuple[np.ndarray, ...]
) -> Float[np.ndarray, "lags m m"]:
    """Autocovariances that an entry alone would cause; those of all noise outside of entries for None."""
    F, H, K, A = matrices
    blocks = {}
    for kind in ("process", "measurement"):
        cov, names = typical.block(kind, problem.model)  # type: ignore[arg-type]  # one of the two kinds
        entries = [each for each in problem.entries if each.kind == kind]
        if index is None:
            inside = np.isin(names, [name for each in entries for name in each.names])
            kept = ~inside
        else:
            own = problem.entries[index]
            kept = np.isin(names, own.names if own.kind == kind else ())
        blocks[kind] = np.where(kept[:, None] & kept[None, :], cov, 0.0)
    Q, R = blocks["process"], blocks["measurement"]
    gain = F @ K
    P = scipy.linalg.solve_discrete_lyapunov(A, Q + gain @ R @ gain.T)
    out, power = [H @ P @ H.T + R], np.eye(len(F))
    for _ in range(1, LAGS):
        out.append(H @ power @ (A @ P @ H.T - gain @ R))
        power = power @ A
    return np.array(out)


def _autocovariances(problem: Problem, K: np.ndarray, wait: int) -> Float[np.ndarray, "lags m m"]:
    """Of the innovations of the fixed gain, pooled over the records, the start left out."""
    sums, counts = 0.0, np.zeros(LAGS)
    for record in problem.records:
        residuals, _ = compiled_call(_innovations, problem.model, jnp.asarray(K), record.prior.mean, record.samples)
        rows = np.flatnonzero(record.fitted)[wait:]
        own = np.asarray(residuals)[rows]
        if len(own) <= LAGS:
            continue
        lagged = [own[j:].T @ own[: len(own) - j] for j in range(LAGS)]
        sums, counts = sums + np.array(lagged), counts + len(own) - np.arange(LAGS)
    if not counts[-1] > 0:
        raise ConfigError(
            f'method: "moments" needs more than {wait + LAGS} rows per record, as the filter takes {wait} to forget its start; '
            'use "ml"'
        )
    return np.asarray(sums) / counts[:, None, None]


def _innovations(model: AbstractModel, K: Array, start: Array, samples: Sample) -> Float[Array, "T m"]:
    def step(x: Array, sample: Sample) -> tuple[Array, Any]:
        moved = model.transition(x, sample.when)
        residual = jnp.where(sample.seen, model.output.minus(sample.y, model.observe(moved, sample.when)), 0.0)
        return model.space.plus(moved, K @ residual), residual

    return jax.lax.scan(step, start, samples)[1]
