"""Whole jobs, from a configuration file to results on disk: what the command line calls."""

from .aiding import aiding_gain_rows
from .estimate import EstimateJob, estimate, state_rows
from .faults import FaultFindings, fault_rows_of
from .gallery import GalleryJob, run_all_studies
from .identify import IdentifyJob, identify_log
from .identify_network import NetworkJob
from .parameters import parameter_rows
from .starter import write_starter
from .study import StudyJob, run_study
from .train_aiding import TrainAidingJob, aiding_rows, map_rows, train
from .tune import TuneJob, likelihood_rows, noise_rows, tune

__all__ = [
    "TrainAidingJob",
    "aiding_gain_rows",
    "aiding_rows",
    "map_rows",
    "train",
    "EstimateJob",
    "FaultFindings",
    "GalleryJob",
    "IdentifyJob",
    "NetworkJob",
    "StudyJob",
    "TuneJob",
    "estimate",
    "fault_rows_of",
    "identify_log",
    "likelihood_rows",
    "noise_rows",
    "parameter_rows",
    "run_all_studies",
    "run_study",
    "state_rows",
    "tune",
    "write_starter",
]
