"""Records in, results out."""

from .artefacts import load_part, save_part
from .records import read_log
from .source import Column, LocalFrame, Source
from .tables import Table, read_table
from .units import convert
from .writing import check_folder, whole_folder

__all__ = [
    "Column",
    "LocalFrame",
    "Source",
    "Table",
    "check_folder",
    "convert",
    "load_part",
    "read_log",
    "read_table",
    "save_part",
    "whole_folder",
]
