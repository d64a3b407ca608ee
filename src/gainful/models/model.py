"""The model built from dynamics and sensors, and the functions that build it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..errors import ModelError, ShapeError, did_you_mean
from ..linalg import check_covariance
from ..spaces import AbstractSpace, Product, SpaceLike, make_space
from .base import AbstractModel, Instant, block_diagonal
from .dynamics import AbstractDynamics, ContinuousDynamics, DiscreteDynamics, LinearDynamics
from .functions import Function, Matrix, Sensor, as_point, at, make_sensors


class Model(AbstractModel):
    """Dynamics and sensors together; made by `discrete_model`, `continuous_model` or `linear_model`."""

    space: AbstractSpace
    output: AbstractSpace
    inputs: tuple[str, ...] = eqx.field(static=True)
    input_units: tuple[str, ...] = eqx.field(static=True)
    parameters: dict[str, Array]
    dynamics: AbstractDynamics
    sensor_parts: tuple[Sensor, ...]

    @property
    def sensors(self) -> tuple[tuple[str, int], ...]:
        return tuple((part.name, part.output.dof) for part in self.sensor_parts)

    @property
    def takes_dt(self) -> bool:
        return self.dynamics.takes_dt

    @property
    def noise_takes_dt(self) -> bool:
        return self.dynamics.noise_takes_dt

    def with_parameters(self, values: dict[str, Array]) -> Model:
        return eqx.tree_at(lambda model: model.parameters, self, self.parameters | values)

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        return self.dynamics.cautions(x)

    def transition(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " size"]:
        moved = self.dynamics.move(self.space, x, when, self.parameters)
        return jnp.where(when.dt > 0, moved, x)

    def process_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "dof dof"]:
        noise = self.dynamics.noise(self.space, x, when, self.parameters)
        return jnp.where(when.dt > 0, noise, jnp.zeros_like(noise))

    def observe(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " output_size"]:
        arguments = at(when, x, self.parameters)
        readings = [as_point(s.h(*arguments), s.output.size, x.dtype, _role("h", s, self)) for s in self.sensor_parts]
        return readings[0] if len(readings) == 1 else jnp.concatenate(readings)

    def measurement_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "output_dof output_dof"]:
        arguments = at(when, x, self.parameters)
        blocks = []
        for part in self.sensor_parts:
            block = part.noise(*arguments)
            if block.shape == (1, 1) and part.output.dof > 1:
                block = block[0, 0] * jnp.eye(part.output.dof, dtype=block.dtype)
            if block.shape != (part.output.dof, part.output.dof):
                raise ModelError(
                    f"{_role('R', part, self)}: expected shape ({part.output.dof}, {part.output.dof}), got {block.shape}"
                )
            blocks.append(block)
        return block_diagonal(blocks)


def _role(letter: str, part: Sensor, model: Model) -> str:
    return letter if len(model.sensor_parts) == 1 else f"{letter} of sensor {part.name!r}"


def _inputs(inputs: SpaceLike | int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if isinstance(inputs, (int, Sequence, Mapping)) and (inputs == 0 or (not isinstance(inputs, int) and not inputs)):
        return (), ()
    space = make_space(inputs, prefix="u")
    return space.names, space.units


def _parameters(parameters: Mapping[str, Any] | None) -> dict[str, Array]:
    out = {}
    for name, value in (parameters or {}).items():
        try:
            out[name] = jnp.asarray(value, dtype=float)
        except (TypeError, ValueError) as problem:
            raise ModelError(f"parameter {name!r}: expected a number, got {value!r}") from problem
    return out


def _assemble(
    states: SpaceLike,
    inputs: SpaceLike | int,
    dynamics: AbstractDynamics,
    parts: tuple[Sensor, ...],
    parameters: Mapping[str, Any] | None,
) -> Model:
    space = make_space(states, prefix="x")
    output = parts[0].output if len(parts) == 1 else Product([part.output for part in parts])
    names, units = _inputs(inputs)
    clash = (set(space.names) | set(output.names)) & set(parameters or {})
    if clash:
        raise ModelError(f"parameters: {sorted(clash)[0]!r} is already the name of a state or an output")
    model = Model(space, output, names, units, _parameters(parameters), dynamics, parts)
    _check_constant_noise(model)
    return model


def _check_constant_noise(model: Model) -> None:
    """Refuse noise given as numbers that is no covariance; noise given as functions is checked when a record is run."""
    constant = [(_role("R", part, model), part.noise, part.output) for part in model.sensor_parts]
    gain, noise = model.dynamics.G, model.dynamics.Q
    for role, matrix, space in [*constant, ("Q", noise, model.space)]:
        if matrix.value is None or isinstance(matrix.value, Tracer):
            continue  # nothing to look at yet
        value = np.asarray(matrix.value)
        if value.ndim != 2 or value.shape[0] != value.shape[1]:
            raise ShapeError(f"{role}: expected a square matrix, got shape {value.shape}")
        names = list(space.tangent_names)
        if role == "Q" and gain is not None:
            names = [f"w{i}" for i in range(len(value))]
        elif len(value) == 1:
            names = [names[0]] if len(names) == 1 else ["all"]
        if len(value) != len(names):
            raise ShapeError(f"{role}: expected shape ({len(names)}, {len(names)}), got {value.shape}")
        check_covariance(value, role, names)


def discrete_model(
    f: Callable[..., Any],
    h: Callable[..., Any] | None = None,
    *,
    states: SpaceLike,
    outputs: SpaceLike | None = None,
    inputs: SpaceLike | int = (),
    Q: Any,
    R: Any = None,
    G: Any = None,
    sensors: Sequence[Sensor] | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Model:
    """A model that moves in steps: `x <- f(x, u, t) + G w`, `y = h(x, u, t) + v`.

    Args:
        f: the next state. It may ask for the time step `dt` [s] and the parameters `p` by name; without `dt` the record's
            steps must be equal.
        h: the measurement; may ask for `p`.
        states: names and units of the state (see `make_space`).
        outputs: names and units of the measurement; with `h` and `R` they are one sensor, which a gate takes or leaves whole.
        inputs: names and units of the inputs.
        Q: covariance of `w` over one step: a matrix, a vector or scalar of variances, or a function of `(x, u, t)`, `dt`, `p`.
        R: covariance of `v`, likewise.
        G: matrix through which `w` enters; identity by default.
        sensors: several sensors in place of `h`, `outputs` and `R` (see `sensor`).
        parameters: values the functions reach as `p["name"]`; `augment` can estimate them.

    Raises:
        ModelError: a function or matrix of the wrong form, or a missing argument.

    Example:
        >>> import jax.numpy as jnp
        >>> model = discrete_model(lambda x, u, t: 0.9 * x, lambda x, u, t: x, states=1, outputs=1, Q=0.1, R=1.0)
        >>> model.space.names, model.output.names
        (('x0',), ('y0',))
    """
    gain = None if G is None else Matrix(G, "G")
    dynamics = DiscreteDynamics(f=Function(f, "f"), Q=Matrix(Q, "Q"), G=gain)
    return _assemble(states, inputs, dynamics, make_sensors(h, outputs, R, sensors), parameters)


def continuous_model(
    f: Callable[..., Any],
    h: Callable[..., Any] | None = None,
    *,
    states: SpaceLike,
    outputs: SpaceLike | None = None,
    inputs: SpaceLike | int = (),
    Q: Any,
    R: Any = None,
    G: Any = None,
    sensors: Sequence[Sensor] | None = None,
    parameters: Mapping[str, Any] | None = None,
    substeps: int = 1,
) -> Model:
    """A model in continuous time: `dx/dt = f(x, u, t) + G w`, measured in samples `y = h(x, u, t) + v`.

    Steps may vary: the state is integrated by Runge-Kutta 4 and the noise by Van Loan's integral over each interval.

    Args:
        f: the rate of change of the state; for a quaternion its three body rates [rad/s]. May ask for `p`.
        h: the measurement.
        states: names and units of the state (see `make_space`).
        outputs: names and units of the measurement; with `h` and `R` they are one sensor, which a gate takes or leaves whole.
        inputs: names and units of the inputs.
        Q: spectral density of `w`, units squared per second, so that a free state's variance grows by `Q dt`.
        R: covariance of `v`.
        G: matrix through which `w` enters; identity by default.
        sensors: several sensors in place of `h`, `outputs` and `R` (see `sensor`).
        parameters: values the functions reach as `p["name"]`; `augment` can estimate them.
        substeps: Runge-Kutta steps per interval.

    Raises:
        ModelError: a function or matrix of the wrong form, or a missing argument.
    """
    if not isinstance(substeps, int) or substeps < 1:
        raise ModelError(f"substeps: expected a whole number of at least 1, got {substeps!r}")
    gain = None if G is None else Matrix(G, "G")
    dynamics = ContinuousDynamics(f=Function(f, "f"), Q=Matrix(Q, "Q"), G=gain, substeps=substeps)
    return _assemble(states, inputs, dynamics, make_sensors(h, outputs, R, sensors), parameters)


def linear_model(
    F: Any,
    H: Any,
    *,
    Q: Any,
    R: Any,
    B: Any = None,
    D: Any = None,
    G: Any = None,
    states: SpaceLike | None = None,
    outputs: SpaceLike | None = None,
    inputs: SpaceLike | int | None = None,
    parameters: Mapping[str, Any] | None = None,
) -> Model:
    """A linear model: `x <- F x + B u + G w`, `y = H x + D u + v`.

    Args:
        F: transition matrix (n, n), or a function of `(x, u, t)`, `dt`, `p` returning it.
        H: measurement matrix (m, n).
        Q: covariance of `w` over one step.
        R: covariance of `v` (m, m).
        B: input matrix (n, r).
        D: feed-through matrix (m, r).
        G: matrix through which the noise enters.
        states: names and units; made up where the sizes of `F` tell their number.
        outputs: likewise, from `H`.
        inputs: likewise, from `B` or `D`.
        parameters: values that matrix functions reach as `p["name"]`.

    Raises:
        ModelError, ShapeError: matrices whose sizes do not fit.

    Example:
        >>> linear_model([[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.0]], Q=[[1e-4, 0], [0, 1e-2]], R=0.1).space.dof
        2
    """
    f, h = _matrix(F, "F"), _matrix(H, "H")
    b, d = (None if M is None else _matrix(M, name) for M, name in ((B, "B"), (D, "D")))
    space = _sized(states, f, 0, "F", "states", "x")
    output = _sized(outputs, h, 0, "H", "outputs", "y")
    given = next((M for M in (b, d) if M is not None), None)
    if inputs is None:
        if given is None:
            inputs = ()
        elif given.value is not None:
            inputs = int(given.value.shape[1])
        else:
            raise ModelError("inputs: missing; it cannot be read off a function B or D")
    count = len(_inputs(inputs)[0])
    expected = {"F": (f, (space.size, space.size)), "H": (h, (output.size, space.size))}
    expected |= {name: (M, (rows, count)) for name, M, rows in (("B", b, space.size), ("D", d, output.size)) if M}
    for name, (matrix, shape) in expected.items():
        if matrix.value is not None and matrix.value.shape != shape:
            raise ShapeError(f"{name}: expected shape {shape}, got {matrix.value.shape}")
    gain = None if G is None else Matrix(G, "G")
    dynamics = LinearDynamics(F=f, B=b, Q=Matrix(Q, "Q"), G=gain)
    reading = Sensor("y", output, Function(_LinearReading(h, d), "H"), Matrix(R, "R"))
    return _assemble(space, inputs, dynamics, (reading,), parameters)


class _LinearReading(eqx.Module):
    H: Matrix
    D: Matrix | None

    def __call__(self, x: Array, u: Array, t: Array, dt: Array, p: dict[str, Array]) -> Array:
        reading = self.H(x, u, t, dt, p) @ x
        return reading if self.D is None else reading + self.D(x, u, t, dt, p) @ u


def _matrix(given: Any, role: str) -> Matrix:
    """A matrix whose one-dimensional form is a single row, not a diagonal."""
    if callable(given):
        return Matrix(given, role)
    array = jnp.asarray(given, dtype=float)
    return Matrix(array.reshape((1, -1)) if array.ndim < 2 else array, role)


def _sized(given: SpaceLike | None, matrix: Matrix, axis: int, role: str, argument: str, prefix: str) -> AbstractSpace:
    if given is not None:
        return make_space(given, prefix=prefix)
    if matrix.value is None:
        raise ModelError(f"{argument}: missing; it cannot be read off a function {role}")
    return make_space(int(matrix.value.shape[axis]), prefix=prefix)


def unknown_name(kind: str, name: str, known: Sequence[str]) -> ModelError:
    """The error for a name a model does not have."""
    return ModelError(f"{kind} {name!r} is not one of the model's; {did_you_mean(name, known)}")
