"""What makes the inverse of a network fly: scales, outputs, weights, size; rung by rung from the publication's reading."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..experiment import Experiment, Quantity
from ..figures import Chart, Table
from ..outcome import Outcome
from .contenders import HUB, NO_WEIGHTS, Flight, Settings, learning, rate_command, settings, split, state_command
from .flights import LATE, all_axes_over, flown, lost
from .identification import TESTED, rate_sensitivity, sensitivity_error
from .measures import Flown, Measure
from .scenarios import BOX, plant
from .training import AFFINE, BILINEAR, CENTRES, CONTROLS, GAIN, RBF, Kind, learn, network_of, one_steps

LADDER = "ladder"
PRINTED = "SI units, as printed"
SI_HUB, SI_SMALL = "SI units, hub", "SI units, hub, 50 centres"
SI_RATES = "SI units, rate mode"
UNIT_SMALL = "gain 1, states, equal, 50 centres"
UNIT_EQUAL, UNIT_HUB = "gain 1, states, equal", "gain 1, states, hub"
SMALL_GAIN, SMALL_GAIN_HUB = "gain 0.3, states, equal", "gain 0.3, states, hub"
UNIT_INCREMENTS = "gain 1, changes, hub"
EQUAL, HUB_MODE = "changes, equal", "changes, hub"
HEAVY, HEAVIER = "changes, angles 8, panel 0.3", "changes, angles 20, panel 0.3"
UNIT_RATES = "gain 1, states, rate mode"
RATE_MODE = "changes, rate mode"
HUNDRED, FIFTY = f"{RATE_MODE}, 100 centres", f"{RATE_MODE}, 50 centres"
BILINEAR_RATES, AFFINE_RATES = "bilinear, rate mode", "affine, rate mode"
PROBED = 20
"""States at which sensitivities are asked for."""


class Probe(eqx.Module):
    """A flight, and how wrong the network was on the ground about what torques do.

    Attributes:
        flown: the flight.
        sensitivity: relative error of how the rates change with the torques, median over states.
    """

    flown: Flown
    sensitivity: Float[Array, ""]


class Samples(eqx.Module):
    """From a random key to samples, some of them held out, and keys of centres and noise: each rung trains its own network."""

    def __call__(self, key: Array) -> dict[str, Any]:
        learning, noise = split(key)
        own, sampling = jax.random.split(learning)
        testing = one_steps(jax.random.fold_in(learning, 1), samples=TESTED)
        return {
            "own": jax.random.key_data(own),
            "learning": one_steps(sampling, BOX),
            "noise": jax.random.key_data(noise),
            "testing": testing,
            "sensitivity": jax.vmap(rate_sensitivity)(testing.states[:PROBED], testing.controls[:PROBED]),
        }


class Rung(eqx.Module):
    """A contender: a network of its own, trained on the nominal spacecraft, and its inverse.

    Attributes:
        flight: that it flies.
        settings: of the controller.
        scale: of torques and states (15,).
        gain: on the scaled inputs.
        output_scale: units of the outputs (12,); those of the changes of the states if None.
        kind: of the features.
        centres: of a radial basis network.
        form: of the outputs.
    """

    flight: Flight
    settings: Settings
    scale: Float[Array, "15"]
    gain: Array
    output_scale: Float[Array, "12"] | None
    kind: Kind = eqx.field(static=True, default=RBF)
    centres: int = eqx.field(static=True, default=CENTRES)
    form: Literal["increment", "absolute"] = eqx.field(static=True, default="increment")

    def __call__(self, record: dict[str, Any]) -> Probe:
        key = jax.random.wrap_key_data(record["own"])
        network = network_of(self.kind, key, self.scale, self.gain, self.centres)
        learned = learn(network, record["learning"], form=self.form, output_scale=self.output_scale)
        found = sensitivity_error(learned, record["testing"], record["sensitivity"])
        return Probe(self.flight(self.settings.controller(learned), record["noise"]), found)


class RungMeasure(eqx.Module):
    """From a flight to the quantities, with what the network knew on the ground."""

    measure: Measure

    def __call__(self, record: Any, probe: Probe) -> dict[str, Array]:
        return self.measure(record, probe.flown) | {"sensitivity": probe.sensitivity}


def rungs() -> dict[str, Rung]:
    """All of them; the noise-free nominal spacecraft, with networks that go on learning."""
    flight, scale = Flight(plant(noise=0.0)), jnp.asarray(BOX.scale)
    one, ranges = jnp.ones_like(scale), scale[CONTROLS:]
    states, rates = state_command(), rate_command()
    panel = jnp.array([0.0] * 3 + [0.3] * 3 + [0.0] * 6)
    everything: dict[str, Any] = {"weights": NO_WEIGHTS, "output_weights": jnp.ones(12)}

    def rung(command: Any, gain: float, *, absolute: bool = False, si: bool = False, **options: Any) -> Rung:
        chosen = {key: options.pop(key) for key in ("weights", "output_weights") if key in options}
        units = (jnp.ones(12) if si else ranges) if absolute else None
        return Rung(
            flight,
            settings(command, learns=learning(), **chosen),
            one if si else scale,
            jnp.asarray(gain),
            units,
            form="absolute" if absolute else "increment",
            **options,
        )

    return {
        PRINTED: rung(states, 1.0, absolute=True, si=True, **everything),
        SI_HUB: rung(states, 1.0, absolute=True, si=True, weights=HUB),
        SI_SMALL: rung(states, 1.0, absolute=True, si=True, weights=HUB, centres=50),
        SI_RATES: rung(rates, 1.0, absolute=True, si=True),
        UNIT_SMALL: rung(states, 1.0, absolute=True, centres=50, **everything),
        UNIT_EQUAL: rung(states, 1.0, absolute=True, **everything),
        UNIT_HUB: rung(states, 1.0, absolute=True, weights=HUB),
        SMALL_GAIN: rung(states, GAIN, absolute=True, **everything),
        SMALL_GAIN_HUB: rung(states, GAIN, absolute=True, weights=HUB),
        UNIT_INCREMENTS: rung(states, 1.0, weights=HUB),
        EQUAL: rung(states, GAIN, **everything),
        HUB_MODE: rung(states, GAIN, weights=HUB),
        HEAVY: rung(states, GAIN, weights=HUB * _angles(8.0) + panel),
        HEAVIER: rung(states, GAIN, weights=HUB * _angles(20.0) + panel),
        UNIT_RATES: rung(rates, 1.0, absolute=True),
        RATE_MODE: rung(rates, GAIN),
        HUNDRED: rung(rates, GAIN, centres=100),
        FIFTY: rung(rates, GAIN, centres=50),
        BILINEAR_RATES: rung(rates, GAIN, kind=BILINEAR),
        AFFINE_RATES: rung(rates, GAIN, kind=AFFINE),
    }


def _angles(weight: float) -> Float[Array, "12"]:
    return jnp.array([weight] * 3 + [1.0] * 9)


def tables(outcome: Outcome) -> list[Table]:
    """The ladder."""
    chosen = ("sensitivity", "lost", "rms_roll", "rms_pitch", "rms_yaw", "peak_pitch")
    title = "The ladder: nominal spacecraft without noise, 90 s; medians over networks"
    return [outcome.table(LADDER, chosen, title=title)]


def figures(outcome: Outcome) -> list[Chart]:
    """What is lost, and the errors of what is not."""
    names = outcome.results[LADDER].experiment.contenders
    return [
        Chart(
            "What makes it fly",
            "Root mean square error of roll, median over networks: from the publication's reading at the top, inputs "
            "in SI units and states as outputs, to rate mode on the changes of the states, and below it smaller "
            "networks and regressions without kernels. Inputs are scaled with a gain of 0.3 unless another is said; "
            "weights are equal on all twelve states, on angles and rates of the hub, or as told. Above 100 mrad a "
            "flight is lost.",
            "RMS of roll",
            {name: outcome.median(LADDER, name, "rms_roll") for name in names},
            "mrad",
            log=True,
        )
    ]


def _median(
    contender: str, expected: Any, *, quantity: str = "rms_roll", what: str = "median RMS of roll [mrad]"
) -> Check:
    return Check(f"{what}, {contender}", lambda outcome: outcome.median(LADDER, contender, quantity), expected)


CLAIMS = (
    Claim(
        "as printed",
        "Inputs in SI units, states as outputs and R = lambda I fly the spacecraft.",
        "the equations, without scales or weights",
        tuple(lost(LADDER, name, below(0.5)) for name in (PRINTED, SI_HUB, SI_SMALL, SI_RATES)),
        {
            "not reproduced": "In SI units torques of 20 N m drown angles of 0.5 rad, and a state hides what a torque "
            "does to it in one sample: the sensitivities are wrong several times over."
        },
    ),
    Claim(
        "scales and increments",
        "Networks whose inputs are scaled and whose outputs are the changes of the state fly it.",
        "not in the publication",
        (
            *(lost(LADDER, name, below(0.2)) for name in (UNIT_INCREMENTS, EQUAL, HUB_MODE, RATE_MODE)),
            _median(RATE_MODE, below(0.1)),
            _median(HUB_MODE, below(0.1)),
        ),
    ),
    Claim(
        "kernels earn their keep",
        "A network of 200 radial basis functions tracks better than regressions on its inputs.",
        "in words",
        (
            all_axes_over(LADDER, RATE_MODE, BILINEAR_RATES, below(0.9)),
            all_axes_over(LADDER, RATE_MODE, AFFINE_RATES, below(0.9)),
        ),
        {
            "not reproduced": "An affine law with 16 weights per output does as well on these slews; the products matter when "
            "slews are fast, the kernels never did.",
            "partly": "Better than an affine law by a little; as good as the regression on the same products.",
        },
    ),
    Claim(
        "enough centres",
        "Fewer centres than lifted inputs lose accuracy.",
        "not in the publication, which does not say how many",
        (
            all_axes_over(LADDER, HUNDRED, RATE_MODE, above(1.5)),
            all_axes_over(LADDER, FIFTY, RATE_MODE, above(1.5)),
        ),
        {
            "reproduced": "With fewer than 122 the network represents a random part of what it should: it flies, several "
            "times worse."
        },
    ),
)


def chapter() -> Chapter:
    """From the publication's reading to what flies."""
    base = flown(LADDER, "The ladder", rungs(), simulate=Samples(), statistic="median")
    return Chapter((_probed(base),), CLAIMS, tables, figures)


def _probed(base: Experiment) -> Experiment:
    return dataclasses.replace(
        base,
        measure=RungMeasure(Measure(jnp.asarray(LATE))),
        quantities=(*base.quantities, Quantity("sensitivity", "sensitivity error", statistic="median")),
        trace=None,
    )
