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
from .excitation import chirp, multisine, prbs, staircase
from .fourier_excitation import fourier_excitation
from .hydraulic_servo import HydraulicServo, hydraulic_servo
from .hydraulic_servo_parameters import HydraulicServoParameters
from .hydraulic_servo_record import ServoRecord, drive_servo, interval_times, sample_times
from .hydraulic_servo_reduced import ReducedHydraulicServo, hydraulic_servo_reduced
from .kinematics import attitude_kinematics, constant_velocity, planar_vehicle
from .rigid_spacecraft import RigidSpacecraft, SpacecraftState
from .spacecraft_model import rigid_spacecraft, spacecraft_model
from .target_tracking import fly, tracking_controller
from .targets import AbstractTarget, SlewTarget, SwingTarget
from .wheels import Wheels, orthogonal_axes, pyramid_axes

CATALOGUE: dict[str, Callable[..., AbstractModel]] = {
    "attitude_kinematics": attitude_kinematics,
    "constant_velocity": constant_velocity,
    "hydraulic_servo": hydraulic_servo,
    "hydraulic_servo_reduced": hydraulic_servo_reduced,
    "planar_vehicle": planar_vehicle,
    "rigid_spacecraft": rigid_spacecraft,
}
"""Ready models by the name a configuration uses."""

__all__ = [
    "CATALOGUE",
    "AbstractAttitudeForm",
    "AbstractTarget",
    "HydraulicServo",
    "HydraulicServoParameters",
    "InertialQuaternion",
    "OrbitAngles",
    "ReducedHydraulicServo",
    "RigidSpacecraft",
    "ServoRecord",
    "SlewTarget",
    "SpacecraftState",
    "SwingTarget",
    "TargetAngles",
    "Wheels",
    "attitude_form",
    "attitude_kinematics",
    "chirp",
    "constant_velocity",
    "dcm_to_euler312",
    "drive_servo",
    "euler312_rates",
    "euler312_rates_inverse",
    "euler312_to_dcm",
    "euler312_to_quaternion",
    "fly",
    "fourier_excitation",
    "hydraulic_servo",
    "hydraulic_servo_reduced",
    "interval_times",
    "multisine",
    "orthogonal_axes",
    "planar_vehicle",
    "prbs",
    "pyramid_axes",
    "quaternion_to_dcm",
    "rigid_spacecraft",
    "sample_times",
    "spacecraft_model",
    "staircase",
    "tracking_controller",
]
