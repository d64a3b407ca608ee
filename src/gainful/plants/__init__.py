"""Ready models."""

from collections.abc import Callable

from ..models import AbstractModel
from .kinematics import attitude_kinematics, constant_velocity, planar_vehicle

CATALOGUE: dict[str, Callable[..., AbstractModel]] = {
    "attitude_kinematics": attitude_kinematics,
    "constant_velocity": constant_velocity,
    "planar_vehicle": planar_vehicle,
}
"""Ready models by the name a configuration uses."""

__all__ = ["CATALOGUE", "attitude_kinematics", "constant_velocity", "planar_vehicle"]
