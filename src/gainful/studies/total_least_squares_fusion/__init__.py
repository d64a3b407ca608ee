"""Parameters of an underwater vehicle from noisy regressors, by recursive total least squares of two sensors."""

from __future__ import annotations

from ..base import Citation, Study
from . import bias, convergence, costs, fusion, intervals, jump, outage, realistic, tracks, unequal, vehicle

SEED = 1


def study() -> Study:
    """The study of Zhu et al. (2017)."""
    chapters = (fusion, tracks, bias, intervals, convergence, costs, unequal, realistic, vehicle, outage, jump)
    return Study.of(
        [each.chapter() for each in chapters],
        name="total-least-squares-fusion",
        title="Vehicle dynamics by multi-sensor fusion of recursive total least squares",
        about=(
            "Inertia and drag of an underwater vehicle in yaw and in surge, from accelerations, rates and squared rates that "
            "are as noisy as the force. Two sensors see the same motion: least squares and total least squares are given one "
            "of them, the rows of both, or their mean. Then noise as it is on a vehicle, where all regressors come from one "
            "rate sensor, with estimators that know of it, also in six coupled degrees of freedom; a motion that stops; and an "
            "inertia that jumps."
        ),
        citations=(
            Citation(
                ("H.-K. Zhu", "Y.-H. Guo", "J.-M. Mou", "F.-C. Hu", "W.-F. Ren"),
                2017,
                "Dynamics model identification of underwater vehicles based on the multi-sensor fusion of recursive total "
                "least squares",
                "Journal of Ship Mechanics 21(10), 1263-1270",
                note="in Chinese",
                doi="10.3969/j.issn.1007-7294.2017.10.010",
            ),
            Citation(
                ("D.-Z. Feng", "X.-D. Zhang", "D.-X. Chang", "W. X. Zheng"),
                2004,
                "A fast recursive total least squares algorithm for adaptive FIR filtering",
                "IEEE Transactions on Signal Processing 52(10), 2729-2737",
            ),
            Citation(
                ("S. Van Huffel", "J. Vandewalle"),
                1991,
                "The Total Least Squares Problem",
                "SIAM",
            ),
            Citation(("W. A. Fuller",), 1987, "Measurement Error Models", "Wiley"),
        ),
        notes=(
            "The paper's equations were put together again; the recursion agrees with the batch estimate by singular value "
            "decomposition. A variance common to quantities in rad/s^2, rad/s, rad^2/s^2 and N m depends on units: total least "
            "squares does too, unless columns are brought to equal noise.",
        ),
        runs=200,
        seed=SEED,
    )
