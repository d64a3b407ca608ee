"""What a model is: how a state moves, and how it is measured."""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..spaces import AbstractSpace


class Instant(eqx.Module):
    """A moment of a record.

    Attributes:
        t: time [s].
        dt: time since the previous moment [s]; 0 means the same moment.
        u: inputs, held over the interval that ends at `t`.
    """

    t: Float[Array, ""]
    dt: Float[Array, ""]
    u: Float[Array, " inputs"]


class Sample(eqx.Module):
    """A moment and what was measured then.

    Attributes:
        when: the moment.
        y: the measured point of the model's output space; unseen coordinates hold any finite number.
        seen: which degrees of freedom of the output were measured.
    """

    when: Instant
    y: Float[Array, " output_size"]
    seen: Bool[Array, " output_dof"]


class AbstractModel(eqx.Module):
    """How a state moves (`transition`, `process_noise`) and how it is measured (`observe`, `measurement_noise`).

    Attributes:
        space: where the state lives.
        output: where a measurement of all sensors together lives.
        inputs: names of the inputs.
        input_units: their units.
        sensors: name and number of output degrees of freedom of each sensor, in the order of the output.
        parameters: values by name, reached by the model's functions as `p`.
    """

    space: eqx.AbstractVar[AbstractSpace]
    output: eqx.AbstractVar[AbstractSpace]
    inputs: eqx.AbstractVar[tuple[str, ...]]
    input_units: eqx.AbstractVar[tuple[str, ...]]
    parameters: eqx.AbstractVar[dict[str, Array]]

    @property
    @abc.abstractmethod
    def sensors(self) -> tuple[tuple[str, int], ...]:
        """Name and degrees of freedom of each sensor, in the order of the output."""

    @property
    @abc.abstractmethod
    def takes_dt(self) -> bool:
        """Whether the transition is right for any time step; if not, steps must be equal."""

    @property
    @abc.abstractmethod
    def noise_takes_dt(self) -> bool:
        """Whether the process noise is right for any time step."""

    @abc.abstractmethod
    def with_parameters(self, values: dict[str, Array]) -> "AbstractModel":
        """The same model with some parameters replaced."""

    @abc.abstractmethod
    def transition(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " size"]:
        """The state at `when.t` if it was `x` at `when.t - when.dt`; `x` itself where `dt` is 0."""

    @abc.abstractmethod
    def observe(self, x: Float[Array, " size"], when: Instant) -> Float[Array, " output_size"]:
        """What all sensors would read, without noise."""

    @abc.abstractmethod
    def process_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "dof dof"]:
        """Covariance added over the interval, in tangent coordinates; zero where `dt` is 0."""

    @abc.abstractmethod
    def measurement_noise(self, x: Float[Array, " size"], when: Instant) -> Float[Array, "output_dof output_dof"]:
        """Covariance of the measurement noise."""

    def cautions(self, x: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        """What a reader of estimates along these states should know of the model there; nothing by default."""
        return ()


def block_diagonal(blocks: list[Float[Array, "_ _"]]) -> Float[Array, "n n"]:
    """One matrix with the given ones along its diagonal."""
    if len(blocks) == 1:
        return blocks[0]
    n = sum(block.shape[0] for block in blocks)
    out = jnp.zeros((n, n), jnp.result_type(*blocks))
    start = 0
    for block in blocks:
        stop = start + block.shape[0]
        out = out.at[start:stop, start:stop].set(block)
        start = stop
    return out
