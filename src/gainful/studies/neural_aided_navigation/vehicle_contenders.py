"""The vehicle's filter with fewer and more sensors, and with maps of what these do wrong."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Bool

from ...aiding import SensorMap, SensorMapReport, learn_sensor_map, with_sensor_maps
from ...filters import Info, extended_kalman_filter
from ...models import AbstractModel
from ...networks import AbstractTraining, CMACTraining, HarmonicTraining, PerceptronTraining
from ...plants import land_vehicle
from ...running import Result, run, smooth
from ...running.run import scan
from ..experiment import Record
from ..prepared import once
from .records import training_key
from .vehicle_records import lessons, model, start_of

INS, ODOMETER, SIDEWAYS, COMPASS = "INS", "INS + odometer", "+ no side slip", "+ compass"
CMAC_ONE, CMAC_TWO, MLP_MAPS, CURVE, EXACT = (
    "+ CMAC maps, pass 1",
    "+ CMAC maps, pass 2",
    "+ MLP maps, pass 1",
    "+ deviation curve",
    "+ errors known",
)
SENSORS = {INS: 0, ODOMETER: 1, SIDEWAYS: 2, COMPASS: 3}
"""How many of odometer, no side slip and compass there are."""
CONTEXTS = {"odometer": ("odometer", "force_forward"), "sideways": ("odometer", "yaw_rate"), "compass": ("compass",)}
"""What the error of each signal depends on."""
FLOORS = {"odometer": 0.08, "sideways": 0.08, "compass": math.radians(2.0)}
"""Least sigmas that the sensors are left with [m/s, m/s, rad]."""
_TABLES: dict[str, AbstractTraining] = {
    **dict.fromkeys(("odometer", "sideways"), CMACTraining(levels=60, layers=10, compress="none", epochs=2)),
    "compass": CMACTraining(levels=80, layers=16, compress="none", epochs=10),
}
_EVERY = {"odometer": 5, "sideways": 5, "compass": 1}


class Navigator(eqx.Module):
    """A contender: the vehicle's filter, given some of the sensors.

    Attributes:
        model: that it believes in.
        given: which of the outputs it is given (7,).
    """

    model: AbstractModel
    given: Bool[Array, "7"]

    def __call__(self, record: Record) -> Info:
        samples = eqx.tree_at(lambda each: each.seen, record.samples, record.samples.seen & self.given)
        return scan(extended_kalman_filter(), self.model, start_of(record.truth["start"]), samples)[1]


def navigator(sensors: int = 3, maps: tuple[SensorMap, ...] = ()) -> Navigator:
    """The filter with some sensors and maps.

    Args:
        sensors: how many of odometer, no side slip and compass.
        maps: of what they do wrong.
    """
    given = jnp.array([k < sensors or k >= len(FLOORS) for k in range(7)])
    return Navigator(with_sensor_maps(model(), maps) if maps else model(), given)


@once
def teachers(passes: int) -> tuple[Result, ...]:
    """The drives smoothed by the filter that is to be helped: with the maps of a pass, or at first without any."""
    believed: AbstractModel = with_sensor_maps(model(), cmac_maps(passes)) if passes else model()
    drawn, logs = lessons()
    return tuple(
        smooth(run(extended_kalman_filter(), believed, start_of(begin), log))
        for begin, log in zip(drawn.start, logs, strict=True)
    )


def cmac_maps(passes: int) -> tuple[SensorMap, ...]:
    """Maps learned from the smoothed drives, those of later passes from drives smoothed with the maps before."""
    return tuple(learned(signal, passes)[0] for signal in CONTEXTS)


@once
def learned(signal: str, passes: int = 1, kind: str = "CMAC") -> tuple[SensorMap, SensorMapReport]:
    """The map of a signal.

    Args:
        signal: by name.
        passes: how often it was learned.
        kind: "CMAC", "MLP" or, for an angle, "curve".
    """
    training = {"CMAC": _TABLES[signal], "MLP": PerceptronTraining(hidden=(16,)), "curve": HarmonicTraining()}[kind]
    place = list(CONTEXTS).index(signal)
    return learn_sensor_map(
        model(),
        lessons()[1],
        teachers(passes - 1),
        signal,
        CONTEXTS[signal],
        key=training_key(40_001, passes, place),
        training=training,
        floor=FLOORS[signal],
        every=_EVERY[signal],
        start=30.0,
        end=5.0,
    )


def knowing() -> Navigator:
    """The filter that knows the repeatable errors: what the best maps could do."""
    sigmas = (FLOORS["odometer"], FLOORS["sideways"], math.degrees(FLOORS["compass"]))
    return Navigator(land_vehicle(*sigmas, errors_known=True), jnp.ones(7, bool))


def makers() -> dict[str, Callable[[], Any]]:
    """Makers of all."""
    return {
        **{name: functools.partial(navigator, count) for name, count in SENSORS.items()},
        CMAC_ONE: lambda: navigator(maps=cmac_maps(1)),
        CMAC_TWO: lambda: navigator(maps=cmac_maps(2)),
        MLP_MAPS: lambda: navigator(maps=tuple(learned(signal, 1, "MLP")[0] for signal in CONTEXTS)),
        CURVE: lambda: navigator(maps=(learned("compass", 1, "curve")[0],)),
        EXACT: knowing,
    }
