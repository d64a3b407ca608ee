"""The walk that a filter assumes of the parameters, tuned alike for all on records that the study does not use."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ...filters import Info
from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS
from ..experiment import Contender, Experiment, Quantity, Record
from ..tuning import Tuning, tune
from .contenders import Belief, ToldContender, believing, contender
from .measures import true_states
from .records import NOISES, SETTLED, TRACKS, Drive, drive, track

WALKS = (3e-4, 1e-3, 3e-3, 1e-2, 2e-2, 4e-2)
"""Tried, per sample."""


class Suite(eqx.Module):
    """From a random key to records with the same noise on all tracks.

    Attributes:
        drive: one of them.
        tracks: stacked (tracks, T, 2).
    """

    drive: Drive
    tracks: Array

    def __call__(self, key: Array) -> Record:
        return jax.lax.map(lambda each: dataclasses.replace(self.drive, track=each)(key), self.tracks)


class OnAll(eqx.Module):
    """A contender on all tracks."""

    contender: Contender | ToldContender

    def __call__(self, records: Record) -> Info:
        return jax.lax.map(self.contender, records)


class Score(eqx.Module):
    """Mean over tracks and components of the logarithm of the RMSE."""

    def __call__(self, records: Record, infos: Info) -> dict[str, Array]:
        error = (infos.estimate.mean - jax.vmap(true_states)(records)) / jnp.asarray((*MEASUREMENT_SIGMAS, 1.0, 1.0))
        return {"score": jnp.mean(jnp.log10(jnp.sqrt(jnp.mean(error[:, SETTLED:] ** 2, axis=1))))}


def tuned(name: str, *, runs: int = 10, seed: int = 7) -> Tuning:
    """Find the walk with which a filter does best on the four tracks in mixture noise.

    Args:
        name: of the filter.
        runs: records per track.
        seed: unlike the study's.
    """
    noise = NOISES["mixture"]
    experiment = Experiment(
        "tuning",
        "The walk of the parameters",
        Suite(drive(noise), jnp.stack([track(kind) for kind in TRACKS])),
        {name: OnAll(contender(name))},
        Score(),
        (Quantity("score", "mean log10 RMSE"),),
    )
    settings = {f"{walk:g}": OnAll(contender(name, believing(name, noise, Belief(walk)))) for walk in WALKS}
    return tune(experiment, settings, "score", runs=runs, seed=seed)
