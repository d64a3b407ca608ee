"""What an estimated fault is good for: the pointing of a controller that makes up for it."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ...control import EstimatedFaults
from ...estimates import Gaussian
from ...faults import FaultySignals, with_faults
from ...faults.modelling import FaultModel
from ...filters import extended_kalman_filter
from ...models.base import block_diagonal
from ...plants import RigidSpacecraft, fly, spacecraft_model, tracking_controller
from ...running.loop import Observer, Simulated
from ..chapter import Chapter
from ..claims import Check, Claim, below
from ..experiment import Experiment, Quantity
from ..figures import Chart, Figure, Line, Panel, Table
from ..outcome import Outcome
from .measures import rms
from .scenarios import DEGREE, END, ONSET, OUTPUTS, SCENARIOS, TORQUES, Scenario, injection, selected

RECONFIGURED = "reconfigured"
RAW, FILTERED, COMPENSATED = "raw readings", "filter in the loop", "fault made up for"
WAYS = (RAW, FILTERED, COMPENSATED)
SETTLED = 60.0  # s; ten seconds after the onset
SHOWN = 5
RUNS = 5
SIZES = tuple((scenario, signal) for scenario in SCENARIOS for signal in scenario.signals)


class Keys(eqx.Module):
    """From a random key to its data: each contender flies for itself, since it steers."""

    def __call__(self, key: Array) -> Array:
        return jax.random.key_data(key)


class Loop(eqx.Module):
    """A closed loop with a fault.

    Attributes:
        sizes: of each fault about each axis, in the unit of its state (k,).
        model: the filter's; faults that it holds for impossible have neither walk nor sigma.
        reconfigure: what is made up for.
        estimated: whether the controller follows the filter or the readings.
    """

    sizes: Float[Array, " k"]
    model: FaultModel
    reconfigure: EstimatedFaults
    estimated: bool = eqx.field(static=True)

    def __call__(self, data: Array) -> Simulated:
        craft = RigidSpacecraft()
        injected = tuple(
            injection(scenario.kind, signal, self.sizes[k], ONSET, END) for k, (scenario, signal) in enumerate(SIZES)
        )
        options = {"feedback": "estimate", "reconfigure": self.reconfigure} if self.estimated else {}
        return fly(
            craft,
            tracking_controller(craft, **options),
            key=jax.random.wrap_key_data(data),
            duration=END,
            actuator_fault=FaultySignals(TORQUES, injected),
            sensor_fault=FaultySignals(OUTPUTS, injected),
            observer=self._observer(craft) if self.estimated else None,
        )

    def _observer(self, craft: RigidSpacecraft) -> Observer:
        sigma = jnp.repeat(jnp.stack([jnp.asarray(craft.gyro_sigma), jnp.asarray(craft.star_tracker_sigma)]), 3)
        mean = jnp.concatenate([craft.truth(craft.init(), jnp.zeros(())), jnp.zeros(len(SIZES))])
        cov = block_diagonal([jnp.diag(sigma**2), jnp.diag(self.model.sigma**2)])
        return Observer(extended_kalman_filter(), self.model, Gaussian.start(mean, cov, self.model.space))


def model_of(scenario: Scenario) -> FaultModel:
    """The tuned filter's model of faults of a kind: it has states for those of the other kinds, and holds them for 0."""
    faults = [fault for each in SCENARIOS for fault in each.faults(each.tuned)]
    model = with_faults(spacecraft_model(RigidSpacecraft()), faults)
    own = own_of(scenario)
    where = lambda model: (model.walk, model.sigma)  # noqa: E731
    return eqx.tree_at(where, model, tuple(jnp.where(own, values, 0.0) for values in where(model)))


def own_of(scenario: Scenario) -> Bool[Array, " k"]:
    """Which of all faults are of a kind."""
    return jnp.asarray([each is scenario for each, _ in SIZES])


