"""Attitude control of a flexible spacecraft by the inverse of a network that learns one step ahead."""

from __future__ import annotations

from ..base import Citation, Study
from . import (
    compensation,
    convergence,
    gain_change,
    identification,
    ladder,
    long_run,
    margins,
    rivals,
    saturation,
    tracking,
)

SEED = 1


def study() -> Study:
    """The study of Liu, Shen and Hu."""
    chapters = (
        tracking,
        compensation,
        ladder,
        rivals,
        gain_change,
        margins,
        long_run,
        saturation,
        convergence,
        identification,
    )
    return Study.of(
        [each.chapter() for each in chapters],
        name="neural-inverse-control",
        title="Attitude control of a flexible spacecraft by the inverse of a high-order network",
        about=(
            "A hub with elastic appendages slews about three axes. A network of radial basis functions of the "
            "products of its inputs predicts the state one sample ahead; a Kalman filter goes on learning its "
            "weights; a second one, or Gauss-Newton steps, finds the torque that leads to the state that is wanted; a "
            "running mean of the model's error is taken off the target. Beside it fly regressions on the same inputs, "
            "laws an engineer would try first, tuned alike, and incremental inversion. Then what scales and outputs "
            "have to be, what compensation does to the margin, a loss of inertia in flight, a quarter of an hour of "
            "learning with and without guards, and torques at their limit."
        ),
        citations=(
            Citation(
                ("Liu Chunmei", "Shen Yi", "Hu Hengzhang"),
                2000,
                "Attitude control of nonlinear flexible structure based on inversion algorithm of extended Kalman "
                "filter of high-order neural networks",
                "Harbin Institute of Technology",
                note="in Chinese; journal and year not verified",
            ),
            Citation(
                ("L. Behera", "M. Gopal", "S. Chaudhury"),
                1996,
                "On adaptive trajectory tracking of a robot manipulator using inversion of its neural emulator",
                "IEEE Transactions on Neural Networks 7(6), 1401-1414",
            ),
            Citation(
                ("S. Chen", "C. F. N. Cowan", "P. M. Grant"),
                1991,
                "Orthogonal least squares learning algorithm for radial basis function networks",
                "IEEE Transactions on Neural Networks 2(2), 302-309",
            ),
            Citation(
                ("S. Sieberling", "Q. P. Chu", "J. A. Mulder"),
                2010,
                "Robust flight control using incremental nonlinear dynamic inversion and angular acceleration prediction",
                "Journal of Guidance, Control, and Dynamics 33(6), 1732-1742",
            ),
            Citation(
                ("M. E. Salgado", "G. C. Goodwin", "R. H. Middleton"),
                1988,
                "Modified least squares algorithm incorporating exponential resetting and forgetting",
                "International Journal of Control 47(2), 477-491",
            ),
        ),
        notes=(
            "The publication gives no numbers but those of the spacecraft. Scales, centres, sampling, slews, noise, "
            "weights and the disturbance are chosen here. Its plant has one derivative too many in one coupling and "
            "one too few in the other; its derivative of the network has a wrong index and lacks the centre of the "
            "product: both are read as units and differentiation ask for.",
            "A run is a network with centres and training samples of its own, and noise of its own. All networks are "
            "trained on the nominal spacecraft; what is flown is said in the title of each table.",
            "The state is measured, deflections and their rates included, as the publication assumes.",
        ),
        seed=SEED,
    )
