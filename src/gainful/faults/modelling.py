"""Faults of actuators and sensors as states of a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError
from ..estimates import AbstractEstimate, Gaussian
from ..linalg import product
from ..models import AbstractModel, Instant
from ..models.base import block_diagonal
from ..models.extended import AbstractExtendedModel
from ..models.model import unknown_name
from ..spaces import AbstractSpace, Circle, Euclidean, Product
from .description import EFFECTS, Fault


class FaultModel(AbstractExtendedModel):
    """A model whose state ends with the sizes of its `k` faults and the rates of those that drift; made by `with_faults`.

    Attributes:
        base: the model without faults.
        walk: sigma of the random walk of each size and rate, per square root of a second or per step (q,).
        fading: how fast each fault fades by itself [1/s]; 0 for one that stays (k,).
        sigma: standard deviation of each size and rate before the first row; NaN where none was stated (q,).
        bound: largest physical size of each, infinite for rates (q,).
        kinds: "offset", "loss", "bias" or "scale".
        rows: the input each is in, or the output's degree of freedom.
        places: the same, counted in the numbers that store a point.
        per_step: whether the walk of each one's size is per step.
        drifting: which faults have a rate, counted from 0.
    """

    base: AbstractModel
    walk: Float[Array, " q"]
    fading: Float[Array, " k"]
    sigma: Float[Array, " q"]
    bound: Float[Array, " q"]
    space: AbstractSpace
    output: AbstractSpace
    inputs: tuple[str, ...] = eqx.field(static=True)
    input_units: tuple[str, ...] = eqx.field(static=True)
    parameters: dict[str, Array]
    kinds: tuple[str, ...] = eqx.field(static=True)
    rows: tuple[int, ...] = eqx.field(static=True)
    places: tuple[int, ...] = eqx.field(static=True)
    per_step: tuple[bool, ...] = eqx.field(static=True)
    drifting: tuple[int, ...] = eqx.field(static=True, default=())

    @property
    def fault_names(self) -> tuple[str, ...]:
        """Names of the fault states, in order: the sizes, then the rates."""
        return self.space.names[self.base.space.size :]

    @property
    def bounds(self) -> dict[str, float]:
        """Largest size of each fault that has one, by the name of its state, as banks and adaptive updates take it."""
        return {n: float(b) for n, b in zip(self.fault_names, self.bound, strict=True) if math.isfinite(float(b))}

    @property
    def noise_takes_dt(self) -> bool:
        return self.base.noise_takes_dt and not any(self.per_step)

    def without_walk(self) -> FaultModel:
        """The model of faults that do not change by chance."""
        return eqx.tree_at(lambda model: model.walk, self, jnp.zeros_like(self.walk))

    def _added(self, side: str, values: Array, sizes: Array, count: int) -> Array | None:
        """What the faults of one side add to its signals (count,); None if it has no faults."""
        terms: list[Any] = [None] * count
        for i, (kind, row, place) in enumerate(zip(self.kinds, self.rows, self.places, strict=True)):
            where, gain = EFFECTS[kind]
            if where == side:
                term = sizes[i] if gain == 0 else gain * sizes[i] * values[place]
                terms[row] = term if terms[row] is None else terms[row] + term
        if all(term is None for term in terms):
            return None
        zero = jnp.zeros((), values.dtype)
        return jnp.stack([zero if term is None else term for term in terms])

    def _split(self, x: Array, when: Instant) -> tuple[Array, Array, Instant]:
        """The base state, the sizes and rates of the faults, and the moment with what the plant really gets."""
        state, faults = x[: self.base.space.size], x[self.base.space.size :]
        added = self._added("input", when.u, faults, len(self.inputs))
        return state, faults, when if added is None else Instant(when.t, when.dt, when.u + added)

    def transition(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " size"]:
        state, faults, then = self._split(x, when)
        count = len(self.kinds)
        sizes, rates = jnp.exp(-self.fading.astype(x.dtype) * when.dt) * faults[:count], faults[count:]
        if self.drifting:
            sizes = sizes.at[np.asarray(self.drifting)].add(when.dt * rates)
        return jnp.concatenate([self.base.transition(state, then), sizes, rates])

    def process_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "dof dof"]:
        state, _, then = self._split(x, when)
        spent = 2 * self.fading.astype(x.dtype) * when.dt
        fading = spent > 0
        seconds = when.dt * jnp.where(fading, -jnp.expm1(-spent) / jnp.where(fading, spent, 1.0), 1.0)
        steps = jnp.where(when.dt > 0, jnp.ones_like(seconds), jnp.zeros_like(seconds))
        variance = self.walk.astype(x.dtype) ** 2
        count = len(self.kinds)
        noise = jnp.diag(variance[:count] * jnp.where(np.asarray(self.per_step), steps, seconds))
        if self.drifting:
            # The integral of a random walk and the walk itself: [dt^3 / 3, dt^2 / 2; dt^2 / 2, dt].
            which = jnp.eye(count, dtype=x.dtype)[:, np.asarray(self.drifting)]
            own, across = product(which * variance[count:], which.T), which * variance[count:] * when.dt**2 / 2
            rates = jnp.diag(variance[count:]) * when.dt
            noise = jnp.block([[noise + own * when.dt**3 / 3, across], [across.T, rates]])
        return block_diagonal([self.base.process_noise(state, then), noise])

    def observe(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " output_size"]:
        state, sizes, then = self._split(x, when)
        y = self.base.observe(state, then)
        added = self._added("output", y, sizes, self.output.dof)
        return y if added is None else self.output.plus(y, added)

    def measurement_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "output_dof output_dof"]:
        state, _, then = self._split(x, when)
        return self.base.measurement_noise(state, then)


def with_faults(model: AbstractModel, faults: Sequence[Fault]) -> FaultModel:
    """The model with the sizes of some faults estimated as further states, after its own; then the rates of those that drift.

    A fault of the state before an interval acts on that interval: an input's fault found at row `k` moved the state
    from row `k - 1` on. Faults of one signal add up, each acting on the sound value.

    Args:
        model: the model to extend.
        faults: what may go wrong, such as `loss_of_effectiveness("wheel_x", walk=2e-4)`.

    Raises:
        ModelError: an unknown signal, a scale error of something else than a number or an angle, the same fault twice,
            or none at all.

    Source: Friedland (1969), IEEE Trans. Autom. Control 14(4):359-367, for constant biases.

    Example:
        >>> from gainful.faults import actuator_offset, sensor_bias
        >>> from gainful.models import linear_model
        >>> model = linear_model([[1.0]], [[1.0]], B=[[0.1]], Q=0.1, R=1.0, states=["x"], inputs={"wheel": "N*m"})
        >>> with_faults(model, [actuator_offset("wheel", walk=2e-5), sensor_bias("y0")]).space.names
        ('x', 'offset_wheel', 'bias_y0')
    """
    faults = tuple(faults)
    if not faults:
        raise ModelError("faults: expected at least one, got none")
    taken, rows, places, units = set(model.space.names), [], [], []
    for fault in faults:
        if not isinstance(fault, Fault):
            raise ModelError(f"faults: expected Fault, got {type(fault).__name__}")
        for name in fault.names:
            if name in taken:
                raise ModelError(f"faults: {name!r} is already a state of the model")
            taken.add(name)
        row, place, unit = _place(model, fault)
        rows.append(row)
        places.append(place)
        units.append(unit)
    drifting = tuple(i for i, fault in enumerate(faults) if fault.drifts)
    names = [fault.name for fault in faults] + [faults[i].names[1] for i in drifting]
    units += [f"{units[i]}/s" for i in drifting]
    sigma = [fault.sigma for fault in faults] + [faults[i].rate_sigma for i in drifting]
    return FaultModel(
        base=model,
        walk=jnp.asarray([float(fault.walk) for fault in faults] + [float(faults[i].rate_walk) for i in drifting]),
        fading=jnp.asarray([1 / fault.time_constant for fault in faults]),
        sigma=jnp.asarray([math.nan if value is None else float(value) for value in sigma]),
        bound=jnp.asarray([float(fault.largest) for fault in faults] + [math.inf] * len(drifting)),
        space=Product([model.space, Euclidean(tuple(names), tuple(units))], added=model.space.added + len(names)),
        output=model.output,
        inputs=model.inputs,
        input_units=model.input_units,
        parameters=model.parameters,
        kinds=tuple(fault.kind for fault in faults),
        rows=tuple(rows),
        places=tuple(places),
        per_step=tuple(fault.per_step for fault in faults),
        drifting=drifting,
    )


def _place(model: AbstractModel, fault: Fault) -> tuple[int, int, str]:
    """Where a fault acts: row among the inputs or the output's degrees of freedom, place in the point, and its unit."""
    side, gain = EFFECTS[fault.kind]
    known = model.inputs if side == "input" else model.output.tangent_names
    if fault.signal not in known:
        raise unknown_name(f"{fault.kind}: {side}", fault.signal, known)
    row = known.index(fault.signal)
    if side == "input":
        return row, row, "1" if gain else model.input_units[row]
    part, place = part_at(model.output, row)
    if gain and not isinstance(part, (Euclidean, Circle)):
        raise ModelError(f"scale of {fault.signal!r}: expected a plain number or an angle, got a {type(part).__name__}")
    return row, place, "1" if gain else model.output.tangent_units[row]


