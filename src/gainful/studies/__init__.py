"""Studies: published experiments repeated, with intervals, fair baselines and a verdict per claim."""

from .base import Citation, Study
from .chapter import Chapter
from .claims import Check, Claim, Finding, Tolerance, above, below, between, near
from .experiment import Contender, Experiment, Quantity, Record
from .figures import Band, Chart, Figure, Line, Panel, Table
from .monte_carlo import Trace
from .outcome import Outcome
from .prepared import Prepared
from .registry import STUDIES, Entry, find_study
from .statistics import (
    Measured,
    difference_interval,
    exactly,
    mean_interval,
    median_interval,
    ratio_interval,
    rms_interval,
    share_interval,
)
from .tuning import Tuning, tune

__all__ = [
    "STUDIES",
    "Band",
    "Chapter",
    "Chart",
    "Check",
    "Citation",
    "Claim",
    "Contender",
    "Entry",
    "Experiment",
    "Figure",
    "Finding",
    "Line",
    "Measured",
    "Outcome",
    "Panel",
    "Prepared",
    "Quantity",
    "Record",
    "Study",
    "Table",
    "Tolerance",
    "Trace",
    "Tuning",
    "above",
    "below",
    "between",
    "difference_interval",
    "exactly",
    "find_study",
    "mean_interval",
    "median_interval",
    "near",
    "ratio_interval",
    "rms_interval",
    "share_interval",
    "tune",
]