def contender(scenario: Scenario, way: str) -> Loop:
    """A loop with the fault of a scenario about x; loops that follow the filter share one compiled program."""
    names = spacecraft_model(RigidSpacecraft()).space.names
    rows = {each.kind: {f"{each.kind}_{s}": (k, 1.0) for k, s in enumerate(each.signals)} for each in SCENARIOS}
    states = (*names, *(name for each in rows.values() for name in each))
    full = EstimatedFaults.named(states, 3, offset=rows["offset"], loss=rows["loss"], gyro_bias=rows["bias"])
    share = float(way == COMPENSATED)
    used = EstimatedFaults(full.offset * share, full.loss * share, full.gyro_bias * share, full.bound)
    sizes = [each.size * each.scale * (each is scenario and signal == each.signals[0]) for each, signal in SIZES]
    return Loop(jnp.asarray(sizes), model_of(scenario), used, way != RAW)


class Measure(eqx.Module):
    """From a loop to its pointing."""

    def __call__(self, data: Array, flown: Simulated) -> dict[str, Array]:
        error, t = pointing(flown), flown.t
        return {"pointing": rms(error, selected(t, SETTLED, END))}


class Traces(eqx.Module):
    """From a loop to the series of the figure."""

    def __call__(self, data: Array, flown: Simulated) -> dict[str, Array]:
        return {"t": flown.t[::SHOWN], "pointing": pointing(flown)[::SHOWN]}


def pointing(flown: Simulated) -> Float[Array, " T"]:
    """Angle between the body and its target [deg]: the angles relative to the target are small."""
    return jnp.linalg.norm(flown.truth[:, 3:6], axis=1) / DEGREE


def named(scenario: Scenario, way: str) -> str:
    """A contender's name."""
    return f"{scenario.name}, {way}"


def tables(outcome: Outcome) -> list[Table]:
    """Pointing by fault and by what the controller does about it."""
    rows = tuple(
        (way, *(outcome.mean(RECONFIGURED, named(scenario, way), "pointing") for scenario in SCENARIOS)) for way in WAYS
    )
    heads = (f"{scenario.title.lower()} [deg]" for scenario in SCENARIOS)
    return [Table("Pointing error from 60 to 150 s, root mean square", ("the controller has", *heads), rows)]


def figures(outcome: Outcome) -> list[Figure | Chart]:
    """The pointing error of one flight per fault and way."""

    def line(scenario: Scenario, way: str) -> Line:
        trace = {what: outcome.trace(RECONFIGURED, named(scenario, way), what).first for what in ("t", "pointing")}
        return Line(way, trace["t"], trace["pointing"])

    return [
        Figure(
            "Making up for the fault",
            "Pointing error of one flight, logarithmic; the fault begins at 50 s. For wheels' faults it is not enough to know "
            "the state well: the controller must make up for the fault. The lines of a gyro's bias with the filter in the "
            "loop and with the fault made up for are the same, since the estimate of the rate is without it already.",
            tuple(
                Panel(scenario.title, tuple(line(scenario, way) for way in WAYS), "deg", log=True)
                for scenario in SCENARIOS
            ),
            telling=True,
        )
    ]


def _over_raw(scenario: Scenario, way: str, most: float) -> Check:
    return Check(
        f"pointing error, {way} over raw, {scenario.title.lower()}",
        lambda outcome: outcome.ratio(RECONFIGURED, "pointing", named(scenario, way), over=named(scenario, RAW)),
        below(most),
    )


CLAIMS = (
    Claim(
        "reconfiguration",
        "A controller that makes up for the estimated fault points at least ten times better than one that does not.",
        "not in the paper, which estimates only",
        tuple(_over_raw(scenario, COMPENSATED, 0.1) for scenario in SCENARIOS),
    ),
    Claim(
        "filter alone",
        "A filter that knows the fault, in the loop, makes up for it by itself.",
        "not in the paper",
        tuple(_over_raw(scenario, FILTERED, 0.1) for scenario in SCENARIOS),
        {"partly": "It does for a sensor; an actuator's fault acts on the body whatever is known of the state."},
    ),
)


def chapter() -> Chapter:
    """What an estimated fault is good for."""
    contenders = {named(scenario, way): contender(scenario, way) for scenario in SCENARIOS for way in WAYS}
    experiment = Experiment(
        RECONFIGURED,
        "Making up for the fault",
        Keys(),
        contenders,
        Measure(),
        (Quantity("pointing", "pointing error, 60 to 150 s", "deg"),),
        Traces(),
        most_runs=RUNS,
    )
    return Chapter((experiment,), CLAIMS, tables, figures)
