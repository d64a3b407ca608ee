"""Fault estimation in a satellite's attitude control by two-stage unscented filters."""

from __future__ import annotations

from ..base import Citation, Study
from ..experiment import Experiment
from .claims import CLAIMS, NOISELESS
from .contenders import TUNED, contenders, kinds
from .figures import figures, tables
from .measures import Measure, Traces, quantities
from .scenarios import GYRO, SCENARIOS, flight_of

SEED = 12


def study() -> Study:
    """The study of Chen et al. (2019)."""
    experiments = [
        Experiment(
            scenario.name,
            scenario.title,
            flight_of(scenario),
            contenders(scenario),
            Measure(scenario.scale),
            quantities(scenario),
            Traces(scenario.scale),
            baseline=TUNED,
        )
        for scenario in SCENARIOS
    ]
    noiseless = Experiment(
        NOISELESS,
        "Gyro bias without noise",
        flight_of(GYRO, quiet=True),
        kinds(GYRO),
        Measure(GYRO.scale),
        quantities(GYRO),
        Traces(GYRO.scale),
        random=False,
    )
    return Study(
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
        experiments=(*experiments, noiseless),
        claims=CLAIMS,
        figures=figures,
        tables=tables,
        notes=(
            "The paper prints no error statistics. Noise levels, process noise, target, window and the sizes of the wheel "
            "faults are not legible in it: the numbers hold for the values chosen here.",
            "Tuned filters have the published walk of the fault multiplied by 40, 110 and 13000 in sigma.",
            "The adapted noise is added within the step; process noise of a wheel's fault reaches the innovation one step "
            "later, so that the published equation for its factor is a heuristic.",
        ),
        seed=SEED,
    )
