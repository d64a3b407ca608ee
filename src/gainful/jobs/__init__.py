"""Whole jobs, from a configuration file to results on disk: what the command line calls."""

from .estimate import EstimateJob, estimate, state_rows
from .faults import FaultFindings, fault_rows_of
from .identify import IdentifyJob, identify_log
from .parameters import parameter_rows
from .starter import write_starter
from .study import StudyJob, run_study

__all__ = [
    "EstimateJob",
    "FaultFindings",
    "IdentifyJob",
    "StudyJob",
    "estimate",
    "fault_rows_of",
    "identify_log",
    "parameter_rows",
    "run_study",
    "state_rows",
    "write_starter",
]
