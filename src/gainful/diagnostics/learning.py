"""What a record told of the parameters that were estimated with the states, and when they changed."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import numpy as np

from ..models import AugmentedModel
from ..models.extended import layers
from ..running import Result
from ..spaces import AbstractSpace
from ..updates import ChangeDetection, Changes

NOTHING = 0.9
"""A parameter whose sigma is still this share of what it was before has not been learned."""


@dataclasses.dataclass(frozen=True)
class Change:
    """A state that was found to have changed suddenly.

    Attributes:
        state: its name, as the covariance has it.
        t: time of the alarm [s].
        up: whether it grew.
    """

    state: str
    t: float
    up: bool


@dataclasses.dataclass(frozen=True)
class Learned:
    """What a record told of a parameter.

    Attributes:
        name: of the parameter.
        before: standard deviation before the first row, in tangent units.
        after: the least the filter had at any row.
        changes: sudden changes that were found.
    """

    name: str
    before: float
    after: float
    changes: tuple[Change, ...]

    @property
    def warning(self) -> str:
        """What to think of it, or nothing."""
        if not self.after > NOTHING * self.before:
            return ""
        return (
            f"next to nothing was learned of {self.name}: its sigma never fell below {self.after:.3g}, from {self.before:.3g} "
            "before the first row; is it excited, and does it differ in effect from the others?"
        )


def changes(result: Result) -> tuple[Change, ...]:
    """The sudden changes that a `ChangeDetection` in the filter found, in time order.

    Args:
        result: of a run, or a smoothed one.
    """
    found = result if result.filtered is None else result.filtered
    watchers = parts_of(found.estimator, ChangeDetection)
    out = []
    for watcher, memory in zip(watchers, parts_of(found.memories, Changes), strict=True):
        alarm = np.asarray(memory.alarm)
        for k, name in enumerate(watcher.jumps):
            out += [Change(name, float(found.t[i]), bool(alarm[i, k] > 0)) for i in np.flatnonzero(alarm[:, k])]
    return tuple(sorted(out, key=lambda each: each.t))


def learned(result: Result) -> tuple[Learned, ...]:
    """What a record told of each parameter that is estimated as a state; nothing if there are none.

    Args:
        result: of a run; of a smoothed one the filter is judged.
    """
    found = result if result.filtered is None else result.filtered
    space, names = found.model.space, state_names(found.model.space)
    own = {name for each in layers(found.model) if isinstance(each, AugmentedModel) for name in each.parameter_names}
    before = np.sqrt(np.diagonal(np.asarray(found.prior.cov)))
    when = changes(result)
    return tuple(
        Learned(
            names[tangent],
            float(before[j]),
            float(found.std[found.log.kept, j].min()),
            tuple(each for each in when if each.state == tangent),
        )
        for j, tangent in enumerate(space.tangent_names)
        if names[tangent] in own
    )


def state_names(space: AbstractSpace) -> dict[str, str]:
    """The state that each degree of freedom belongs to: a bounded number goes by another name in the covariance."""
    out: dict[str, str] = {}
    for part in space.parts:
        own = part.names if part.size == part.dof else part.tangent_names
        out |= zip(part.tangent_names, own, strict=True)
    return out


def parts_of(tree: Any, kind: type) -> list[Any]:
    """The parts of a kind in a tree, in order."""
    return [
        leaf for leaf in jax.tree.leaves(tree, is_leaf=lambda each: isinstance(each, kind)) if isinstance(leaf, kind)
    ]
