"""Studies by the name the command line knows them by."""

from __future__ import annotations

import dataclasses
import importlib

from ..errors import ConfigError, did_you_mean
from .base import Study


@dataclasses.dataclass(frozen=True)
class Entry:
    """Where a study is made; nothing of it is imported before it is wanted.

    Attributes:
        summary: one line for the list of studies.
        place: "module:function", the function returning the `Study`.
    """

    summary: str
    place: str


STUDIES: dict[str, Entry] = {
    "neural-aided-navigation": Entry(
        "a navigation filter whose noise is not known, aided by networks, and the same filter tuned without them",
        "gainful.studies.neural_aided_navigation:study",
    ),
    "neural-inverse-control": Entry(
        "a flexible spacecraft turned by the inverse of a network that learns, with its rivals, margins and guards",
        "gainful.studies.neural_inverse_control:study",
    ),
    "robust-joint-estimation": Entry(
        "states and parameters of a hydraulic servo axis by filters that withstand outliers, with jumps of the parameters",
        "gainful.studies.robust_joint_estimation:study",
    ),
    "total-least-squares-fusion": Entry(
        "inertia and drag of an underwater vehicle from noisy regressors of two sensors, by recursive total least squares",
        "gainful.studies.total_least_squares_fusion:study",
    ),
    "two-stage-fault-estimation": Entry(
        "faults of a spacecraft's wheels and gyro by (adaptive) two-stage unscented filters",
        "gainful.studies.two_stage_fault_estimation:study",
    ),
}
"""The studies there are; `STUDIES[name] = Entry(...)` adds another."""


def find_study(name: str) -> Study:
    """The study of a name.

    Raises:
        ConfigError: there is none of that name.
    """
    check_study(name)
    module, _, function = STUDIES[name].place.partition(":")
    return getattr(importlib.import_module(module), function)()


def check_study(name: str) -> None:
    """Raise a `ConfigError` unless there is a study of that name."""
    if name not in STUDIES:
        raise ConfigError(f"{name!r} is not a study; {did_you_mean(name, STUDIES)}")
