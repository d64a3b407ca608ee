"""Faults put into a record."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ConfigError
from ..models import AbstractModel
from ..running import Log
from ..spaces import Circle, Euclidean
from .description import EFFECTS
from .injection import AbstractInjection
from .modelling import part_at
from .signals import check_signals, disturb


def inject(log: Log, model: AbstractModel, faults: Sequence[AbstractInjection], key: Array) -> Log:
    """A copy of a record in which some signals are faulty; all others are the same to the last bit.

    An output is disturbed as it is read. An input is history, the plant has answered to it: its column is changed such
    that the plant, which got what it got, appears to have the fault. A bias `b` leaves `u - b`, of which the plant
    gets `u`; a loss `s` leaves `u / (1 - s)`. An input row holds over the interval that ends there, so it is faulty
    where the interval's start is between onset and end.

    Where the model has a state for it (`offset_`, `loss_`, `bias_`, `scale_` and the signal's name), the truth says
    how large the fault is; what has no state of its own (a stuck sensor, say) counts by what it adds. Fault states
    without a truth are taken to be 0: the record as given has no faults.

    Args:
        log: the record, left as it is.
        model: whose signals these are.
        faults: what goes wrong; several of one signal add up.
        key: random key, for noise.

    Raises:
        ConfigError: an unknown signal, an input that is stuck or lost altogether, which no command explains, or a loss
            of something else than a number or an angle.

    Example:
        >>> import jax, gainful as gf
        >>> from gainful.faults import Bias
        >>> model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, outputs=["y"])
        >>> log = gf.make_log(model, [0.0, 1.0, 2.0], [0.0, 0.0, 0.0])
        >>> inject(log, model, [Bias("y", 3.0, onset=1.0, end=2.0)], jax.random.key(0)).y[:, 0].tolist()
        [0.0, 3.0, 0.0]
    """
    faults = tuple(faults)
    check_signals(faults, [*model.inputs, *model.output.tangent_names])
    for_inputs, for_outputs = jax.random.split(key)
    u, counts = _inputs(log, model, faults, for_inputs)
    y, counted = _outputs(log, model, faults, for_outputs)
    counts = log.counts | {name: log.counts.get(name, 0) + rows for name, rows in (counts | counted).items()}
    truth = _truth(dataclasses.replace(log, u=u), model, faults)
    return dataclasses.replace(log, u=u, y=y, truth=truth, counts=counts)


def _parts(fault: AbstractInjection, t: np.ndarray, key: Array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where a fault is active, and what it adds there to a value `v`: `shift + gain v`."""
    times, keys = jnp.asarray(t), jax.random.split(key, len(t))
    active = np.asarray(jax.vmap(fault.active)(times))
    still, unit = (jnp.full(len(t), value) for value in (0.0, 1.0))
    zero, one = (np.asarray(jax.vmap(fault.change)(values, times, keys)) for values in (still, unit))
    return active, np.where(active, zero, 0.0), np.where(active, one - zero, 0.0)


def _inputs(
    log: Log, model: AbstractModel, faults: Sequence[AbstractInjection], key: Array
) -> tuple[np.ndarray, dict[str, int]]:
    """The commands that would have made the faulty plant do what it did, and how many rows each fault concerns."""
    u, counts = log.u.copy(), {}
    shift, gain, touched = np.zeros(u.shape), np.zeros(u.shape), np.zeros(u.shape, bool)
    starts = np.concatenate([log.t[:1] - log.dt[:1], log.t[:-1]])  # of the intervals, without the rounding of dt
    for fault, own in _of(faults, model.inputs, key):
        row = model.inputs.index(fault.signal)
        active, added, scaled = _parts(fault, starts, own)
        shift[:, row] += added
        gain[:, row] += scaled
        touched[:, row] |= active
        counts |= _counted(counts, fault, active & log.kept)
        if (1 + gain[:, row] <= 0).any():
            raise ConfigError(
                f"faults: expected a fault of input {fault.signal!r} that some command explains, got {fault.word}; "
                "the plant has answered to the input already, so simulate it with the fault"
            )
    u[touched] = ((log.u - shift) / (1 + gain))[touched]
    return u, counts


