"""Drives with an outage of the satellites, and drives to learn from."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...estimates import Gaussian
from ...models import Model
from ...plants import DriveRecord, drive_vehicle, land_vehicle
from ...plants.land_vehicle import START_SIGMAS
from ...running import Log, make_log
from ..experiment import Record
from ..prepared import once
from .records import training_key

OUTAGE, AFTER = 300.0, (10.0, 30.0, 60.0, 120.0)  # s
"""When the satellites are lost, and the times after that at which the error is told."""
LONGEST = OUTAGE + AFTER[-1]
STEPS = 10
"""Rows per second."""
DRIVES, LESSON = 6, 600.0
"""How many drives there are to learn from, and how long they are [s]."""


class Outage(eqx.Module):
    """From a random key to a drive whose last two minutes are without satellites."""

    def __call__(self, key: Array) -> Record:
        record = drive_vehicle(key=key, duration=LONGEST).with_outage(OUTAGE, LONGEST)
        return Record(record.samples, {"t": record.t, "states": record.states, "start": record.start})


@once
def model() -> Model:
    """What the filters believe of the vehicle."""
    return land_vehicle()


def start_of(begin: Array) -> Gaussian:
    """The estimate before the first row."""
    return Gaussian.start(jnp.asarray(begin), jnp.diag(jnp.asarray(START_SIGMAS) ** 2), model().space)


@once
def lessons() -> tuple[DriveRecord, tuple[Log, ...]]:
    """Drives to learn from, stacked, and as logs without any truth."""
    keys = jax.random.split(training_key(40_000), DRIVES)
    drawn = jax.tree.map(np.asarray, _drawn(keys))
    logs = []
    for k in range(DRIVES):
        y = np.where(drawn.seen[k], drawn.y[k], np.nan)
        logs.append(make_log(model(), drawn.t[k], y, drawn.u[k]))
    return drawn, tuple(logs)


@eqx.filter_jit
def _drawn(keys: Array) -> DriveRecord:
    return jax.lax.map(lambda key: drive_vehicle(key=key, duration=LESSON), keys)
