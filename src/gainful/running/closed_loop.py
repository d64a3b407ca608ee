"""A plant, its controller and, if asked for, an estimator between them, each at its own rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..errors import ConfigError, ShapeError
from ..filters import Info
from ..models import Instant, Sample
from ..spaces import AbstractSpace
from .loop import Fault, Observer, Rates, Simulated, no_fault
from .plant import AbstractController, AbstractPlant, Reading


class _Interval(eqx.Module):
    """What has been told and applied since the last time something was due."""

    monitored: Array
    total: Array
    ticks: Array

    def applied(self) -> Array:
        return self.total / jnp.maximum(self.ticks, 1)

    def after(self, applied: Array) -> _Interval:
        return _Interval(self.monitored, self.total + applied, self.ticks + 1)


class _Loop(eqx.Module):
    """What goes from one tick to the next."""

    state: Any
    controller: Any
    command: Array
    held: Array
    measured: _Interval
    estimated: _Interval
    observer: Any
    info: Info | None


def simulate(
    plant: AbstractPlant,
    controller: AbstractController,
    *,
    key: Array,
    duration: float,
    rates: Rates | None = None,
    actuator_fault: Fault = no_fault,
    sensor_fault: Fault = no_fault,
    observer: Observer | None = None,
) -> Simulated:
    """A closed loop from 0 to `duration`: pure, so `jit` and `vmap` over keys, plants or faults apply.

    At a moment the sensors are read, then the estimator steps, then the controller acts, each if it is due; the plant
    then moves with the command held. The estimator is told the command as the actuators could carry it out, not what a
    fault makes of it; where its step and a reading do not fall together it predicts alone.

    Args:
        plant: the truth.
        controller: turns readings into commands.
        key: random key; the same key draws the same noise whatever the faults.
        duration: time simulated [s], a whole number of readings.
        rates: how often each happens; 0.01 s, 0.05 s, 0.1 s and 0.05 s by default.
        actuator_fault: what the actuators do in place of the applied command, a function of both it and the time [s].
        sensor_fault: what a reading is in place of itself, likewise; NaN takes a component away.
        observer: an estimator whose reports the controller may use.

    Raises:
        ConfigError: a duration that is not a whole number of readings.
        ShapeError: a model in the observer whose output or inputs are not the plant's.
    """
    rates = Rates() if rates is None else rates
    tick = math.gcd(rates.measure, rates.control, *([] if observer is None else [rates.estimate]))
    rows = _whole(duration, rates.step * rates.measure)
    ticks = rows * rates.measure // tick
    length = tick * rates.step
    due = {name: getattr(rates, name) // tick for name in ("measure", "control", "estimate")}
    start = _start(plant, controller, observer, key)

    def follow(loop: _Loop, given: tuple[Array, Array]) -> tuple[_Loop, Simulated]:
        k, own = given
        t = k * length
        monitored = plant.monitor(loop.state)
        sound = plant.read(loop.state, t, own[0])
        y = sensor_fault(sound, t)
        known = _known(plant.output, y)
        measuring = _is_due(k, due["measure"])
        # Something stands in for a component that a fault takes away from the start.
        held = jnp.where(measuring & known, y, jnp.where(k == 0, sound, loop.held))
        observed, info, estimated = loop.observer, loop.info, loop.estimated
        if observer is not None:
            estimating = _is_due(k, due["estimate"])
            when = Instant(t, estimated.ticks * length, plant.inputs(estimated.monitored, estimated.applied()))
            sample = Sample(when, held, _degrees(plant.output, known) & measuring)
            observed, info = _when(estimating, _estimator_step(observer, sample), (observed, info))
            estimated = _restarted(estimating, estimated, monitored)
        reading, memory = Reading(held, monitored, info, measuring & known), (loop.controller, loop.command)
        acting = _is_due(k, due["control"])
        memory, command = _when(acting, lambda memory: controller.act(memory[0], t, reading), memory)
        past = loop.measured.applied()
        row = Simulated(
            t,
            plant.truth(loop.state, t),
            y,
            plant.inputs(loop.measured.monitored, past),
            command,
            past,
            loop.state,
            info,
            controller.report(memory),
        )
        state, applied = _advance(plant, loop.state, command, actuator_fault, t, rates.step, own[1:])
        measured = _restarted(measuring, loop.measured, monitored).after(applied)
        return _Loop(state, memory, command, held, measured, estimated.after(applied), observed, info), row

    keys = jax.random.split(key, (ticks + 1, tick + 1))
    _, out = jax.lax.scan(follow, start, (jnp.arange(ticks + 1), keys))
    return jax.tree.map(lambda values: values[:: due["measure"]], out)


def _whole(duration: float, interval: float) -> int:
    rows = round(duration / interval) if duration >= 0 and math.isfinite(duration) else -1
    if rows < 0 or abs(rows * interval - duration) > 1e-6 * interval:
        raise ConfigError(f"duration: expected a whole number of readings of {interval:g} s, got {duration!r} s")
    return rows


def _start(plant: AbstractPlant, controller: AbstractController, observer: Observer | None, key: Array) -> _Loop:
    state, memory, zero = plant.init(), controller.init(), jnp.zeros(())
    monitored = plant.monitor(state)
    shape = eqx.filter_eval_shape(plant.read, state, zero, key)
    held = jnp.zeros(shape.shape, shape.dtype)
    carry = info = None
    if observer is not None:
        carry = observer.estimator.init(observer.model, observer.prior)
        info = _blank_report(plant, observer, carry, held)
    blank = Reading(held, monitored, info, jnp.zeros(held.shape, bool))
    shape = eqx.filter_eval_shape(controller.act, memory, zero, blank)[1]
    command = jnp.zeros(shape.shape, shape.dtype)
    if observer is not None:
        told = plant.inputs(monitored, command).shape
        if told != (len(observer.model.inputs),):
            raise ShapeError(f"observer: expected a model of {told[0]} inputs, got {len(observer.model.inputs)}")
    interval = _Interval(monitored, jnp.zeros_like(command), jnp.zeros((), int))
    return _Loop(state, memory, command, held, interval, interval, carry, info)


def _blank_report(plant: AbstractPlant, observer: Observer, carry: Any, y: Array) -> Info:
    """Zeros of the form of a report: the estimator steps before anybody reads one."""
    model, zero = observer.model, jnp.zeros(())
    if model.output.names != plant.output.names:
        raise ShapeError(
            f"observer: expected a model of the readings {', '.join(plant.output.names)}, "
            f"got {', '.join(model.output.names)}"
        )
    sample = Sample(Instant(zero, zero, jnp.zeros(len(model.inputs))), y, jnp.zeros(model.output.dof, bool))
    report = eqx.filter_eval_shape(observer.estimator.step, model, carry, sample)[1]
    return jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), report)


def _estimator_step(observer: Observer, sample: Sample) -> Callable[[tuple[Any, Any]], tuple[Any, Info]]:
    return lambda memory: observer.estimator.step(observer.model, memory[0], sample)


def _is_due(k: Array, every: int) -> Any:
    return True if every == 1 else k % every == 0


def _when(due: Any, fn: Callable[[Any], Any], memory: Any) -> Any:
    """`fn(memory)` where due, the memory as it is elsewhere."""
    return fn(memory) if due is True else jax.lax.cond(due, fn, lambda kept: kept, memory)


def _restarted(due: Any, interval: _Interval, monitored: Array) -> _Interval:
    fresh = _Interval(monitored, jnp.zeros_like(interval.total), jnp.zeros_like(interval.ticks))
    return jax.tree.map(lambda new, old: jnp.where(due, new, old), fresh, interval)


def _advance(
    plant: AbstractPlant, state: Any, command: Array, fault: Fault, t: Array, dt: float, keys: Array
) -> tuple[Any, Array]:
    """The state some simulation steps later, and the mean of what the actuators were set to."""

    def move(carry: tuple[Any, Array], given: tuple[Array, Array]) -> tuple[tuple[Any, Array], None]:
        (state, total), (k, own) = carry, given
        now = t + k * dt
        applied = plant.limit(state, command, dt)
        return (plant.advance(state, fault(applied, now), now, dt, own), total + applied), None

    steps = keys.shape[0]
    (state, total), _ = jax.lax.scan(move, (state, jnp.zeros_like(command)), (jnp.arange(steps), keys))
    return state, total / steps


def _known(space: AbstractSpace, y: Array) -> Bool[Array, " size"]:
    """Which coordinates of a reading are there; a quaternion is there as a whole or not at all."""
    pieces, i = [], 0
    for part in space.parts:
        finite = jnp.isfinite(y[i : i + part.size])
        pieces.append(finite if part.size == part.dof else jnp.full_like(finite, jnp.all(finite)))
        i += part.size
    return jnp.concatenate(pieces)


def _degrees(space: AbstractSpace, known: Bool[Array, " size"]) -> Bool[Array, " dof"]:
    """The same per degree of freedom."""
    pieces, i = [], 0
    for part in space.parts:
        pieces.append(known[i : i + part.dof])
        i += part.size
    return jnp.concatenate(pieces)
