"""How fast the inverse of a network is found: filter sweeps as published, and joint Gauss-Newton steps."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...control import Inversion
from ..chapter import Chapter
from ..claims import Check, Claim, below, between
from ..experiment import Experiment, Quantity
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from .contenders import RATES_ONLY, split
from .scenarios import BOX
from .training import CONTROLS, RBF, trained

CONVERGENCE = "convergence"
FILTER, JOINT, UNDAMPED = "filter sweeps", "Gauss-Newton, damped", "Gauss-Newton, undamped"
SWEEPS = 80
SHOWN = (1, 2, 3, 5, 10, 20, 40, 80)
DEMANDS = {"small": 0.1, "full": 1.0}
"""Change of the rates asked for, in standard deviations of the training set's; the largest takes about the full torque."""
STATES_TRIED = 20


class Demands(eqx.Module):
    """From a random key to a network and to states and directions at which it is inverted."""

    def __call__(self, key: Array) -> dict[str, Any]:
        learning, own = split(key)
        states, directions = jax.random.split(own)
        x = jax.random.uniform(states, (STATES_TRIED, 12), minval=-0.5, maxval=0.5) * jnp.asarray(BOX.scale[CONTROLS:])
        way = jax.random.normal(directions, (STATES_TRIED, 3))
        return {
            "learned": trained(RBF, learning),
            "states": x,
            "ways": way / jnp.linalg.norm(way, axis=1, keepdims=True),
        }


class Sweeps(eqx.Module):
    """A contender: an inversion, told by how much of a demand is left after every sweep.

    Attributes:
        damping: None for that by the residual, as published; 0 for none at all.
        method: of the inversion.
    """

    damping: Any
    method: str = eqx.field(static=True, default="ekf")

    def __call__(self, record: dict[str, Any]) -> Float[Array, "demands sweeps"]:
        model = record["learned"].model
        inversion = Inversion(
            RATES_ONLY,
            method=self.method,
            sweeps=SWEEPS,
            damping=self.damping,
            input_scale=model.network.lifting.scale[:CONTROLS],
        )

        def one(x: Array, way: Array, size: Array) -> Array:
            start = jnp.zeros(CONTROLS)
            target = model.outputs(x, start) + size * jnp.zeros(12).at[6:9].set(way)
            left = inversion(lambda u: model.outputs(x, u), target, start).cost
            return jnp.sqrt(left / left[0])

        sizes = jnp.asarray(list(DEMANDS.values()))
        return jax.lax.map(
            lambda size: jnp.median(
                jax.vmap(lambda x, way: one(x, way, size))(record["states"], record["ways"]), axis=0
            ),
            sizes,
        )


class Measure(eqx.Module):
    """From what is left after every sweep to the quantities."""

    def __call__(self, record: Any, left: Float[Array, "demands sweeps"]) -> dict[str, Array]:
        found = {named(demand, k): left[i, k] for i, demand in enumerate(DEMANDS) for k in SHOWN}
        decades = jnp.log10(80.0 / 20.0)
        # At rounding there is no slope left to tell.
        slope = jnp.where(left[0, 80] > 1e-9, jnp.log10(left[0, 80] / left[0, 20]) / decades, jnp.nan)
        return found | {"slope": slope}


class Traces(eqx.Module):
    """The same as series."""

    def __call__(self, record: Any, left: Float[Array, "demands sweeps"]) -> dict[str, Array]:
        return {demand: left[i] for i, demand in enumerate(DEMANDS)}


def named(demand: str, sweeps: int) -> str:
    """A quantity's name."""
    return f"{demand}_{sweeps}"


def tables(outcome: Outcome) -> list[Table]:
    """What is left by sweep."""
    return [
        Table(
            f"Left of a demand of {size:g} standard deviations, by sweep",
            ("Inversion", *map(str, SHOWN)),
            tuple(
                (name, *(outcome.mean(CONVERGENCE, name, named(demand, k)) for k in SHOWN))
                for name in outcome.results[CONVERGENCE].experiment.contenders
            ),
        )
        for demand, size in DEMANDS.items()
    ]


def figures(outcome: Outcome) -> list[Figure]:
    """What is left over sweeps."""
    sweep = np.arange(1, SWEEPS + 1)
    names = outcome.results[CONVERGENCE].experiment.contenders

    def line(name: str, demand: str) -> Line:
        left = outcome.trace(CONVERGENCE, name, demand).mean[1:]
        return Line(name, sweep.astype(float), np.where(left > 1e-16, left, np.nan))

    return [
        Figure(
            "How fast the inverse is found",
            "What is left of a demanded change of the rates, mean over networks of the median over states. The "
            "filter's damping is an average of all residuals so far, which makes its error fall as the inverse square "
            "of the sweeps.",
            tuple(
                Panel(f"left of {size:g} standard deviations", tuple(line(name, demand) for name in names), log=True)
                for demand, size in DEMANDS.items()
            ),
            "sweeps",
            x_log=True,
        )
    ]


def _left(contender: str, demand: str, sweeps: int, expected: Any) -> Check:
    return Check(
        f"left of the {demand} demand after {sweeps}, {contender}",
        lambda outcome: outcome.mean(CONVERGENCE, contender, named(demand, sweeps)),
        expected,
    )


CLAIMS = (
    Claim(
        "fast inversion (C4)",
        "The filter inverts the network fast.",
        "in words",
        (
            _left(FILTER, "small", 1, below(0.05)),
            _left(FILTER, "small", 10, below(1e-6)),
            _left(FILTER, "full", 1, below(0.05)),
        ),
        {
            "partly": "The first sweep of a small demand is good to some per cent; after that it is slow, and of a "
            "demand of full torque a good part is left."
        },
    ),
    Claim(
        "inverse square",
        "The filter's error falls as the inverse square of the sweeps.",
        "not in the publication",
        (
            Check(
                "slope from 20 to 80 sweeps in decades per decade",
                lambda outcome: outcome.mean(CONVERGENCE, FILTER, "slope"),
                between(-2.3, -1.7),
            ),
        ),
    ),
    Claim(
        "Gauss-Newton",
        "Joint Gauss-Newton steps are done in two or three.",
        "not in the publication",
        (_left(UNDAMPED, "full", 2, below(1e-6)), _left(JOINT, "full", 5, below(1e-6))),
    ),
)


def chapter() -> Chapter:
    """Inversions of networks as they were trained."""
    experiment = Experiment(
        CONVERGENCE,
        "Convergence of the inverse",
        Demands(),
        {
            FILTER: Sweeps(None),
            JOINT: Sweeps(None, "gauss-newton"),
            UNDAMPED: Sweeps(jnp.asarray(0.0), "gauss-newton"),
        },
        Measure(),
        (
            *(
                Quantity(named(demand, k), f"left of the {demand} demand after {k}")
                for demand in DEMANDS
                for k in SHOWN
            ),
            Quantity("slope", "slope from 20 to 80 sweeps"),
        ),
        Traces(),
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