def _outputs(
    log: Log, model: AbstractModel, faults: Sequence[AbstractInjection], key: Array
) -> tuple[np.ndarray, dict[str, int]]:
    """The readings with their faults, and how many rows each fault concerns."""
    names, y, counts = model.output.tangent_names, log.y.copy(), {}
    concerned = [fault for fault, _ in _of(faults, names, key)]
    if not concerned:
        return y, counts
    sound = np.zeros((len(log), len(names)))
    touched = np.zeros((len(log), len(names)), bool)
    for fault in concerned:
        row = names.index(fault.signal)
        active, _, gain = _parts(fault, log.t, key)
        part, place = part_at(model.output, row)
        if gain.any() and not isinstance(part, (Euclidean, Circle)):
            raise ConfigError(
                f"faults: expected a bias, drift or noise of {fault.signal!r}, a {type(part).__name__}, got {fault.word}"
            )
        sound[:, row] = log.y[:, place] if part.size == part.dof else 0.0
        touched[:, row] |= active
        counts |= _counted(counts, fault, active & log.kept)
    moment = jax.random.split(key, len(log))
    faulty = np.asarray(jax.vmap(lambda v, t, k: disturb(v, names, concerned, t, k))(sound, jnp.asarray(log.t), moment))
    moved = np.asarray(jax.vmap(model.output.plus)(jnp.asarray(y), jnp.where(touched, faulty - sound, 0.0)))
    i = j = 0
    for part in model.output.parts:
        for row, place in zip(range(j, j + part.dof), range(i, i + part.size), strict=False):
            if isinstance(part, Euclidean):
                y[:, place] = np.where(touched[:, row], faulty[:, row], y[:, place])
        if not isinstance(part, Euclidean):
            rows = touched[:, j : j + part.dof].any(axis=1)
            y[rows, i : i + part.size] = moved[rows, i : i + part.size]
        i, j = i + part.size, j + part.dof
    return y, counts


def _truth(log: Log, model: AbstractModel, faults: Sequence[AbstractInjection]) -> dict[str, np.ndarray]:
    """Reference values with the sizes of the faults."""
    truth = dict(log.truth)
    following = np.concatenate([log.u[1:], log.u[-1:]])  # a fault of the state acts on the interval that comes next
    for side, signals, values in (("input", model.inputs, following), ("output", model.output.tangent_names, log.y)):
        kinds = [kind for kind, (where, _) in EFFECTS.items() if where == side]
        added, scaled = sorted(kinds, key=lambda kind: EFFECTS[kind][1] != 0)
        for row, signal in enumerate(signals):
            names = {kind: f"{kind}_{signal}" for kind in (added, scaled) if f"{kind}_{signal}" in _added_states(model)}
            for name in names.values():
                truth[name] = truth.get(name, np.where(log.kept, 0.0, np.nan)).copy()
            for fault in faults:
                if fault.signal != signal or fault.random:
                    continue
                _, shift, gain = _parts(fault, log.t, jax.random.key(0))
                if scaled in names:
                    truth[names[scaled]] += gain * EFFECTS[scaled][1]
                elif added in names:
                    place = row if side == "input" else part_at(model.output, row)[1]
                    shift = shift + np.where(gain != 0, gain * values[:, place], 0.0)
                if added in names:
                    truth[names[added]] += shift
    return truth


def _added_states(model: AbstractModel) -> tuple[str, ...]:
    """Names of the states a model was extended by."""
    added = model.space.added
    return model.space.tangent_names[len(model.space.tangent_names) - added :]


def _of(
    faults: Sequence[AbstractInjection], names: Sequence[str], key: Array
) -> list[tuple[AbstractInjection, Float[Array, ""]]]:
    """The faults of some signals, each with a key of its own."""
    keys = jax.random.split(key, max(len(faults), 1))
    return [(fault, own) for fault, own in zip(faults, keys, strict=False) if fault.signal in names]


def _counted(counts: dict[str, int], fault: AbstractInjection, rows: np.ndarray) -> dict[str, int]:
    name = f"{fault.word} of {fault.signal} injected"
    return {name: counts.get(name, 0) + int(rows.sum())}
