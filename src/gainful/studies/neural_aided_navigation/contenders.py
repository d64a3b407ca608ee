"""Who competes: the design filter, networks beside it, the same filter tuned without them, and those that adapt."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp

from ...filters import InteractingMultipleModel, KalmanFilter, kalman_filter
from ...noise import InnovationMatching, SageHusa, Scaled
from ...updates import StrongTracking, VariationalCovariances, VariationalNoise
from ..prepared import once
from .aiding import aided, as_recommended, filtered
from .noise import KNOWN, Belief, design, fitted, fitted_robustly, fitted_to_truth, robust_filter, true_noise

DESIGN, DESIGN_WIDE, ML, TRUE, TRUTH_TUNED = (
    "KF, design",
    "KF, design, wide start",
    "KF, ML",
    "KF, true noise",
    "KF, tuned to truth",
)
CMAC, CMAC_GATED = "CMAC, 10 layers", "CMAC, 10 layers, gated offline"
ML_CMAC, ML_CMAC_GATED = "KF, ML + CMAC", "KF, ML + CMAC, gated offline"
ML_MLP, ML_CMACS = "KF, ML + MLP, history", "KF, ML + CMAC, history"
VB_R, VB_PR, STF, IMM = "VB-R", "VB-PR", "strong tracking", "IMM"
SAGE_HUSA, MATCHING, HUBER, HUBER_ML = "Sage-Husa", "innovation matching", "Huber", "Huber, fitted as such"
ADAPTIVE = (VB_R, VB_PR, STF, IMM, SAGE_HUSA, MATCHING, HUBER)
RECOMMENDED = "CMAC, 10 layers, both gates"
PAPER = (
    "BP, SGD",
    "BP, L-BFGS",
    "CMAC, 10 levels",
    "CMAC, 10 cells",
    CMAC,
    "CMAC, compressed",
    "affine map",
    "CMAC, leaky innovation",
    "CMAC, history",
    "CMAC, fed back",
)
"""Networks beside the design, trained with truth."""

_STAY = 0.97
"""Probability that a model of the bank holds for another step."""
_SPEEDS, _FIXES = (0.1, 1.0, 10.0), (0.02, 0.2, 2.0, 20.0)
"""Factors on the variances of speed and fixes in the bank."""
_LEAST_POSITION, _LEAST_FIX = 0.1, 0.1  # m


@once
def _adaptive(name: str) -> KalmanFilter:
    return {
        VB_R: lambda: kalman_filter(update=VariationalNoise()),
        VB_PR: lambda: kalman_filter(update=VariationalCovariances()),
        STF: lambda: kalman_filter(update=StrongTracking(softening=1.0)),
        SAGE_HUSA: lambda: KalmanFilter(noise=SageHusa()),
        MATCHING: lambda: KalmanFilter(noise=InnovationMatching()),
        HUBER: robust_filter,
        HUBER_ML: robust_filter,
    }[name]()


@once
def bank() -> InteractingMultipleModel:
    """Filters with less and more noise than believed, in speed and in the fixes."""
    members = tuple(
        KalmanFilter(noise=Scaled({"speed": jnp.sqrt(speed)}, {"fix": jnp.sqrt(fix)}))  # type: ignore[dict-item]
        for speed in _SPEEDS
        for fix in _FIXES
    )
    count = len(members)
    change = (1.0 - _STAY) / (count - 1)
    transition = tuple(tuple(_STAY if i == j else change for j in range(count)) for i in range(count))
    return InteractingMultipleModel(members, transition)


def adaptive(name: str, scenario: str) -> Any:
    """A filter that adapts, from the noise fitted to the records; strong tracking from the design.

    Args:
        name: of the filter.
        scenario: whose records the noise is fitted to.
    """
    if name == STF:
        return filtered(design(), _adaptive(STF))
    if name == HUBER_ML:
        return filtered(fitted_robustly(scenario), _adaptive(HUBER))
    believed = fitted(scenario)
    if name == IMM:
        position, speed, fix = believed.sigmas
        return filtered(Belief((max(position, _LEAST_POSITION), speed, max(fix, _LEAST_FIX))), bank())
    return filtered(believed, _adaptive(name))


Maker = Callable[[], Any]


def common(scenario: str) -> dict[str, Maker]:
    """Makers of those that compete in every scenario."""
    makers: dict[str, Maker] = {
        DESIGN: lambda: filtered(design()),
        CMAC: lambda: aided(CMAC, scenario),
        CMAC_GATED: lambda: aided(CMAC, scenario, offline=True),
        ML: lambda: filtered(fitted(scenario)),
        ML_CMAC: lambda: aided(ML_CMAC, scenario),
        ML_CMAC_GATED: lambda: aided(ML_CMAC, scenario, offline=True),
        ML_CMACS: lambda: aided(ML_CMACS, scenario),
        ML_MLP: lambda: aided(ML_MLP, scenario),
        **{name: functools.partial(adaptive, name, scenario) for name in ADAPTIVE},
        TRUTH_TUNED: lambda: filtered(fitted_to_truth(scenario)),
    }
    if scenario == "outliers":
        makers[HUBER_ML] = functools.partial(adaptive, HUBER_ML, scenario)
    if scenario in KNOWN:
        makers[TRUE] = lambda: filtered(true_noise(scenario))
    return makers


def published() -> dict[str, Maker]:
    """Makers of the further ones that the paper's table is made of, and those that anybody would try beside."""
    makers: dict[str, Maker] = {DESIGN_WIDE: lambda: filtered(design(wide=True))}
    makers |= {name: functools.partial(aided, name, "calibrated") for name in PAPER if name != CMAC}
    makers[RECOMMENDED] = lambda: as_recommended(CMAC, "calibrated")
    return makers