def part_at(space: AbstractSpace, row: int) -> tuple[AbstractSpace, int]:
    """The indivisible space that a degree of freedom belongs to, and its place in the point where that is one number."""
    i = j = 0
    for part in space.parts:
        if row < j + part.dof:
            return part, i + row - j if part.size == part.dof else i
        i, j = i + part.size, j + part.dof
    raise IndexError(row)


def extend_prior(model: FaultModel, prior: AbstractEstimate) -> Gaussian:
    """The estimate before the first row with faults added: none is expected, each is uncertain by its `sigma`.

    Args:
        model: with faults, each with a `sigma`.
        prior: of the model without them.

    Raises:
        ShapeError: a prior of another model.
        ModelError: a fault without `sigma`.
    """
    if prior.space.names != model.base.space.names:
        expected, given = ", ".join(model.base.space.names), ", ".join(prior.space.names)
        raise ShapeError(f"prior: expected the states {expected}, got {given}")
    sigma = np.asarray(model.sigma)
    for name, value in zip(model.fault_names, sigma, strict=True):
        if np.isnan(value):
            raise ModelError(f"sigma of {name!r}: missing; state it in the fault, or make the prior with make_prior")
    mean = jnp.concatenate([prior.mean, jnp.zeros(len(sigma), prior.mean.dtype)])
    return Gaussian.start(
        mean, block_diagonal([prior.cov, jnp.diag(jnp.asarray(sigma, prior.mean.dtype) ** 2)]), model.space
    )


def base_prior(model: FaultModel, prior: AbstractEstimate) -> Gaussian:
    """What a prior says of the states without the faults."""
    size, dof = model.base.space.size, model.base.space.dof
    return Gaussian.start(prior.mean[:size], prior.cov[:dof, :dof], model.base.space)
