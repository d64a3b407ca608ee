"""The grids on which all were tuned, on networks and noise that the study does not use, and what was chosen."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ...errors import ConfigError, did_you_mean
from ..experiment import Experiment, Quantity
from ..tuning import Tuning, tune
from .contenders import PANEL_GAIN, Flight, Inverse, Networks, Rival, compensation, learning, rate_command, settings
from .laws import incremental, integral_regulator, pd, pid, regulator
from .measures import Flown, Measure
from .scenarios import DISTURBANCE, OFF_NOMINAL, plant
from .training import AFFINE, BILINEAR, RBF, Kind

SEED, RUNS = 11, 4
MOST_STEP = 1.0  # N m
"""Effort that a contender may make: the root mean square of the torque's steps."""
PD, PID, LQR, LQI, INDI = "PD", "PID", "LQR", "LQI", "INDI"
NETWORK, BILINEAR_LAW, AFFINE_LAW = "network", "bilinear law", "affine law"
LEARNERS: dict[str, Kind] = {NETWORK: RBF, BILINEAR_LAW: BILINEAR, AFFINE_LAW: AFFINE}
"""Laws that learn in flight, and what they are made of."""
_LEARNING = ((0.0, 1e-8, 1e-7, 1e-6, 1e-5), (0.3, 0.5, 1.0))

CHOSEN: dict[str, tuple[float, ...]] = {
    PD: (3.0, 0.7),
    PID: (2.5, 1.4, 0.4),
    LQR: (1000.0, 300.0, 0.1, 3.0),
    LQI: (100.0, 30.0, 100.0, 1.0),
    INDI: (0.3,),
    NETWORK: (1e-8, 1.0),
    BILINEAR_LAW: (1e-6, 1.0),
    AFFINE_LAW: (1e-6, 1.0),
}
"""Settings with the least error within that effort, in the order of the laws' arguments."""

GRIDS: dict[str, tuple[tuple[float, ...], ...]] = {
    PD: ((1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0), (0.7, 1.0, 1.4, 2.0)),
    PID: ((1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0), (0.7, 1.0, 1.4, 2.0), (0.05, 0.1, 0.2, 0.4)),
    LQR: ((30.0, 100.0, 300.0, 1000.0), (0.1, 10.0, 100.0, 300.0, 1000.0), (0.1, 10.0), (0.3, 1.0, 3.0)),
    LQI: ((10.0, 100.0, 300.0, 1000.0), (1.0, 10.0, 30.0, 100.0), (10.0, 100.0, 300.0, 1000.0), (0.1, 0.3, 1.0)),
    INDI: ((0.3, 0.5, 1.0),),
    **dict.fromkeys(LEARNERS, _LEARNING),
}
"""Values tried of each argument, in all combinations."""


def law(
    name: str, values: tuple[float, ...], flight: Flight, panel_gain: tuple[float, float, float] = PANEL_GAIN
) -> Any:
    """A contender with some settings.

    Args:
        name: of the law, as `GRIDS` has it.
        values: of its settings.
        flight: that it flies.
        panel_gain: of laws with a rate command [1/(m s)].
    """
    if name in LEARNERS:
        walk, contraction = values
        command = rate_command(panel_gain=panel_gain, contraction=contraction)
        return Inverse(flight, settings(command, learns=learning(walk), compensated=compensation()), LEARNERS[name])
    if name == INDI:
        return Rival(flight, incremental(values[0], panel_gain))
    laws: dict[str, Callable[..., Any]] = {PD: pd, PID: pid, LQR: regulator, LQI: integral_regulator}
    return Rival(flight, laws[name](*values))


class Score(eqx.Module):
    """The error over all axes, nothing where the effort is beyond its bound, and both by themselves."""

    measure: Measure

    def __call__(self, record: Any, flown: Flown) -> dict[str, Array]:
        found = self.measure(record, flown)
        error = jnp.sqrt(sum(found[f"rms_{axis}"] ** 2 for axis in ("roll", "pitch", "yaw")) / 3.0)  # type: ignore[arg-type]
        return {"score": jnp.where(found["step"] <= MOST_STEP, error, jnp.nan), "error": error, "step": found["step"]}


def retune(name: str, *, runs: int = RUNS, seed: int = SEED) -> Tuning:
    """Repeat the tuning of a law: all of its grid on the off-nominal, disturbed spacecraft.

    Args:
        name: of the law.
        runs: flights per setting.
        seed: of networks and noise; another than the study's.

    Raises:
        ConfigError: the law has no grid.
    """
    if name not in GRIDS:
        raise ConfigError(f"law: {name!r} was not tuned; {did_you_mean(name, GRIDS)}")
    flight = Flight(plant(OFF_NOMINAL, DISTURBANCE))
    tried = {words(each): law(name, each, flight) for each in itertools.product(*GRIDS[name])}
    experiment = Experiment(
        "tuning",
        "Errors within the effort",
        Networks((LEARNERS[name],) if name in LEARNERS else ()),
        tried,
        Score(Measure(jnp.array([0.0, 1.0]))),
        (
            Quantity("score", "RMS of all axes within the effort", "mrad"),
            Quantity("error", "RMS of all axes", "mrad"),
            Quantity("step", "torque step", "N m"),
        ),
    )
    return tune(experiment, tried, "score", runs=runs, seed=seed)


def words(values: tuple[float, ...]) -> str:
    """A setting's name."""
    return ", ".join(f"{value:g}" for value in values)
