"""Who flies: inverses of networks that learn or not, and what they are compared with."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...control import (
    AbstractCommand,
    AbstractController,
    AdaptiveInverseController,
    AdaptiveReport,
    AngleState,
    ErrorStatistics,
    FollowReference,
    Guardrails,
    Inversion,
    QuinticSlews,
    RateCommand,
    SlewStates,
    StateSource,
)
from ...plants import ChangingPlant
from ...plants.flexible_spacecraft import MAX_TORQUE
from ...regression import WeightFilter
from ...running import simulate
from ...running.loop import Simulated
from .measures import Flown, angles_of
from .scenarios import BOX, GENTLE, NOMINAL, RATES, SHORT, STEP, Box
from .training import NOISE_VARIANCE, PRIOR_VARIANCE, RBF, STATES, Kind, Learned, trained

PANEL_GAIN = (0.03, 0.25, 0.07)  # 1/(m s)
ATTITUDE_GAIN = 1.0  # 1/s
BRAKING_SHARE = 0.2
"""Of the acceleration that the torque limit allows, with which a slew is slowed down."""
NO_BRAKING = 1e9  # rad/s^2
NEVER = 1e300
"""Variance of an output from which weights learn nothing."""
WALK = 1e-6
"""Variance that every weight gains per sample, where they are to follow the spacecraft."""
RATE = 0.02
"""Gain of the running mean of the model's error: a memory of 5 s."""
SWEEPS = 2
RATES_ONLY = jnp.array([0.0] * 6 + [1.0] * 3 + [0.0] * 3)
"""Weights of the states in rate mode."""
HUB = jnp.array([1.0] * 3 + [0.0] * 3 + [1.0] * 3 + [0.0] * 3)
"""Weights of the states in state mode: angles and rates of the hub."""
NO_WEIGHTS = jnp.zeros(STATES)
CONTROLLED = StateSource(convert=AngleState())
QUASI_STATIC = -NOMINAL.coupling / NOMINAL.modal_stiffness[:, None]
"""Deflection of each mode in an acceleration of the hub."""


class Networks(eqx.Module):
    """From a random key to the networks of a run and the noise of its flights.

    Attributes:
        kinds: of the networks.
        box: of the training set.
    """

    kinds: tuple[Kind, ...] = eqx.field(static=True, default=(RBF,))
    box: Box = eqx.field(static=True, default=BOX)

    def __call__(self, key: Array) -> dict[str, Any]:
        learning, noise = split(key)
        return {
            "noise": jax.random.key_data(noise),
            "networks": {kind: trained(kind, learning, self.box) for kind in self.kinds},
        }


def split(key: Array) -> tuple[Array, Array]:
    """Keys of a run's networks and of its noise."""
    learning, noise = jax.random.split(key)
    return learning, noise


class Flight(eqx.Module):
    """What is flown, and for how long.

    Attributes:
        plant: the spacecraft.
        slews: asked for.
        duration: [s].
    """

    plant: ChangingPlant
    slews: QuinticSlews = GENTLE
    duration: float = eqx.field(static=True, default=SHORT)

    def __call__(self, controller: AbstractController, noise: Array) -> Flown:
        """The flight of a controller with a key of noise, as key data."""
        key = jax.random.wrap_key_data(noise)
        flown = simulate(self.plant, controller, key=key, duration=self.duration, rates=RATES)
        return self._seen(flown)

    def _seen(self, flown: Simulated) -> Flown:
        told = flown.report if isinstance(flown.report, AdaptiveReport) else None
        rows = len(flown.t)
        return Flown(
            flown.t,
            angles_of(flown),
            jax.vmap(self.slews.angles)(flown.t),
            flown.truth[:, 7:10],
            jax.vmap(self.slews.target_rate)(flown.t),
            flown.truth[:, 4:7],
            flown.applied,
            self.plant.before.max_torque,  # type: ignore[attr-defined]  # a FlexibleSpacecraft
            jnp.full(rows, jnp.nan) if told is None else told.trace,
            jnp.zeros(rows, bool) if told is None else told.fallback,
        )


class Settings(eqx.Module):
    """Of an inverse controller. Those that differ in numbers only share one compiled program.

    Attributes:
        command: what is asked for one sample ahead.
        weights: of the states in SI units (12,).
        output_weights: of the states in units of the model's outputs, besides (12,).
        learning: the filter of the weights.
        statistics: of the model's error.
        compensated: 1 if its mean is taken off the target from the start, 0 if the mean begins at zero.
        guardrails: which there are.
        fallback: where they hand over to.
        method: of the inversion.
        sweeps: of the inversion.
    """

    command: AbstractCommand
    weights: Float[Array, "12"]
    output_weights: Float[Array, "12"]
    learning: WeightFilter
    statistics: ErrorStatistics
    compensated: Array
    guardrails: Guardrails
    fallback: AbstractController | None = None
    method: str = eqx.field(static=True, default="ekf")
    sweeps: int = eqx.field(static=True, default=SWEEPS)

    def controller(self, learned: Learned) -> AdaptiveInverseController:
        """The controller of a network."""
        model = learned.model
        inversion = Inversion(
            self.weights * model.output_scale**2 + self.output_weights,
            method=self.method,
            sweeps=self.sweeps,
            input_scale=model.network.lifting.scale[:3],  # type: ignore[attr-defined]  # a RadialBasisNetwork
            prior_variance=jnp.asarray(1.0),
            limit=jnp.asarray(MAX_TORQUE),
        )
        return AdaptiveInverseController(
            model,
            self.command,
            inversion,
            CONTROLLED,
            self.learning,
            learned.state,
            self.statistics,
            jax.tree.map(lambda leaf: self.compensated * leaf, learned.moments),
            self.guardrails,
            self.fallback,
        )


