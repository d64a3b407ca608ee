"""An error of the fixes that repeats along the track, learned as a map of the sensor."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from ...aiding import SensorMap, SensorMapReport, learn_sensor_map, with_sensor_maps
from ...filters import kalman_filter
from ...networks import CMACTraining
from ...plants import TRACK_SCENARIOS
from ..chapter import Chapter
from ..experiment import Contender
from ..figures import Figure, Line, Panel
from ..outcome import Outcome
from ..prepared import once
from .noise import fitted
from .records import SCENARIOS, TRAINING, from_start, lessons, training_key

MAPPED = "KF, ML + map of the fixes"
SCENARIO = "map"
SKIPPED = 50.0  # s
TABLE = CMACTraining(levels=256, layers=16, compress="none", epochs=5)


@once
def learned() -> tuple[SensorMap, SensorMapReport]:
    """The map, from fixes at true places of the training records."""
    drawn, logs = lessons(SCENARIO)
    return learn_sensor_map(
        fitted(SCENARIO).model,
        logs[:TRAINING],
        list(drawn.states[:TRAINING]),
        "fix",
        ["displacement"],
        key=training_key(SCENARIOS.index(SCENARIO), 20_000),
        training=TABLE,
        start=SKIPPED,
    )


def mapped() -> Contender:
    """The tuned filter of a model whose fixes err as the map says, with the noise that the calibrated scenario has."""
    believed = fitted("calibrated")
    model = with_sensor_maps(believed.model, [learned()[0]])
    return Contender(kalman_filter(), model, from_start(believed.cov))


def figures(outcome: Outcome) -> list[Figure]:
    """The map beside the true error."""
    found, _ = learned()
    places = np.linspace(0.0, float(np.max(lessons(SCENARIO)[0].states[:TRAINING, :, 0])), 800)
    said = np.asarray(jax.vmap(found.network)(jnp.asarray(places)[:, None]))[:, 0]
    true = np.asarray(TRACK_SCENARIOS[SCENARIO].fix_error(jnp.asarray(places)))
    known = np.asarray(jax.vmap(found.known)(jnp.asarray(places)[:, None]))
    shown = places / 1000.0
    marks = (Line("true", shown, true, reference=True), Line("learned", shown, np.where(known, said, np.nan)))
    return [
        Figure(
            "An error of the fixes that repeats along the track",
            "A CMAC of the displacement, learned from forty records.",
            (Panel("error of a fix", marks, "m"),),
            "displacement [km]",
        )
    ]


def chapter() -> Chapter:
    """The figure of the map; its filter competes in the scenario."""
    return Chapter(figures=figures)
