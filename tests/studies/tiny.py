"""Studies that take no time: a number that is drawn, judged, and at times not measured at all."""

import functools

import jax
import numpy as np

from gainful.errors import ModelError
from gainful.studies import (
    Chart,
    Check,
    Citation,
    Claim,
    Entry,
    Experiment,
    Figure,
    Line,
    Panel,
    Quantity,
    Study,
    above,
    below,
)


def measure(record, reading):
    return {"size": abs(reading)}


def figures(outcome):
    t = np.arange(5.0)
    curve = Figure("A curve", "Rises <b>.", (Panel("x", (Line("it", t, t), Line("that", t, 2 * t))),), telling=True)
    bars = {"that": outcome.mean("draw", "as it is", "size")}
    return [Chart("Bars", "Not to be shown.", "size", bars), curve]


def study(name, shown=True):
    experiment = Experiment(
        name="draw",
        title="A draw",
        simulate=jax.random.normal,
        contenders={"as it is": float_of},
        measure=measure,
        quantities=(Quantity("size", "Size"),),
        baseline="as it is",
    )
    claims = (
        Claim(
            "small", "It is small.", "1 < 2", (Check("size", lambda o: o.mean("draw", "as it is", "size"), below(99)),)
        ),
        Claim(
            "large", "It is large.", "none", (Check("size", lambda o: o.mean("draw", "as it is", "size"), above(99)),)
        ),
    )
    cited = (Citation(("A. Walker",), 1905, "On draws", "Nature 72, 294"),)
    about = "What <draws> come to."
    return Study(name, f"Draws of {name}", about, cited, (experiment,), claims, figures if shown else None, runs=3)


def float_of(record):
    return record


first = functools.partial(study, "first-draw")
second = functools.partial(study, "second-draw", shown=False)


def broken():
    raise ModelError("no draw: expected a <hat>, got none")


def wrong():
    return {}["hat"]


def stopped():
    raise KeyboardInterrupt


def entries(*names):
    """Entries of the registry."""
    return {f"{name}-draw": Entry(f"Draws, {name}", f"studies.tiny:{name}") for name in names}
