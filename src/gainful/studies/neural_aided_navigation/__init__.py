"""Networks beside a navigation filter whose noise is not known, and inside its sensors."""

from __future__ import annotations

from ..base import Citation, Study
from . import learning, mismatch, outage, route_map, table_one, teachers, transfer
from .records import SEED


def study() -> Study:
    """The study of Zhang, Yang and Sun (2010)."""
    chapters = (table_one, mismatch, learning, teachers, transfer, route_map, outage)
    return Study.of(
        [each.chapter() for each in chapters],
        name="neural-aided-navigation",
        title="A Kalman filter of integrated navigation aided by a CMAC",
        about=(
            "A body on a track is fixed every 10 s by a filter whose noise is wrong. A small network (CMAC, "
            "perceptron, straight line) is told of each step and adds a correction to the estimate, learned from "
            "records with truth. Beside it always the same filter with noise fitted to records without truth, "
            "and filters that adapt. Eight scenarios, learning curves, teachers, use elsewhere than where it was "
            "trained, gates; then networks as maps of sensors: fixes that err by place, and a land vehicle "
            "without satellites for two minutes."
        ),
        citations=(
            Citation(
                ("Y. Zhang", "B. Yang", "J. Sun"),
                2010,
                "Application of CMAC-based Kalman filtering technology in integrated navigation system",
                "Modern Electronics Technique 33(21), 51-53",
                note="in Chinese",
            ),
            Citation(
                ("S.-F. Su", "T. Tao", "T.-H. Hung"),
                2003,
                "Credit assigned CMAC and its application to online learning robust controllers",
                "IEEE Transactions on Systems, Man, and Cybernetics B 33(2), 202-213",
            ),
            Citation(
                ("L. Chin",),
                1994,
                "Application of neural networks in target tracking data fusion",
                "IEEE Transactions on Aerospace and Electronic Systems 30(1), 281-287",
            ),
            Citation(
                ("J. S. Albus",),
                1975,
                "A new approach to manipulator control: the cerebellar model articulation controller",
                "Journal of Dynamic Systems, Measurement, and Control 97(3), 220-227",
            ),
        ),
        notes=(
            "The paper gives no noise, no start, no unit of time, no number of runs and no structure of its "
            "perceptron. The noise of the calibrated scenario, and the design's, are chosen so that its filter "
            "alone settles and errs as in the paper's table; the columns with networks are then predictions. Its "
            "table of ten is read as ten layers, ten levels and ten cells.",
            "The sign of the correction, the learning rate in the credit rule and the constants of the plain rule are lost in "
            "print; credit is given after use.",
            "At a steady gain all that the network is told are functions of the one innovation.",
            "Networks and noise are learned from 40 and up to 12 records that no contender is judged on, anew in every "
            "study; another 30 set the gates. Their random keys do not depend on the seed that is asked for.",
            "VB-PR keeps R within bounds. Without them it takes the errors of the start for noise of the fixes and remembers "
            "them: 0.010 m^2 in place of 0.0063, as in an independent program.",
            "The vehicle's readings of one moment are used together, by one linearisation.",
        ),
        runs=100,
        seed=SEED,
    )
