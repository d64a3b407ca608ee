"""Outages put into a record on purpose."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ..errors import ConfigError, did_you_mean
from ..models import AbstractModel
from .log import Log


def with_outage(log: Log, model: AbstractModel, outputs: Sequence[str], start: float, stop: float = math.inf) -> Log:
    """A copy of a record in which some outputs are not measured for a while, to see how far the estimates get without.

    What is left out is counted, and does not count as missing: the sensor had measured it.

    Args:
        log: the record, left as it is.
        model: whose outputs these are.
        outputs: their names, a quaternion as a whole.
        start: first time without them [s].
        stop: first time with them again [s].

    Raises:
        ConfigError: no output, an unknown one, or a stop that is not after the start.

    Example:
        >>> from gainful.models import linear_model
        >>> from gainful.running import make_log
        >>> model = linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, outputs=["y"])
        >>> log = make_log(model, [0.0, 1.0, 2.0, 3.0], [0.1, 0.2, 0.3, 0.4])
        >>> with_outage(log, model, ["y"], 1.0, 3.0).seen[:, 0].tolist()
        [True, False, False, True]
    """
    columns = _columns(model)
    if not outputs:
        raise ConfigError("outputs: expected at least one, got none")
    for name in outputs:
        if name not in columns:
            raise ConfigError(f"outputs: {name!r} is not an output of the model; {did_you_mean(name, list(columns))}")
    if not start < stop:
        raise ConfigError(f"stop: expected a time after the start at {start:g} s, got {stop:g} s")
    during, seen, counts = (log.t >= start) & (log.t < stop), log.seen.copy(), dict(log.counts)
    for name in outputs:
        told = f"{name} left out in an outage"
        counts[told] = counts.get(told, 0) + int(seen[during, columns[name]].any(axis=1).sum())
        seen[during, columns[name]] = False
    return dataclasses.replace(log, seen=seen, counts=counts)


def _columns(model: AbstractModel) -> dict[str, slice]:
    """The degrees of freedom of each output, a quaternion's three under one name."""
    columns, i = {}, 0
    for part in model.output.parts:
        if part.size == part.dof:
            columns |= {name: slice(i + j, i + j + 1) for j, name in enumerate(part.tangent_names)}
        else:
            columns[part.names[0].removesuffix("_x")] = slice(i, i + part.dof)
        i += part.dof
    return columns
