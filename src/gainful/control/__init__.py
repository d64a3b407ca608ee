"""Control laws."""

from ..running.plant import AbstractController, Reading
from .adaptive_inverse import AdaptiveInverseController, AdaptiveMemory, AdaptiveReport
from .allocation import Adjustment, allocate_torque
from .base import AbstractAttitudeReference
from .commands import AbstractCommand, FollowReference, RateCommand
from .compensation import ErrorMoments, ErrorStatistics
from .euler321 import (
    AngleState,
    euler321_rates,
    euler321_rates_inverse,
    euler321_to_quaternion,
    quaternion_to_euler321,
)
from .guardrails import Guardrails, weak_inputs
from .incremental import IncrementalInversion
from .inversion import Inverse, Inversion
from .linear_quadratic import LinearPlant, closed_loop_poles, linearised, lqi, lqr, one_step_gain
from .margins import error_dynamics, gain_margin
from .reconfiguration import AbstractReconfiguration, EstimatedFaults, Unchanged
from .references import AbstractReference, SetPoint, SlewStates
from .slews import QuinticSlews, TorqueNeed, slew_torque, torque_need
from .state_feedback import StateFeedback
from .state_source import StateSource
from .tracking import TrackingController

__all__ = [
    "AbstractAttitudeReference",
    "AbstractCommand",
    "AbstractController",
    "AbstractReconfiguration",
    "AbstractReference",
    "AdaptiveInverseController",
    "AdaptiveMemory",
    "AdaptiveReport",
    "Adjustment",
    "AngleState",
    "ErrorMoments",
    "ErrorStatistics",
    "EstimatedFaults",
    "FollowReference",
    "Guardrails",
    "IncrementalInversion",
    "Inverse",
    "Inversion",
    "LinearPlant",
    "QuinticSlews",
    "RateCommand",
    "Reading",
    "SetPoint",
    "SlewStates",
    "StateFeedback",
    "StateSource",
    "TorqueNeed",
    "TrackingController",
    "Unchanged",
    "allocate_torque",
    "closed_loop_poles",
    "error_dynamics",
    "euler321_rates",
    "euler321_rates_inverse",
    "euler321_to_quaternion",
    "gain_margin",
    "linearised",
    "lqi",
    "lqr",
    "one_step_gain",
    "quaternion_to_euler321",
    "slew_torque",
    "torque_need",
    "weak_inputs",
]
