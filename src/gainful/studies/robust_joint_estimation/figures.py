"""Figures that several chapters show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS
from ..experiment import Record
from ..figures import Figure, Line, Panel
from ..outcome import Outcome

PARAMETERS = ("p1, viscous friction over nominal", "p2, bulk modulus over nominal")
"""Labels of their panels."""
OVER = 20
"""Samples over which curves of squared errors are averaged, that they can be told apart."""


def errors_over_time(outcome: Outcome, experiment: str, title: str, names: Sequence[str]) -> Figure:
    """Mean over runs of the squared errors, on a logarithmic axis."""
    t = _averaged(outcome.record(experiment).truth["t"])

    def lines(what: str) -> tuple[Line, ...]:
        return tuple(Line(name, t, _averaged(outcome.trace(experiment, name, what).mean)) for name in names)

    return Figure(
        title,
        "Squared errors, mean over runs and over 20 ms: of the states in sigmas of the sensors, mean over the three; of the "
        "parameters, sum over the two. The paper plots their logarithm; the axis here is logarithmic.",
        (Panel("states", lines("x"), log=True), Panel("parameters", lines("p"), log=True)),
    )


def outliers(record: Record, sensor: int, rows: slice) -> Line:
    """Readings that are gross errors as single points, those within the range of the truth and ten sigmas around."""
    t, y = record.truth["t"][rows], np.asarray(record.samples.y)[rows, sensor]
    truth, sigma = record.truth["states"][rows, sensor], MEASUREMENT_SIGMAS[sensor]
    gross = record.truth["variance"][rows, sensor] > 1.5 * sigma**2
    near = (y > truth.min() - 10.0 * sigma) & (y < truth.max() + 10.0 * sigma)
    chosen = np.flatnonzero(gross & near)
    # Points with gaps between them are not joined.
    x = np.stack([t[chosen], t[chosen]], axis=1).ravel()
    return Line("gross errors", x, np.stack([y[chosen], np.full(len(chosen), np.nan)], axis=1).ravel())


def _averaged(values: Float[np.ndarray, "T"]) -> Float[np.ndarray, "rows"]:
    values = np.asarray(values)
    return values[: len(values) // OVER * OVER].reshape(-1, OVER).mean(axis=1)
