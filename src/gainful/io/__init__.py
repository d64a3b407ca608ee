"""Records in, results out."""

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
    "read_log",
    "read_table",
    "whole_folder",
]
