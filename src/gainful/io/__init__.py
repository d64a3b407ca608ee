"""Records in, results out."""

from .artefacts import load_part, save_part
from .equation_units import parameter_units
from .recordings import Resample, read_recording
from .records import read_log
from .source import Column, LocalFrame, Outage, Source
from .tables import Table, read_table
from .units import convert
from .writing import check_folder, whole_folder

__all__ = [
    "Column",
    "LocalFrame",
    "Outage",
    "Resample",
    "Source",
    "Table",
    "check_folder",
    "convert",
    "load_part",
    "parameter_units",
    "read_log",
    "read_recording",
    "read_table",
    "save_part",
    "whole_folder",
]
