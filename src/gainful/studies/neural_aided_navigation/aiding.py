"""Networks beside the filters: what each is told, how it is trained, and the filter it is put into."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ...aiding import AidingReport, aided_filter, train_aiding, validation_gate
from ...aiding.playing import Played, Records, gathered, play, unaided
from ...filters import kalman_filter
from ...networks import (
    CMAC,
    CMAC_PRESETS,
    AbstractNetwork,
    AbstractTraining,
    AffineMap,
    AffineTraining,
    CMACTraining,
    MultilayerPerceptron,
    PerceptronTraining,
)
from ...plants import track
from ...running import make_log, run, smooth
from ...updates import AbstractFeatures, Corrected, InnovationHistory, OnlineGate, UpdateFeatures
from ..experiment import Contender
from ..prepared import once
from .noise import Belief, design, fitted
from .records import SCENARIOS, STEADY, TRAINING, VALIDATION, from_start, lessons, priors, training_key

LEAST_VISITS = 20.0
"""In training, of what answers; where there were fewer nothing is corrected."""
REFERENCE_SIGMA = 0.02  # m
"""Of a receiver that is there while a network is trained."""
PAPERS = UpdateFeatures()
"""What the paper's network is told."""
LEAKY = InnovationHistory(leaks=(0.6,), square_leaks=())
"""Of its numbers, the first and the third are the innovation and its leaky mean."""
HISTORY = InnovationHistory()
PAIRS = ((0, 2), (0, 3), (0, 4), (0, 5), (2, 3), (0, 6))
"""Features that the tables of an additive network look at."""


@dataclasses.dataclass(frozen=True)
class Recipe:
    """How a network is made.

    Attributes:
        training: of which kind.
        told: what it is told.
        tuned: whether it is put beside the filter fitted to the records, or beside the design.
        feedback: whether the filter goes on from the corrected estimate.
        teacher: "truth", "reference", "smoother" or "smoother, design".
    """

    training: AbstractTraining
    told: AbstractFeatures = PAPERS
    tuned: bool = False
    feedback: bool = False
    teacher: str = "truth"


FINE = CMAC_PRESETS["fine"]
TUNED = dataclasses.replace(FINE, cells=2**16)
"""The same where the gain varies at the start, which makes a table of all tiles too large; few of its cells are reached."""
RECIPES = {
    "BP, SGD": Recipe(PerceptronTraining(method="sgd")),
    "BP, L-BFGS": Recipe(PerceptronTraining()),
    "CMAC, 10 levels": Recipe(CMAC_PRESETS["coarse"]),
    "CMAC, 10 cells": Recipe(CMACTraining(levels=10, layers=4, compress="none", epochs=1, table="hashed", cells=10)),
    "CMAC, 10 layers": Recipe(FINE),
    "CMAC, compressed": Recipe(CMACTraining()),
    "affine map": Recipe(AffineTraining()),
    "CMAC, leaky innovation": Recipe(CMACTraining(groups=((0, 2),)), LEAKY),
    "CMAC, history": Recipe(CMACTraining(groups=PAIRS), HISTORY),
    "CMAC, fed back": Recipe(CMACTraining(), feedback=True),
    "KF, ML + CMAC": Recipe(TUNED, tuned=True),
    "KF, ML + CMAC, history": Recipe(CMACTraining(groups=PAIRS), HISTORY, tuned=True),
    "KF, ML + MLP, history": Recipe(PerceptronTraining(hidden=(16,)), HISTORY, tuned=True),
    "CMAC, reference": Recipe(FINE, teacher="reference"),
    "CMAC, smoother": Recipe(FINE, teacher="smoother"),
    "CMAC, smoother of the design": Recipe(FINE, teacher="smoother, design"),
}
"""By the name of the contender."""


def kept(network: AbstractNetwork, accepted: Any) -> AbstractNetwork:
    """The network with some outputs made zero by its weights, so that all choices share a program.

    Args:
        network: as it was trained.
        accepted: which outputs are kept.
    """
    factors = jnp.asarray(accepted, float)
    if isinstance(network, CMAC):
        return eqx.tree_at(lambda each: each.weights, network, network.weights * factors)
    if isinstance(network, MultilayerPerceptron):
        return eqx.tree_at(lambda each: each.size, network, network.size * factors)
    assert isinstance(network, AffineMap)
    return AffineMap(network.matrix * factors[:, None], network.offset * factors)


def belief(name: str, scenario: str) -> Belief:
    """What the filter beside a network believes."""
    return fitted(scenario) if RECIPES[name].tuned else design()


@dataclasses.dataclass(frozen=True)
class Trained:
    """A network, and which components it made better on the records kept apart.

    Attributes:
        network: as it was trained.
        accepted: by the offline gate, one per state.
    """

    network: AbstractNetwork
    accepted: Bool[np.ndarray, "2"]


@once
def watched(scenario: str, told: AbstractFeatures, believed: Belief) -> tuple[Records, Played]:
    """All records of a scenario as a filter without a network sees them, with what it would tell one."""
    drawn, logs = lessons(scenario)
    records = gathered(believed.model, priors(scenario, believed.cov), logs, list(drawn.states))
    return records, play(kalman_filter(), unaided(kalman_filter(), told, believed.model), records)


