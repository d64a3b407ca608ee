"""Whole jobs, from a configuration file to results on disk: what the command line calls."""

from .estimate import EstimateJob, estimate, state_rows
from .faults import FaultFindings, fault_rows_of
from .identify import IdentifyJob, identify_log
from .parameters import parameter_rows
from .starter import write_starter
from .study import StudyJob, run_study
from .tune import TuneJob, likelihood_rows, noise_rows, tune

__all__ = [
    "EstimateJob",
    "FaultFindings",
    "IdentifyJob",
    "StudyJob",
    "TuneJob",
    "estimate",
    "fault_rows_of",
    "identify_log",
    "likelihood_rows",
    "noise_rows",
    "parameter_rows",
    "run_study",
    "state_rows",
    "tune",
    "write_starter",
]
