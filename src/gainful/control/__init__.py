"""Control laws."""

from ..running.plant import AbstractController, Reading
from .allocation import Adjustment, allocate_torque
from .base import AbstractAttitudeReference
from .reconfiguration import AbstractReconfiguration, EstimatedFaults, Unchanged
from .tracking import TrackingController

__all__ = [
    "AbstractAttitudeReference",
    "AbstractController",
    "AbstractReconfiguration",
    "Adjustment",
    "EstimatedFaults",
    "Reading",
    "TrackingController",
    "Unchanged",
    "allocate_torque",
]
