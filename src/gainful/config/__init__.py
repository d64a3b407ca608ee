"""Configuration files: parts and records written down."""

from .build import build_faults, build_filter, build_injections, build_model, build_parameters, build_prior
from .identify import IdentifyConfig, build_equation, build_recordings
from .load import load_config, load_identify_config, parse_config, parse_identify_config
from .network import build_network
from .parts import FILTERS, KINDS, dump_part, make_filter, make_part
from .schema import EstimateConfig

__all__ = [
    "FILTERS",
    "KINDS",
    "EstimateConfig",
    "IdentifyConfig",
    "build_equation",
    "build_faults",
    "build_filter",
    "build_injections",
    "build_model",
    "build_parameters",
    "build_prior",
    "build_network",
    "build_recordings",
    "dump_part",
    "load_config",
    "load_identify_config",
    "make_filter",
    "make_part",
    "parse_config",
    "parse_identify_config",
]
