"""Control by the inverse of a one-step model that goes on learning."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..errors import ConfigError, ShapeError
from ..identification import OneStepModel
from ..identification.one_step import linear
from ..regression import WeightFilter, WeightState
from ..running.plant import AbstractController, Reading
from .commands import AbstractCommand
from .compensation import ErrorMoments, ErrorStatistics
from .guardrails import Guardrails, weak_inputs
from .inversion import Inverse, Inversion
from .state_source import StateSource


class AdaptiveReport(eqx.Module):
    """What an adaptive inverse tells of itself after each sample; scaled outputs are those of its model.

    Attributes:
        state: that it acted on, predicted where it was not measured (n,).
        desired: state asked for one sample ahead (n,).
        innovation: scaled outputs less their prediction, before learning; NaN where nothing was compared (n,).
        bias: running mean of that, taken off the target (n,).
        residual: scaled target less what the inverse reached (n,).
        sensitivity: change of the scaled outputs with the input (n, m).
        trace: of the weights' covariance; NaN without learning.
        learned: whether the weights learned from this sample.
        extrapolating: whether the network is outside the range it knows.
        weak: inputs whose sensitivity is not believed, so that older weights act (m,).
        saturated: inputs at a limit of amplitude or step (m,).
        missing: samples in a row that were missing, in whole or in part.
        fallback: whether the fallback acts.
    """

    state: Float[Array, " n"]
    desired: Float[Array, " n"]
    innovation: Float[Array, " n"]
    bias: Float[Array, " n"]
    residual: Float[Array, " n"]
    sensitivity: Float[Array, "n m"]
    trace: Float[Array, ""]
    learned: Bool[Array, ""]
    extrapolating: Bool[Array, ""]
    weak: Bool[Array, " m"]
    saturated: Bool[Array, " m"]
    missing: Int[Array, ""]
    fallback: Bool[Array, ""]


class AdaptiveMemory(eqx.Module):
    """What an adaptive inverse remembers from one sample to the next.

    Attributes:
        learner: the weights and what is known of them; None without learning.
        weights: last ones whose sensitivity was believed; None without learning.
        believed: whether any were.
        nominal: sensitivity others are compared with (n, m).
        moments: of the model's error; None without compensation.
        asking: the command's.
        helping: the fallback's.
        state: of the last sample; NaN before the first.
        applied: input of the last sample, after all limits (m,).
        whole: whether the last state was measured in all its parts.
        offset: what is still added to the fallback's command (m,).
        report: of the last sample.
    """

    learner: WeightState | None
    weights: Float[Array, "l n"] | None
    believed: Bool[Array, ""]
    nominal: Float[Array, "n m"]
    moments: ErrorMoments | None
    asking: Any
    helping: Any
    state: Float[Array, " n"]
    applied: Float[Array, " m"]
    whole: Bool[Array, ""]
    offset: Float[Array, " m"]
    report: AdaptiveReport


class AdaptiveInverseController(AbstractController):
    """Asks a one-step model which input leads to the state that is wanted next, and teaches it what came of the last one.

    At each sample: what happened is compared with what the model said of it; the weights learn; running mean and variance
    of the error follow; the command names the next state; the inversion finds the input; the input is cut to the limits,
    applied and remembered as it was applied. What is taken off the target is the mean error, and its variance counts with
    that of the inversion.

    The weights of the inversion decide what is controlled. Given in the states' units, they are to be multiplied by the
    square of `model.output_scale`. Weight on the rates alone, with a `RateCommand`, is the loop to begin with; weight on many
    states is a compromise between them that only `one_step_gain` and `closed_loop_poles` tell to be stable.

    Readings that are missing are not learned from. The model predicts the parts of the state that are not there; after
    `guardrails.most_missing` samples the fallback takes over, with the readings there are: give one that can do without
    the sensors most likely to fail. Without a fallback the inverse goes on by itself, and where it finds no finite input
    the last one stays.

    Attributes:
        model: of the plant in the controller's state; learning needs a network that is linear in its weights.
        command: what is asked for.
        inversion: how the input is found, and its limits.
        source: where the state comes from; the readings by default.
        learning: the filter of the weights; the weights stay as they are by default.
        known: what it starts from, as the fit of the model left it; its prior by default.
        statistics: of the model's error; no compensation by default.
        moments: they start from; zero by default.
        guardrails: all on by default.
        fallback: controller that acts where this one may not; none by default.
        nominal: sensitivity of scaled outputs others are compared with (n, m); by default that of the first sample.

    Raises:
        ConfigError: learning with a network that is not linear in its weights, what learning starts from without learning,
            or the moments of an error without statistics.
        ShapeError: weights of the inversion that are not one per state.

    Source: Liu, Shen and Hu, Attitude control of nonlinear flexible structure based on inversion algorithm of extended
        Kalman filter of high-order neural networks; Behera, Gopal and Chaudhury (1996), IEEE Trans. Neural Networks
        7(6):1401-1414.
    Differs: the model may predict increments, its inputs are those applied, inputs are found together, and what is learned
        is watched.
    Reduces to: `IncrementalInversion`, with the frozen model `B u` and statistics of rate 1 whose variance is left out.
    """

    model: OneStepModel
    command: AbstractCommand
    inversion: Inversion
    source: StateSource = StateSource()
    learning: WeightFilter | None = None
    known: WeightState | None = None
    statistics: ErrorStatistics | None = None
    moments: ErrorMoments | None = None
    guardrails: Guardrails = Guardrails()
    fallback: AbstractController | None = None
    nominal: Float[Array, "n m"] | None = None

    def __check_init__(self) -> None:
        if self.known is not None and self.learning is None:
            raise ConfigError("known: expected together with learning, got it alone")
        if self.learning is not None:
            linear(self.model.network)
        if self.moments is not None and self.statistics is None:
            raise ConfigError("moments: expected together with statistics, got them alone")
        if self.inversion.weights.shape[-1] != self.model.states:
            raise ShapeError(
                f"inversion: expected {self.model.states} weights, one per state, "
                f"got shape {self.inversion.weights.shape}"
            )

    def init(self) -> AdaptiveMemory:
        n, m = self.model.states, self.model.controls
        learner = None
        if self.learning is not None:
            weights = linear(self.model.network).weights
            learner = self.known
            if learner is None:
                learner = eqx.tree_at(lambda state: state.weights, self.learning.init(*weights.shape), weights)
        moments = None
        if self.statistics is not None:
            moments = self.statistics.init(n) if self.moments is None else self.moments
        unknown, no, zero = jnp.full(n, jnp.nan), jnp.asarray(False), jnp.zeros(m)
        report = AdaptiveReport(
            unknown,
            unknown,
            unknown,
            unknown,
            unknown,
            jnp.full((n, m), jnp.nan),
            jnp.asarray(jnp.nan),
            no,
            no,
            zero > 0,
            zero > 0,
            jnp.zeros((), int),
            no,
        )
        return AdaptiveMemory(
            learner,
            None if learner is None else learner.weights,
            no,
            jnp.full((n, m), jnp.nan) if self.nominal is None else jnp.asarray(self.nominal, float),
            moments,
            self.command.init(),
            None if self.fallback is None else self.fallback.init(),
            unknown,
            zero,
            no,
            zero,
            report,
        )

    def report(self, carry: AdaptiveMemory) -> AdaptiveReport:
        return carry.report

    def act(
        self, carry: AdaptiveMemory, t: Float[Array, ""], reading: Reading
    ) -> tuple[AdaptiveMemory, Float[Array, " m"]]:
        x, whole = self._state(carry, reading)
        known, learner, moments, innovation = self._learn(carry, x, whole)
        model, weights, believed, nominal, weak = self._believe(carry, learner, x)
        asking, desired = self.command.desired(carry.asking, t, x)
        bias = jnp.zeros_like(x) if moments is None else moments.mean
        inverse = self.inversion(
            lambda u: model.outputs(x, u),
            model.targets(x, desired) - bias,
            carry.applied,
            variance=None if moments is None else self.statistics.counted(moments),  # type: ignore[union-attr]
        )
        missing = jnp.where(whole, 0, carry.report.missing + 1)
        lost = ~jnp.all(jnp.isfinite(inverse.u))
        wanted = lost | self.guardrails.overdue(missing) | (jnp.any(weak) & ~believed)
        wanted = wanted | self.guardrails.far_off(self.command.error(t, x), carry.report.fallback)
        applied, helping, offset, fallen = self._hand_over(carry, t, reading, inverse, wanted)
        report = AdaptiveReport(
            x,
            desired,
            innovation,
            bias,
            inverse.residual,
            inverse.sensitivity,
            jnp.asarray(jnp.nan) if learner is None else learner.trace,
            known & (learner is not None),
            ~model.contains(x, applied),
            weak,
            inverse.saturated,
            missing,
            fallen,
        )
        return AdaptiveMemory(
            learner, weights, believed, nominal, moments, asking, helping, x, applied, whole, offset, report
        ), applied

    def _model(self, weights: Array | None) -> OneStepModel:
        return self.model if weights is None else self.model.with_weights(weights)

    def _state(self, carry: AdaptiveMemory, reading: Reading) -> tuple[Array, Array]:
        """The state, and whether all of it was measured; the model stands in for what was not."""
        fresh = self.source.fresh(reading)
        predicted = self._model(carry.weights)(carry.state, carry.applied)
        if carry.moments is not None:
            predicted = predicted + self.model.output_scale * carry.moments.mean
        begun = jnp.all(jnp.isfinite(carry.state))
        stand_in = jnp.where(begun, predicted, self.source(reading))
        return jnp.where(jnp.isfinite(fresh), fresh, stand_in), jnp.all(jnp.isfinite(fresh))

    def _learn(
        self, carry: AdaptiveMemory, x: Array, whole: Array
    ) -> tuple[Array, WeightState | None, ErrorMoments | None, Array]:
        usable = whole & carry.whole
        if self.guardrails.extrapolation:
            usable = usable & self.model.contains(carry.state, carry.applied)
        last = jnp.where(usable, carry.state, 0.0)
        y = self.model.targets(last, x)
        learner = carry.learner
        if learner is None or self.learning is None:
            error = jnp.where(usable, y - self.model.outputs(last, carry.applied), jnp.nan)
        else:
            phi = self.model.features(last, carry.applied)
            # The filter passes over rows that are not finite.
            learner, error = self.learning.update(learner, phi, jnp.where(usable, y, jnp.nan))
        moments = carry.moments
        if moments is not None and self.statistics is not None:
            compared = jnp.all(jnp.isfinite(error))
            after = self.statistics.update(moments, jnp.where(compared, error, 0.0))
            moments = jax.tree.map(lambda new, old: jnp.where(compared, new, old), after, moments)
        return usable, learner, moments, error

    def _believe(
        self, carry: AdaptiveMemory, learner: WeightState | None, x: Array
    ) -> tuple[OneStepModel, Array | None, Array, Array, Array]:
        """The model to act by, its weights, whether any were believed, the nominal sensitivity, and the weak inputs."""
        weights = None if learner is None else learner.weights
        none = jnp.zeros(self.model.controls, bool)
        if self.guardrails.least_sensitivity is None:
            return self._model(weights), weights, jnp.asarray(True), carry.nominal, none
        new = self._model(weights)
        H = jax.jacfwd(lambda u: new.outputs(x, u))(carry.applied)
        nominal = jnp.where(jnp.any(jnp.isnan(carry.nominal)), H, carry.nominal)
        W = self.inversion.weights
        W = jnp.diag(W) if W.ndim == 1 else W
        weak = weak_inputs(H, nominal, W, self.guardrails.least_sensitivity)
        sound = ~jnp.any(weak)
        if weights is not None and carry.weights is not None:
            weights = jnp.where(sound, weights, carry.weights)
        return self._model(weights), weights, carry.believed | sound, nominal, weak

    def _hand_over(
        self, carry: AdaptiveMemory, t: Array, reading: Reading, inverse: Inverse, wanted: Array
    ) -> tuple[Array, Any, Array, Array]:
        """What is applied, the fallback's memory, what is added to its command, and whether it acts."""
        if self.fallback is None:
            found = jnp.all(jnp.isfinite(inverse.u))
            return jnp.where(found, inverse.u, carry.applied), None, carry.offset, jnp.asarray(False)
        helping, command = self.fallback.act(carry.helping, t, reading)
        fading = carry.offset * jnp.exp(-self.command.interval / self.guardrails.settling)
        offset = jnp.where(carry.report.fallback, fading, carry.applied - command)
        helped = command + offset
        if self.inversion.limit is not None:
            helped = jnp.clip(helped, -self.inversion.limit, self.inversion.limit)
        return jnp.where(wanted, helped, inverse.u), helping, jnp.where(wanted, offset, 0.0), wanted
