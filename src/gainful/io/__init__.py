"""Records in, results out."""

from .equation_units import parameter_units
from .recordings import Resample, read_recording
from .records import read_log
from .source import Column, LocalFrame, Source
from .tables import Table, read_table
from .units import convert
from .writing import check_folder, whole_folder

__all__ = [
    "Column",
    "LocalFrame",
    "Resample",
    "Source",
    "Table",
    "check_folder",
    "convert",
    "parameter_units",
    "read_log",
    "read_recording",
    "read_table",
    "whole_folder",
]
