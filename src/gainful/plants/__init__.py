"""Ready models, and plants for closed loops."""

from collections.abc import Callable

from ..models import AbstractModel
from .attitude_forms import AbstractAttitudeForm, InertialQuaternion, OrbitAngles, TargetAngles, attitude_form
from .euler312 import (
    dcm_to_euler312,
    euler312_rates,
    euler312_rates_inverse,
    euler312_to_dcm,
    euler312_to_quaternion,
    quaternion_to_dcm,
)
from .kinematics import attitude_kinematics, constant_velocity, planar_vehicle
from .rigid_spacecraft import RigidSpacecraft, SpacecraftState
from .spacecraft_model import rigid_spacecraft, spacecraft_model
from .target_tracking import fly, tracking_controller
from .targets import AbstractTarget, SlewTarget, SwingTarget
from .wheels import Wheels, orthogonal_axes, pyramid_axes

CATALOGUE: dict[str, Callable[..., AbstractModel]] = {
    "attitude_kinematics": attitude_kinematics,
    "constant_velocity": constant_velocity,
    "planar_vehicle": planar_vehicle,
    "rigid_spacecraft": rigid_spacecraft,
}
"""Ready models by the name a configuration uses."""

__all__ = [
    "CATALOGUE",
    "AbstractAttitudeForm",
    "AbstractTarget",
    "InertialQuaternion",
    "OrbitAngles",
    "RigidSpacecraft",
    "SlewTarget",
    "SpacecraftState",
    "SwingTarget",
    "TargetAngles",
    "Wheels",
    "attitude_form",
    "attitude_kinematics",
    "constant_velocity",
    "dcm_to_euler312",
    "euler312_rates",
    "euler312_rates_inverse",
    "euler312_to_dcm",
    "euler312_to_quaternion",
    "fly",
    "orthogonal_axes",
    "planar_vehicle",
    "pyramid_axes",
    "quaternion_to_dcm",
    "rigid_spacecraft",
    "spacecraft_model",
    "tracking_controller",
]