def rate_command(
    *,
    slews: QuinticSlews = GENTLE,
    panel_gain: tuple[float, float, float] = PANEL_GAIN,
    contraction: float = 1.0,
    braking: float | None = BRAKING_SHARE,
) -> RateCommand:
    """The virtual rate of the rate mode.

    Args:
        slews: asked for.
        panel_gain: of the modes [1/(m s)].
        contraction: share of the rate's error to be gone after a sample.
        braking: share of the acceleration that slows down; None for no braking curve.
    """
    strongest = MAX_TORQUE / jnp.diag(NOMINAL.inertia)
    return RateCommand(
        slews=slews,
        interval=STEP,
        attitude_gain=jnp.asarray(ATTITUDE_GAIN),
        panel_gain=jnp.asarray(panel_gain),
        quasi_static=QUASI_STATIC,
        braking=jnp.full(3, NO_BRAKING) if braking is None else braking * strongest,
        contraction=jnp.asarray(contraction),
    )


def state_command(slews: QuinticSlews = GENTLE) -> FollowReference:
    """The reference itself, all twelve states of it, for the state mode."""
    return FollowReference(reference=SlewStates(slews, NOMINAL.inertia, QUASI_STATIC, attitude="angles"), interval=STEP)


def learning(
    walk: float = 0.0, *, forgetting: float = 1.0, trace_cap: float = np.inf, frozen: bool = False
) -> WeightFilter:
    """The filter of the weights in flight.

    Args:
        walk: variance that every weight gains per sample.
        forgetting: how much a sample counts one later.
        trace_cap: of the covariance, beyond which nothing is forgotten.
        frozen: whether nothing is learned at all.
    """
    numbers = (PRIOR_VARIANCE, NEVER if frozen else NOISE_VARIANCE, forgetting, 0.0 if frozen else walk, trace_cap)
    return WeightFilter(*map(jnp.asarray, numbers), form="covariance")  # type: ignore[arg-type]  # arrays


FROZEN = learning(frozen=True)
TRACKING_WALK = learning(WALK)


def compensation(
    kind: str = "exponential", *, rate: float = RATE, variance: bool = False
) -> tuple[ErrorStatistics, float]:
    """Statistics of the model's error and whether they are used: "none", "mean" or "exponential".

    Args:
        kind: of the statistics.
        rate: gain of "exponential".
        variance: whether the variance counts in the inversion beside the mean.
    """
    used = 0.0 if kind == "none" else 1.0
    form = "mean" if kind == "mean" else "exponential"
    return ErrorStatistics(form, jnp.asarray(used * rate), jnp.asarray(200.0), counts=variance), used


def settings(
    command: AbstractCommand,
    *,
    weights: Float[Array, "12"] = RATES_ONLY,
    output_weights: Float[Array, "12"] = NO_WEIGHTS,
    learns: WeightFilter = TRACKING_WALK,
    compensated: tuple[ErrorStatistics, float] | None = None,
    guardrails: Guardrails | None = None,
    fallback: AbstractController | None = None,
    method: str = "ekf",
) -> Settings:
    """An inverse controller: by default as published but for what it tracks, without guards beyond the torque's limit."""
    statistics, used = compensation("none") if compensated is None else compensated
    return Settings(
        command,
        weights,
        output_weights,
        learns,
        statistics,
        jnp.asarray(used),
        Guardrails.none() if guardrails is None else guardrails,
        fallback,
        method,
    )


class Inverse(eqx.Module):
    """A contender: the inverse of one of the run's networks.

    Attributes:
        flight: that it flies.
        settings: of the controller.
        kind: of the network.
    """

    flight: Flight
    settings: Settings
    kind: Kind = eqx.field(static=True, default=RBF)

    def __call__(self, record: dict[str, Any]) -> Flown:
        return self.flight(self.settings.controller(record["networks"][self.kind]), record["noise"])


class Rival(eqx.Module):
    """A contender without a network.

    Attributes:
        flight: that it flies.
        controller: that flies it.
    """

    flight: Flight
    controller: AbstractController

    def __call__(self, record: dict[str, Any]) -> Flown:
        return self.flight(self.controller, record["noise"])
