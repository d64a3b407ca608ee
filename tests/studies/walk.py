"""A small study: filters along a random walk, with claims that hold, fail and hold in part."""

import functools

import jax.numpy as jnp
import numpy as np

import gainful as gf
from gainful.models import Instant, Sample
from gainful.running.drawing import draw
from gainful.studies import (
    Band,
    Chart,
    Check,
    Citation,
    Claim,
    Contender,
    Experiment,
    Figure,
    Line,
    Panel,
    Quantity,
    Record,
    Study,
    below,
    near,
)

ROWS, ONSET, JUMP = 120, 60, 8.0  # rows, the row of the jump, m
Q, R = 0.1, 1.0  # m^2
STEADY = (-Q + np.sqrt(Q**2 + 4 * Q * R)) / 2  # m^2; the posterior variance that the Riccati equation settles at


def walk(q):
    return gf.linear_model([[1.0]], [[1.0]], Q=q, R=R, states=["x"], outputs=["y"])


MODEL = walk(Q)
PRIOR = gf.make_prior(MODEL, [0.0], [1.0])
MOMENTS = Instant(jnp.arange(ROWS, dtype=float), jnp.ones(ROWS), jnp.zeros((ROWS, 0)))


def simulate(key, jump=0.0):
    x, y = draw(MODEL, PRIOR, MOMENTS, key)
    shift = jnp.where(jnp.arange(ROWS) >= ONSET, jump, 0.0)[:, None]
    return Record(Sample(MOMENTS, y + shift, jnp.ones((ROWS, 1), bool)), {"x": (x + shift)[:, 0]})


def measure(record, info):
    error = info.estimate.mean[:, 0] - record.truth["x"]
    there = jnp.abs(error[ONSET:]) < 1.0  # m
    return {
        "square": jnp.mean(error[20:] ** 2),
        "delay": jnp.where(there.any(), jnp.argmax(there), jnp.inf),
        "caught": there[:10].any(),
    }


def trace(record, info):
    error = info.estimate.mean[:, 0] - record.truth["x"]
    return {"estimate": info.estimate.mean[:, 0], "square": error**2}


QUANTITIES = (
    Quantity("square", "Mean square error", "m^2"),
    Quantity("delay", "Delay", "s", statistic="median"),
    Quantity("caught", "Caught in 10 s", statistic="share"),
)


def contenders():
    filters = {"sluggish": 1e-4, "tuned": Q, "nervous": 10.0}
    return {name: Contender(gf.kalman_filter(), walk(q), PRIOR) for name, q in filters.items()}


def experiment(name="quiet", title="Without a jump", jump=0.0, **changes):
    given = {
        "simulate": functools.partial(simulate, jump=jump),
        "contenders": contenders(),
        "measure": measure,
        "quantities": QUANTITIES,
        "trace": trace,
        "baseline": "tuned",
    }
    return Experiment(name, title, **given | changes)


CLAIMS = (
    Claim(
        "Riccati variance",
        "The mean square error of the optimal filter is the solution of the Riccati equation.",
        f"{STEADY:.3f} m^2",
        (Check("mean square error, tuned", lambda o: o.mean("quiet", "tuned", "square"), near(STEADY, relative=0.3)),),
    ),
    Claim(
        "Less noise is better",
        "A filter that assumes little process noise is more accurate.",
        "no number given",
        (
            Check("mean square error, sluggish over tuned, without a jump",
                  lambda o: o.ratio("quiet", "square", "sluggish", over="tuned"), below(1.0)),
            Check("the same, with a jump",
                  lambda o: o.ratio("jump", "square", "sluggish", over="tuned"), below(1.0)),
        ),
        why={"not reproduced": "It believes in a state that stands still.", "reproduced": "Never to be seen."},
    ),
    Claim(
        "Quick and accurate",
        "A filter that assumes much process noise follows a jump at once, at no cost.",
        "within 2 s",
        (
            Check("delay, nervous", lambda o: o.median("jump", "nervous", "delay"), below(2.0)),
            Check("mean square error, nervous over tuned, without a jump",
                  lambda o: o.ratio("quiet", "square", "nervous", over="tuned"), below(1.05)),
        ),
    ),
)  # fmt: skip


def figures(outcome):
    t = np.arange(ROWS, dtype=float)
    names = outcome.results["jump"].experiment.contenders
    lines = [Line(name, t, outcome.trace("jump", name, "estimate").first) for name in names]
    truth = Line("truth", t, outcome.record("jump").truth["x"], reference=True)
    squares = []
    for name in names:
        found = outcome.trace("jump", name, "square")
        reach = 2 * found.std / np.sqrt(found.runs)
        squares += [Band(name, t, found.mean - reach, found.mean + reach, "95 % interval"), Line(name, t, found.mean)]
    return [
        Figure("One run", "A jump of 8 m after 60 s.", (Panel("x", (*lines, truth), "m"),)),
        Figure(
            "All runs", "Squared error, mean over runs.", (Panel("squared error", tuple(squares), "m^2", log=True),)
        ),
        Chart(
            "All runs",
            "Mean square error with its interval.",
            "mean square error",
            {name: outcome.mean("jump", name, "square") for name in names},
            "m^2",
            log=True,
        ),
    ]


def study(**changes):
    given = {
        "title": "Filters along a random walk",
        "about": "How much process noise a Kalman filter should assume for a state that walks, and one that jumps.",
        "citations": (Citation(("A. Walker", "B. Drunk"), 1905, "The problem of the random walk", "Nature 72, 294"),),
        "experiments": (experiment(), experiment("jump", "With a jump of 8 m", JUMP)),
        "claims": CLAIMS,
        "figures": figures,
        "notes": ("The publication gives no noise levels; Q = 0.1 m^2 and R = 1 m^2 were chosen.",),
        "runs": 12,
        "seed": 3,
    }
    return Study("random-walk", **given | changes)
