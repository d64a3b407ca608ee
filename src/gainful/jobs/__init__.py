"""Whole jobs, from a configuration file to results on disk: what the command line calls."""

from .estimate import EstimateJob, estimate, state_rows
from .starter import write_starter

__all__ = ["EstimateJob", "estimate", "state_rows", "write_starter"]
