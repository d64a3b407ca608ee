"""Faults: as states of a model, put into signals on purpose, detected, told apart, and scored."""

from .alarms import alarms
from .calibration import FalseAlarmTest, Threshold, calibrate_threshold, check_threshold
from .description import Fault, actuator_offset, loss_of_effectiveness, sensor_bias, sensor_scale_error
from .detection import (
    chi_square_threshold,
    cusum,
    detection_statistics,
    fault_scores,
    mean_jump,
    normalised_innovations,
    result_statistics,
    windowed_mean,
)
from .explanation import Explanation, explain, single_fault_scores
from .fault_free import fault_free_statistics
from .injection import (
    AbstractInjection,
    Bias,
    Drift,
    Intermittent,
    Loss,
    NoiseIncrease,
    Outliers,
    Stuck,
)
from .isolation import Isolability, Pair, isolability, nominal_log
from .metrics import (
    detection_delay,
    false_alarm_rate,
    missed_alarm_rate,
    receiver_operating_characteristic,
    settling_time,
    time_to_fall,
    time_to_reach,
    window_rmse,
)
from .modelling import FaultModel, base_prior, extend_prior, with_faults
from .records import inject
from .signals import FaultySignals, check_signals, disturb
from .tracks import parameter_tracks, ramp, reflected_walk

__all__ = [
    "AbstractInjection",
    "Bias",
    "Drift",
    "Explanation",
    "FalseAlarmTest",
    "Fault",
    "FaultModel",
    "FaultySignals",
    "Intermittent",
    "Isolability",
    "Loss",
    "NoiseIncrease",
    "Outliers",
    "Pair",
    "Stuck",
    "Threshold",
    "actuator_offset",
    "alarms",
    "base_prior",
    "calibrate_threshold",
    "check_signals",
    "check_threshold",
    "chi_square_threshold",
    "cusum",
    "detection_delay",
    "detection_statistics",
    "disturb",
    "explain",
    "extend_prior",
    "false_alarm_rate",
    "fault_free_statistics",
    "fault_scores",
    "inject",
    "isolability",
    "loss_of_effectiveness",
    "mean_jump",
    "missed_alarm_rate",
    "nominal_log",
    "normalised_innovations",
    "parameter_tracks",
    "ramp",
    "receiver_operating_characteristic",
    "reflected_walk",
    "result_statistics",
    "sensor_bias",
    "sensor_scale_error",
    "settling_time",
    "single_fault_scores",
    "time_to_fall",
    "time_to_reach",
    "windowed_mean",
    "window_rmse",
    "with_faults",
]
