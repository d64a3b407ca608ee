"""Ready models, and plants for closed loops."""

from collections.abc import Callable

from ..models import AbstractModel
from .attitude_forms import AbstractAttitudeForm, InertialQuaternion, OrbitAngles, TargetAngles, attitude_form
from .changing import ChangingPlant
from .euler312 import (
    dcm_to_euler312,
    euler312_rates,
    euler312_rates_inverse,
    euler312_to_dcm,
    euler312_to_quaternion,
    quaternion_to_dcm,
)
from .excitation import chirp, multisine, prbs, staircase
from .excitation_design import ExcitationDesign, design_excitation
from .flexible_spacecraft import DisturbanceTorque, FlexibleSpacecraft
from .flexible_spacecraft_model import flexible_spacecraft, flexible_spacecraft_model
from .flexible_structure import FlexibleState, FlexibleStructure, Modes
from .fourier_excitation import fourier_excitation
from .hydraulic_servo import HydraulicServo, hydraulic_servo
from .hydraulic_servo_parameters import HydraulicServoParameters
from .hydraulic_servo_record import ServoRecord, drive_servo, interval_times, sample_times
from .hydraulic_servo_reduced import ReducedHydraulicServo, hydraulic_servo_reduced
from .kinematics import attitude_kinematics, constant_velocity, planar_vehicle
from .land_vehicle import land_vehicle
from .land_vehicle_drive import DriveRecord, drive_vehicle
from .land_vehicle_errors import compass_deviation, lateral_speed, odometer_error
from .marine_motion import MarineMotion
from .marine_vehicle import MarineVehicle, bluerov2
from .rigid_spacecraft import RigidSpacecraft, SpacecraftState
from .single_dof_vehicle import SingleDofVehicle, published_vehicle, single_dof_vehicle
from .spacecraft_model import rigid_spacecraft, spacecraft_model
from .target_tracking import fly, tracking_controller
from .targets import AbstractTarget, SlewTarget, SwingTarget
from .track import settled_track_covariance, track
from .track_scenarios import TRACK_SCENARIOS, TrackRecord, TrackScenario, run_track
from .vehicle_numbers import VehicleNumbers, gravity_direction
from .vehicle_rows import vehicle_rows, weak_vehicle_rows
from .vehicle_structure import VehicleStructure
from .wheels import Wheels, orthogonal_axes, pyramid_axes

CATALOGUE: dict[str, Callable[..., AbstractModel]] = {
    "attitude_kinematics": attitude_kinematics,
    "constant_velocity": constant_velocity,
    "flexible_spacecraft": flexible_spacecraft,
    "hydraulic_servo": hydraulic_servo,
    "hydraulic_servo_reduced": hydraulic_servo_reduced,
    "land_vehicle": land_vehicle,
    "planar_vehicle": planar_vehicle,
    "rigid_spacecraft": rigid_spacecraft,
    "single_dof_vehicle": single_dof_vehicle,
    "track": track,
}
"""Ready models by the name a configuration uses."""

__all__ = [
    "CATALOGUE",
    "TRACK_SCENARIOS",
    "AbstractAttitudeForm",
    "AbstractTarget",
    "ChangingPlant",
    "DisturbanceTorque",
    "DriveRecord",
    "ExcitationDesign",
    "FlexibleSpacecraft",
    "FlexibleState",
    "FlexibleStructure",
    "HydraulicServo",
    "HydraulicServoParameters",
    "InertialQuaternion",
    "MarineMotion",
    "MarineVehicle",
    "Modes",
    "OrbitAngles",
    "ReducedHydraulicServo",
    "RigidSpacecraft",
    "ServoRecord",
    "SingleDofVehicle",
    "SlewTarget",
    "SpacecraftState",
    "SwingTarget",
    "TargetAngles",
    "TrackRecord",
    "TrackScenario",
    "VehicleNumbers",
    "VehicleStructure",
    "Wheels",
    "attitude_form",
    "attitude_kinematics",
    "bluerov2",
    "chirp",
    "compass_deviation",
    "constant_velocity",
    "dcm_to_euler312",
    "design_excitation",
    "drive_servo",
    "drive_vehicle",
    "euler312_rates",
    "euler312_rates_inverse",
    "euler312_to_dcm",
    "euler312_to_quaternion",
    "flexible_spacecraft",
    "flexible_spacecraft_model",
    "fly",
    "fourier_excitation",
    "gravity_direction",
    "hydraulic_servo",
    "hydraulic_servo_reduced",
    "interval_times",
    "land_vehicle",
    "lateral_speed",
    "multisine",
    "odometer_error",
    "orthogonal_axes",
    "planar_vehicle",
    "prbs",
    "published_vehicle",
    "pyramid_axes",
    "quaternion_to_dcm",
    "rigid_spacecraft",
    "run_track",
    "sample_times",
    "settled_track_covariance",
    "single_dof_vehicle",
    "spacecraft_model",
    "staircase",
    "track",
    "tracking_controller",
    "vehicle_rows",
    "weak_vehicle_rows",
]
