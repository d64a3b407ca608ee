"""What the states should have been: who tells a network what it did not know."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ..errors import ConfigError, DataError, ShapeError, did_you_mean
from ..estimates import AbstractEstimate
from ..filters import KalmanFilter
from ..models import AbstractModel
from ..running import Log, Result, run, smooth

TEACHERS = ("reference", "smoother", "truth")


@dataclasses.dataclass(frozen=True)
class Smoother:
    """The filter whose smoothed estimates teach, where it is not the one that is aided.

    Attributes:
        estimator: the filter, such as one whose noise was fitted.
        model: its model, with the same states.
    """

    estimator: KalmanFilter
    model: AbstractModel


def references(
    teacher: Literal["truth", "reference", "smoother"],
    pupil: Smoother,
    priors: Sequence[AbstractEstimate],
    logs: Sequence[Log],
    given: Sequence[Result | Float[np.ndarray, "T size"]] | None,
    smoother: Smoother | None,
) -> tuple[list[Float[np.ndarray, "T size"]], tuple[str, ...]]:
    """The states of each record according to a teacher, and what to say of the teacher.

    Raises:
        ConfigError: an unknown teacher, or one that lacks what it needs.
        DataError: records without truth.
    """
    if teacher not in TEACHERS:
        raise ConfigError(f"teacher: {teacher!r} is not known; {did_you_mean(str(teacher), TEACHERS)}")
    names = pupil.model.space.names
    if teacher == "truth":
        return [_truth(log, names, k) for k, log in enumerate(logs)], ()
    if teacher == "reference":
        if given is None or len(given) != len(logs):
            came = "none" if given is None else str(len(given))
            raise ConfigError(f"reference: expected one per record, {len(logs)}, got {came}")
        tables = [np.asarray(each.mean if isinstance(each, Result) else each, dtype=float) for each in given]
        for log, table in zip(logs, tables, strict=True):
            if table.shape != (len(log), len(names)):
                raise ShapeError(f"reference: expected shape ({len(log)}, {len(names)}), got {table.shape}")
        return tables, ()
    chosen = pupil if smoother is None else smoother
    if chosen.model.space.names != names:
        raise ConfigError(
            f"smoother: expected the states {', '.join(names)}, got {', '.join(chosen.model.space.names)}"
        )
    warnings = ()
    if _same(chosen, pupil):
        warnings = (
            "the teacher is the aided filter itself, smoothed: the correction inherits its errors; fit the noise of the "
            "teacher first, or take a reference",
        )
    smoothed = [
        smooth(run(chosen.estimator, chosen.model, prior, log)) for prior, log in zip(priors, logs, strict=True)
    ]
    return [result.mean for result in smoothed], warnings


def _truth(log: Log, names: tuple[str, ...], k: int) -> Float[np.ndarray, "T size"]:
    if not any(name in log.truth for name in names):
        raise DataError(f"teacher 'truth': record {k} has no truth of {', '.join(names)}")
    return np.stack([log.truth.get(name, np.full(len(log), np.nan)) for name in names], axis=1)


def _same(one: Smoother, other: Smoother) -> bool:
    return bool(eqx.tree_equal((one.estimator, one.model), (other.estimator, other.model)))
