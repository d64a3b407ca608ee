"""How wrong the effectiveness of the torques may be: what compensation does to the margin, in theory and along a loop."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...control import error_dynamics, gain_margin
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..experiment import Experiment, Quantity
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, exactly

MARGINS = "margins"
RATES = {"none": 0.0, "slow (0.02)": 0.02, "fast (0.2)": 0.2, "at once (1)": 1.0}
"""Gains of the running mean of the error by name: none, as in the other chapters, faster, and incremental inversion."""
CONTRACTIONS = (1.0, 0.5)
"""Shares of the error that the command asks to be gone after a step."""
STEPS = 4000
"""Of the loop: whatever has not grown by then is stable to a part in a thousand."""
HALVINGS = 24


class Ratios(eqx.Module):
    """Nothing random: the interval in which the boundary is looked for."""

    def __call__(self, key: Array) -> Float[Array, "2"]:
        return jnp.array([0.0, 4.0])


class Boundary(eqx.Module):
    """The largest ratio of true to modelled effectiveness at which a loop, followed step by step, comes to rest.

    Attributes:
        rate: gain of the running mean.
    """

    rate: Array

    def __call__(self, interval: Float[Array, "2"]) -> Float[Array, " c"]:
        def stable(ratio: Array, contraction: Array) -> Array:
            def step(carry: Array, _: None) -> tuple[Array, None]:
                rate, mean = carry
                asked = -contraction * rate - mean
                # The model says that the command does what is asked; the plant does `ratio` times that.
                moved = ratio * asked
                return jnp.stack([rate + moved, mean + self.rate * (moved - asked - mean)]), None

            last, _ = jax.lax.scan(step, jnp.array([1.0, 0.0]), None, length=STEPS)
            return jnp.all(jnp.abs(last) < 1.0)

        def search(contraction: Array) -> Array:
            def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
                middle = 0.5 * (ends[0] + ends[1])
                inside = stable(middle, contraction)
                return jnp.where(inside, middle, ends[0]), jnp.where(inside, ends[1], middle)

            return jax.lax.fori_loop(0, HALVINGS, halve, (interval[0], interval[1]))[0]

        return jax.vmap(search)(jnp.asarray(CONTRACTIONS))


class Measure(eqx.Module):
    """From the boundaries to the quantities."""

    def __call__(self, record: Array, found: Float[Array, " c"]) -> dict[str, Array]:
        return {named(contraction): found[k] for k, contraction in enumerate(CONTRACTIONS)}


def named(contraction: float) -> str:
    """A quantity's name."""
    return f"boundary_{contraction:g}"


def radius(ratio: float, rate: float, contraction: float) -> float:
    """Spectral radius of the loop."""
    if rate == 0:
        # No mean, which would stay where it is.
        return abs(1.0 - ratio * contraction)
    return float(np.abs(np.linalg.eigvals(error_dynamics(ratio, rate, contraction))).max())


def tables(outcome: Outcome) -> list[Table]:
    """Boundaries by formula and as found."""
    rows = tuple(
        (
            name,
            *(
                cell
                for contraction in CONTRACTIONS
                for cell in (
                    f"{gain_margin(rate, contraction):.4f}",
                    outcome.mean(MARGINS, name, named(contraction)),
                )
            ),
        )
        for name, rate in RATES.items()
    )
    heads = [f"{what}, contraction {each:g}" for each in CONTRACTIONS for what in ("formula", "found")]
    return [Table("Largest ratio of true to modelled effectiveness that is stable", ("Compensation", *heads), rows)]


def figures(outcome: Outcome) -> list[Figure]:
    """Spectral radius over the ratio."""
    ratio = np.linspace(0.02, 2.6, 130)
    panels = tuple(
        Panel(
            f"spectral radius, contraction {contraction:g}",
            (
                Line("bound of stability", ratio, np.ones_like(ratio), reference=True),
                *(
                    Line(name, ratio, np.array([radius(each, rate, contraction) for each in ratio]))
                    for name, rate in RATES.items()
                ),
            ),
        )
        for contraction in CONTRACTIONS
    )
    return [
        Figure(
            "What compensation does to the margin",
            "A one-step inverse whose model is wrong about the effectiveness of the torque, with the running mean of "
            "its error taken off the target. The faster the mean, the sooner the loop is unstable; a command that "
            "asks for less per step gives margin back.",
            panels,
            "true over modelled effectiveness",
        )
    ]


def _off(name: str, contraction: float) -> Check:
    def over(outcome: Outcome) -> Measured:
        found = outcome.mean(MARGINS, name, named(contraction)).value
        return exactly(abs(found / gain_margin(RATES[name], contraction) - 1.0))

    return Check(
        f"boundary found over the formula's less 1, compensation {name}, contraction {contraction:g}", over, below(2e-3)
    )


def _gained(name: str, contraction: float) -> Check:
    return Check(
        f"boundary with compensation {name} over that without, contraction {contraction:g}",
        lambda outcome: outcome.ratio(MARGINS, named(contraction), name, over="none"),
        above(1.0),
    )


CLAIMS = (
    Claim(
        "margin (C3, by theory)",
        "Compensation widens the range of plants at which the inverse controller is stable.",
        "in words: it avoids divergence",
        tuple(_gained(name, each) for name in list(RATES)[1:] for each in CONTRACTIONS),
        {
            "not reproduced": "The mean is fed back with the sign and the size of an integral of what the plant does too "
            "much: the margin shrinks from 2 to 4/3 as the mean grows faster."
        },
    ),
    Claim(
        "closed form of the margin",
        "The loop is stable for ratios below 4 / (2 alpha + 2 beta - alpha beta).",
        "not in the publication",
        tuple(_off(name, each) for name in RATES for each in CONTRACTIONS),
    ),
)


def chapter() -> Chapter:
    """A rate loop in two numbers, the error and its running mean."""
    experiment = Experiment(
        MARGINS,
        "Margin of the effectiveness",
        Ratios(),
        {name: Boundary(jnp.asarray(rate)) for name, rate in RATES.items()},
        Measure(),
        tuple(Quantity(named(each), f"largest stable ratio, contraction {each:g}") for each in CONTRACTIONS),
        random=False,
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
