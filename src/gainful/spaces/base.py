"""The contract of a space."""

import abc

import equinox as eqx
from jaxtyping import Array, Float


class AbstractSpace(eqx.Module):
    """A set of points with local coordinates: `plus` moves a point, `minus` tells two points apart.

    Laws, checked for every space: `plus(x, 0) = x`, `minus(plus(x, d), x) = d` for small `d`, `plus(x, minus(y, x)) = y`.

    Attributes:
        names: one name per coordinate of a point.
        units: their units, as pint spells them; "1" for pure numbers.
        tangent_names: one name per degree of freedom; covariances are written in these.
        tangent_units: their units.
    """

    names: eqx.AbstractVar[tuple[str, ...]]
    units: eqx.AbstractVar[tuple[str, ...]]
    tangent_names: eqx.AbstractVar[tuple[str, ...]]
    tangent_units: eqx.AbstractVar[tuple[str, ...]]

    @property
    def size(self) -> int:
        """Numbers that store a point."""
        return len(self.names)

    @property
    def dof(self) -> int:
        """Degrees of freedom: the length of a difference."""
        return len(self.tangent_names)

    @property
    def added(self) -> int:
        """How many of the last degrees of freedom were added to a model: parameters, biases, faults."""
        return 0

    @property
    @abc.abstractmethod
    def curved(self) -> bool:
        """Whether the mean of points needs iteration (rotations)."""

    @property
    @abc.abstractmethod
    def parts(self) -> tuple["AbstractSpace", ...]:
        """The indivisible spaces this one is made of, in order."""

    @abc.abstractmethod
    def plus(self, x: Float[Array, " size"], d: Float[Array, " dof"]) -> Float[Array, " size"]:
        """The point reached from `x` by the change `d`."""

    @abc.abstractmethod
    def minus(self, y: Float[Array, " size"], x: Float[Array, " size"]) -> Float[Array, " dof"]:
        """The change that leads from `x` to `y`."""

    @abc.abstractmethod
    def velocity(self, x: Float[Array, " size"], rate: Float[Array, " dof"]) -> Float[Array, " size"]:
        """Rates of the numbers that store `x`, given the rates a user writes: a rotation's body rates, else these numbers."""

    @abc.abstractmethod
    def error_rate(
        self, x: Float[Array, " size"], d: Float[Array, " dof"], moved: Float[Array, " dof"], own: Float[Array, " dof"]
    ) -> Float[Array, " dof"]:
        """Rate of `minus(y, x)` to first order in `d`, for `y = plus(x, d)` moving at `moved` and `x` at `own`."""

    @abc.abstractmethod
    def defect(self, x: Float[Array, " size"]) -> Float[Array, " size"]:
        """Zero where `x` is a point of the space; elsewhere how far each coordinate is off."""