@once
def trained(name: str, scenario: str) -> Trained:
    """A network trained open loop on the records of a scenario, its offline gate set by those kept apart.

    A correction that is not fed back leaves the filter as it is, so that one pass over the records tells all.
    """
    recipe = RECIPES[name]
    _, played = watched(scenario, recipe.told, belief(name, scenario))
    errors = played.wanted if recipe.teacher == "truth" else played.wanted + _doubts(recipe.teacher, scenario)
    features = played.features
    inputs, targets = (each[:TRAINING].reshape(-1, each.shape[-1]) for each in (features, errors))
    network, _ = recipe.training(inputs, targets, key=key_of(name, scenario))
    before = played.wanted[TRAINING:]
    accepted = validation_gate(before, before - np.asarray(_said(network, jnp.asarray(features[TRAINING:]))), STEADY)
    return Trained(network, accepted)


def key_of(name: str, scenario: str) -> Array:
    """The random key of a training."""
    return training_key(SCENARIOS.index(scenario), list(RECIPES).index(name))


@eqx.filter_jit
def _said(network: AbstractNetwork, features: Array) -> Float[Array, "M T outputs"]:
    """What a network says of many rows, and 0 where it learned too little."""

    def one(u: Array) -> Array:
        return jnp.where(network.visits(u) >= LEAST_VISITS, network(u), 0.0)

    return jax.vmap(jax.vmap(one))(features)


def _doubts(teacher: str, scenario: str) -> Float[np.ndarray, "M T 2"]:
    """How far a teacher's states are from the truth."""
    taught = references(scenario) if teacher == "reference" else smoothed(scenario, of_design="design" in teacher)
    return np.stack(taught) - lessons(scenario)[0].states


@once
def fed_back(name: str, scenario: str) -> tuple[Corrected, AidingReport]:
    """A network trained in the loop, or with all that training gives: gates, and a covariance of its own."""
    recipe, believed = RECIPES[name], belief(name, scenario)
    return train_aiding(
        kalman_filter(),
        believed.model,
        priors(scenario, believed.cov),
        lessons(scenario)[1],
        held_out=VALIDATION,
        key=key_of(name, scenario),
        training=recipe.training,
        features=recipe.told,
        feedback=recipe.feedback,
        steady_from=STEADY,
    )


def aided(name: str, scenario: str, *, offline: bool = False, online: bool = False) -> Contender:
    """The filter with a network beside it.

    Args:
        name: of the recipe.
        scenario: trained on.
        offline: whether components that were no better on the records kept apart are left alone.
        online: whether the innovations decide all the time if a correction passes.
    """
    recipe, believed = RECIPES[name], belief(name, scenario)
    if recipe.feedback:
        network, accepted = fed_back(name, scenario)[0].network, (True, True)
    else:
        found = trained(name, scenario)
        network, accepted = found.network, found.accepted if offline else (True, True)
    return beside(network, recipe, believed, accepted, online=online)


def beside(
    network: AbstractNetwork,
    recipe: Recipe,
    believed: Belief,
    accepted: Any = (True, True),
    *,
    online: bool = False,
    least_visits: float = LEAST_VISITS,
) -> Contender:
    """A filter with a network beside it; those that differ in numbers only share a program.

    Args:
        network: trained.
        recipe: by which.
        believed: by the filter.
        accepted: which states are corrected.
        online: whether the innovations decide if a correction passes.
        least_visits: without which the network is not believed.
    """
    update = Corrected(
        kept(network, accepted),
        recipe.told,
        feedback=recipe.feedback,
        gate=OnlineGate() if online else None,
        least_visits=jnp.asarray(least_visits),  # type: ignore[arg-type]  # tunable
    )
    return Contender(aided_filter(kalman_filter(), update), believed.model, from_start(believed.cov))


def as_recommended(name: str, scenario: str) -> Contender:
    """The filter as training leaves it: both gates, and the covariance found on the records kept apart."""
    believed = belief(name, scenario)
    update = fed_back(name, scenario)[0]
    return Contender(aided_filter(kalman_filter(), update), believed.model, from_start(believed.cov))


@once
def smoothed(scenario: str, *, of_design: bool) -> list[np.ndarray]:
    """The records smoothed by the filter of the design, or by the one fitted to them."""
    believed = design() if of_design else fitted(scenario)
    logs, starts = lessons(scenario)[1], priors(scenario, believed.cov)
    return [
        smooth(run(kalman_filter(), believed.model, prior, log)).mean for prior, log in zip(starts, logs, strict=True)
    ]


@once
def references(scenario: str) -> list[np.ndarray]:
    """The records as a precise receiver and a smoother see them."""
    drawn, _ = lessons(scenario)
    position, speed, _ = fitted(scenario).sigmas
    model = Belief((position, speed, REFERENCE_SIGMA)).model
    noise = REFERENCE_SIGMA * np.asarray(
        jax.random.normal(training_key(SCENARIOS.index(scenario), 10_000), drawn.y.shape)
    )
    found = []
    for k, prior in enumerate(priors(scenario)):
        precise = make_log(track(), drawn.t[k], drawn.states[k, :, :1] + noise[k], start=0.0)
        found.append(smooth(run(kalman_filter(), model, prior, precise)).mean)
    return found


def filtered(believed: Belief, estimator: Any = None) -> Contender:
    """A filter of the track, the Kalman filter by default, with a belief."""
    return Contender(kalman_filter() if estimator is None else estimator, believed.model, from_start(believed.cov))
