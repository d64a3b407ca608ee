"""Small linear plants with faults, the same object in value at every call."""

from __future__ import annotations

from typing import Any

import numpy as np

import gainful as gf
from gainful.faults import FaultModel, actuator_offset, extend_prior, with_faults

STEP = 0.1  # s
MASS = 2.0  # kg


def cart(outputs: int = 1) -> gf.models.AbstractModel:
    """A double integrator with two thrusters; its position is read by `outputs` sensors."""
    F = [[1.0, STEP], [0.0, 1.0]]
    B = np.array([[0.5 * STEP**2, 0.5 * STEP**2], [STEP, STEP]]) / MASS
    return gf.linear_model(
        F,
        [[1.0, 0.0]] * outputs,
        Q=[0.0, 1e-6],
        R=1e-4 * np.eye(outputs),
        B=B,
        states={"position": "m", "speed": "m/s"},
        inputs={"left": "N", "right": "N"},
        outputs={f"range{i}": "m" for i in range(outputs)},
    )


def faulty(plant: gf.models.AbstractModel, *faults: Any) -> tuple[FaultModel, gf.Gaussian]:
    """The plant with faults, and a prior."""
    model = with_faults(plant, faults)
    return model, extend_prior(model, gf.make_prior(plant, np.zeros(plant.space.size), np.full(plant.space.dof, 0.1)))


def pyramid() -> tuple[FaultModel, gf.Gaussian]:
    """Three rates, measured, that four wheels on the faces of a pyramid turn; each wheel may have an offset."""
    slope = np.deg2rad(35.26)
    c, s = np.cos(slope), np.sin(slope)
    axes = np.array([[c, 0, s], [0, c, s], [-c, 0, s], [0, -c, s]]).T
    wheels = {f"wheel_{k}": "N*m" for k in range(1, 5)}
    plant = gf.linear_model(
        np.eye(3),
        np.eye(3),
        Q=[1e-8] * 3,
        R=1e-6 * np.eye(3),
        B=0.1 * axes / 10.0,  # 0.1 s, 10 kg m^2
        states=["wx", "wy", "wz"],
        inputs=wheels,
        outputs=["gx", "gy", "gz"],
    )
    return faulty(plant, *(actuator_offset(name, sigma=0.05, walk=1e-4) for name in wheels))
