"""How the attitude of a spacecraft is written in its state and in the readings of its star tracker."""

import abc
from typing import Literal

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ..control import AbstractAttitudeReference
from ..errors import ModelError, did_you_mean
from ..spaces import AbstractSpace, make_space, quaternion_conjugate, quaternion_multiply
from .euler312 import dcm_to_euler312, euler312_rates, euler312_to_dcm, quaternion_to_dcm
from .targets import AbstractTarget

_NEAR = 5.0  # degrees
"""Angles so near their singularity are not to be trusted."""


class AbstractAttitudeForm(AbstractAttitudeReference):
    """An attitude in numbers, from and to the quaternion `q` from body axes to inertial axes.

    It is also the reference of a tracking law, which reads attitudes in this form.

    Attributes:
        target: the attitude to follow.
    """

    target: eqx.AbstractVar[AbstractTarget]

    @abc.abstractmethod
    def space(self, prefix: str = "") -> AbstractSpace:
        """Where the numbers live, their names led by `prefix`."""

    @abc.abstractmethod
    def written(self, q: Float[Array, "4"], t: Float[Array, ""]) -> Float[Array, " size"]:
        """The numbers of a quaternion."""

    @abc.abstractmethod
    def rates(self, w: Float[Array, "3"], attitude: Float[Array, " size"], t: Float[Array, ""]) -> Float[Array, "3"]:
        """How the attitude changes while the body turns at `w` [rad/s], as `space.velocity` takes it."""

    def cautions(self, attitude: Float[np.ndarray, "T size"]) -> tuple[str, ...]:
        """What a reader of estimates along these attitudes should know; nothing where no attitude is singular."""
        return ()

    def target_rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return self.target.rate(t)

    def target_acceleration(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return self.target.acceleration(t)


class AbstractAngles(AbstractAttitudeForm):
    """3-1-2 angles of the body relative to axes that turn; singular where phi is 90 degrees."""

    @abc.abstractmethod
    def axes(self, t: Float[Array, ""]) -> Float[Array, "4"]:
        """Quaternion from those axes to inertial axes."""

    @abc.abstractmethod
    def axes_rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """Inertial rate of those axes, in themselves [rad/s]."""

    def space(self, prefix: str = "") -> AbstractSpace:
        return make_space({f"{prefix}{name}": "angle" for name in ("phi", "theta", "psi")})

    def written(self, q: Float[Array, "4"], t: Float[Array, ""]) -> Float[Array, "3"]:
        return dcm_to_euler312(quaternion_to_dcm(_relative(q, self.axes(t))))

    def rates(self, w: Float[Array, "3"], attitude: Float[Array, "3"], t: Float[Array, ""]) -> Float[Array, "3"]:
        return euler312_rates(attitude) @ (w - euler312_to_dcm(attitude) @ self.axes_rate(t))

    def cautions(self, attitude: Float[np.ndarray, "T 3"]) -> tuple[str, ...]:
        phi = attitude[:, 0]
        apart = np.degrees(np.arcsin(np.abs(np.cos(phi[np.isfinite(phi)]))))  # from the next odd multiple of 90 degrees
        near = int((apart < _NEAR).sum())
        if not near:
            return ()
        return (
            f"phi comes within {apart.min():.2g} degrees of 90, where these angles are singular, and stays within {_NEAR:g} "
            f"in {near} of {len(phi)} rows; write the attitude as a quaternion",
        )


class TargetAngles(AbstractAngles):
    """3-1-2 angles of the body relative to the target: small while the target is followed.

    Attributes:
        target: the attitude to follow.
    """

    target: AbstractTarget

    def axes(self, t: Float[Array, ""]) -> Float[Array, "4"]:
        return self.target.attitude(t)

    def axes_rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return self.target.rate(t)

    def tracking_error(self, attitude: Float[Array, "3"], t: Float[Array, ""]) -> tuple[Array, Array]:
        return attitude, euler312_to_dcm(attitude)


class OrbitAngles(AbstractAngles):
    """3-1-2 angles of the body relative to orbit axes.

    Attributes:
        target: the attitude to follow.
    """

    target: AbstractTarget

    def axes(self, t: Float[Array, ""]) -> Float[Array, "4"]:
        return self.target.orbit(t)

    def axes_rate(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        return self.target.orbit_rate

    def tracking_error(self, attitude: Float[Array, "3"], t: Float[Array, ""]) -> tuple[Array, Array]:
        return _error(euler312_to_dcm(attitude) @ euler312_to_dcm(self.target.angles(t)).T)


class InertialQuaternion(AbstractAttitudeForm):
    """The quaternion from body axes to inertial axes: no attitude is singular.

    Attributes:
        target: the attitude to follow.
    """

    target: AbstractTarget

    def space(self, prefix: str = "") -> AbstractSpace:
        return make_space({f"{prefix}attitude": "quaternion"})

    def written(self, q: Float[Array, "4"], t: Float[Array, ""]) -> Float[Array, "4"]:
        return q

    def rates(self, w: Float[Array, "3"], attitude: Float[Array, "4"], t: Float[Array, ""]) -> Float[Array, "3"]:
        return w

    def tracking_error(self, attitude: Float[Array, "4"], t: Float[Array, ""]) -> tuple[Array, Array]:
        return _error(quaternion_to_dcm(_relative(attitude, self.target.attitude(t))))


AttitudeName = Literal["target", "orbit", "quaternion"]
"""What a form is called where models are configured."""

FORMS: dict[str, type[AbstractAttitudeForm]] = {
    "target": TargetAngles,
    "orbit": OrbitAngles,
    "quaternion": InertialQuaternion,
}


def attitude_form(name: str, target: AbstractTarget) -> AbstractAttitudeForm:
    """The form of a name: angles relative to the "target" or the "orbit", or the inertial "quaternion"."""
    if name not in FORMS:
        raise ModelError(f"attitude: {name!r} is not known; {did_you_mean(name, FORMS)}")
    return FORMS[name](target)  # type: ignore[call-arg]


def _relative(q: Array, reference: Array) -> Array:
    return quaternion_multiply(quaternion_conjugate(reference), q)


def _error(to_body: Array) -> tuple[Array, Array]:
    return dcm_to_euler312(to_body), to_body
