"""Configuration files: parts and records written down."""

from .build import build_faults, build_filter, build_injections, build_model, build_parameters, build_prior
from .load import load_config, parse_config
from .parts import FILTERS, KINDS, dump_part, make_filter, make_part
from .schema import EstimateConfig

__all__ = [
    "FILTERS",
    "KINDS",
    "EstimateConfig",
    "build_faults",
    "build_filter",
    "build_injections",
    "build_model",
    "build_parameters",
    "build_prior",
    "dump_part",
    "load_config",
    "make_filter",
    "make_part",
    "parse_config",
]
