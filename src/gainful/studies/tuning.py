"""Tuning contenders alike, so that a baseline is a fair one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import ConfigError, did_you_mean
from .experiment import Experiment
from .monte_carlo import run_experiment
from .statistics import Measured, mean_interval


@dataclasses.dataclass(frozen=True)
class Tuning:
    """What came of trying settings.

    Attributes:
        best: the setting with the least mean.
        tried: the means of all, by setting.
        at_edge: whether the best is the first or the last tried, so that a better one may lie beyond.
    """

    best: str
    tried: dict[str, Measured]
    at_edge: bool


def tune(
    experiment: Experiment,
    settings: Mapping[str, Callable[[Any], Any]],
    quantity: str,
    *,
    runs: int,
    seed: int,
) -> Tuning:
    """Try settings of a contender on an experiment and take the one with the least mean of a quantity.

    Use another seed than the study's own, or the tuned contender has seen the records it is judged on.

    Args:
        experiment: whose records and measure are used; its contenders are not.
        settings: contenders by the name of their setting, in order.
        quantity: of the experiment, to be made small; a setting that comes to nothing in any run is out.
        runs: Monte Carlo runs per setting.
        seed: of the random keys.

    Raises:
        ConfigError: the experiment has no such quantity, or no setting came to a number.
    """
    names = [each.name for each in experiment.quantities]
    if quantity not in names:
        hint = did_you_mean(quantity, names)
        raise ConfigError(f"{quantity!r} is not a quantity of experiment {experiment.name!r}; {hint}")
    trial = dataclasses.replace(experiment, contenders=settings, baseline="", trace=None, kept=())
    found = run_experiment(trial, runs, seed)
    tried = {name: mean_interval(values[quantity]) for name, values in found.values.items()}
    means = np.array([each.value for each in tried.values()])
    if np.isnan(means).all():
        raise ConfigError(f"settings: none of {len(means)} came to a {quantity} in every run")
    at = int(np.nanargmin(means))
    return Tuning(list(tried)[at], tried, len(means) > 1 and at in (0, len(means) - 1))
