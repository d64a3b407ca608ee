"""What a law of attitude control asks of the attitude to follow."""

import abc

import equinox as eqx
from jaxtyping import Array, Float


class AbstractAttitudeReference(eqx.Module):
    """An attitude to follow, and how far a measured one is from it. The target's rates are in target axes."""

    @abc.abstractmethod
    def target_rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """Inertial rate of the target [rad/s]."""

    @abc.abstractmethod
    def target_acceleration(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """How that rate changes [rad/s^2]."""

    @abc.abstractmethod
    def tracking_error(
        self, attitude: Float[Array, " size"], t: Float[Array, ""]
    ) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Angles of the body relative to the target [rad], and the matrix from target axes to body axes."""
