"""Fault estimation in a satellite's attitude control by two-stage unscented filters."""

from __future__ import annotations

from ..base import Citation, Study
from . import accuracy, detection, estimation, isolation, mean_propagation, misset_noise, reconfiguration, slew

SEED = 12


def study() -> Study:
    """The study of Chen et al. (2019)."""
    chapters = (
        estimation,
        misset_noise,
        detection,
        mean_propagation,
        isolation,
        reconfiguration,
        slew,
        accuracy,
    )
    return Study.of(
        [each.chapter() for each in chapters],
        name="two-stage-fault-estimation",
        title="Fault estimation in satellite attitude control by the adaptive two-stage unscented filter",
        about=(
            "A spacecraft with three reaction wheels follows a swinging target. About its x axis, from 50 to 150 s, a wheel "
            "adds a torque of 0.03 N m, or loses half of its effect, or the gyro reads 0.1 deg/s too much. Filters estimate "
            "attitude and fault together: the two-stage unscented filter as published, its adaptive form read in several "
            "ways, and rivals that were tuned as fairly."
        ),
        citations=(
            Citation(
                ("X. Chen", "R. Sun", "F. Wu", "W. Jiang"),
                2019,
                "Fault estimation in satellite attitude control system based on ATSUKF algorithm",
                "Acta Aeronautica et Astronautica Sinica 40(5), 322551",
                note="in Chinese",
            ),
            Citation(
                ("C. Hajiyev", "H. E. Soken"),
                2013,
                "Robust adaptive Kalman filter for estimation of UAV dynamics in the presence of sensor/actuator faults",
                "Aerospace Science and Technology 28(1), 376-383",
            ),
            Citation(
                ("A. S. Willsky", "H. L. Jones"),
                1976,
                "A generalized likelihood ratio approach to the detection and estimation of jumps in linear systems",
                "IEEE Transactions on Automatic Control 21(1), 108-112",
            ),
        ),
        notes=(
            "The paper prints no error statistics. Noise levels, process noise, target, window and the sizes of the wheel "
            "faults are not legible in it: the numbers hold for the values chosen here.",
        ),
        seed=SEED,
    )
