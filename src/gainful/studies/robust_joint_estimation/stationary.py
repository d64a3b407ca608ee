"""Parameters that walk at random, four laws of the sensors' noise: the paper's figures 5 to 7, and the main table."""

from __future__ import annotations

from typing import Any

from ...filters import unscented_kalman_filter
from ..chapter import Chapter
from ..claims import Check, Claim, above, below, between
from ..contender_table import compared
from ..experiment import Contender
from ..figures import Band, Figure, Line, Panel, Table
from ..outcome import Outcome
from .comparing import across, lower, mean
from .contenders import (
    CORRENTROPY,
    NOMINAL,
    RA,
    SCHOOLS,
    START,
    STUDENT,
    TOLD,
    TOTAL,
    Belief,
    believed,
    believing,
    contender,
    update,
)
from .figures import PARAMETERS, errors_over_time, outliers
from .linear import frozen, regression
from .measures import NAMES, judged
from .records import NOISES, WALK, drive

PRIOR, FROZEN, REGRESSION = "KF, parameters of the prior", "KF, nominal parameters", "regression KF"
UNSCENTED = "RA, unscented"
TITLES = {
    "gaussian": "Gaussian noise",
    "mixture": "10 % gross errors",
    "t3": "Student-t noise",
    "bursts": "bursts",
}
"""Laws of the chapter by name; "t3" has three degrees of freedom."""
ZOOM = (700, 900)  # samples


def everybody(noise: str) -> dict[str, Any]:
    """All contenders with the walk that the parameters have."""
    law, walks = NOISES[noise], Belief(WALK)
    return {
        **{name: contender(name, believing(name, law, walks)) for name in (*SCHOOLS, TOLD)},
        UNSCENTED: Contender(unscented_kalman_filter(update=update(RA)), *believed(walks)),
        PRIOR: frozen(*START[3:]),
        FROZEN: frozen(1.0, 1.0),
        REGRESSION: regression(WALK),
    }


def tables(outcome: Outcome) -> list[Table]:
    """The main table, and biases and consistency in mixture noise."""
    names = tuple(outcome.results["mixture"].experiment.contenders)
    words = {"x": "the states, in sigmas of the sensors", "p": "the parameters"}
    main = [
        compared(
            outcome,
            f"Walking parameters: log10 of the mean squared error of {word}",
            names,
            [(title, noise, what) for noise, title in TITLES.items()],
        )
        for what, word in words.items()
    ]
    bias = compared(
        outcome,
        "Biases, 10 % gross errors; states in sigmas of the sensors",
        names,
        [(each, "mixture", f"bias_{each}") for each in NAMES],
    )
    nees = compared(
        outcome,
        "Squared errors over what the filter claims (NEES; 1 is consistent), 10 % gross errors",
        names,
        [(each, "mixture", f"nees_{each}") for each in NAMES],
    )
    return [*main, bias, nees]


def figures(outcome: Outcome) -> list[Figure]:
    """Figures 5, 6 and 7 of the paper."""
    return [_states(outcome), _parameters(outcome), *(errors_over_time(outcome, n, *_look(n)) for n in TITLES)]


def _look(noise: str) -> tuple[str, tuple[str, ...]]:
    return f"Squared errors, {TITLES[noise]}: figure 7 of the paper", (
        RA,
        NOMINAL,
        TOTAL,
        CORRENTROPY,
        STUDENT,
        PRIOR,
        TOLD,
    )


def _states(outcome: Outcome) -> Figure:
    rows = slice(*ZOOM)
    record = outcome.record("mixture")
    t, truth = record.truth["t"][rows], record.truth["states"][rows]
    panels = []
    for i, label in enumerate(("position", "velocity", "load pressure")):
        lines = [
            Line(name, t, outcome.trace("mixture", name, "states").first[rows, i]) for name in (RA, NOMINAL, PRIOR)
        ]
        reference = Line("truth", t, truth[:, i], reference=True)
        panels.append(Panel(f"{label} over its scale", (reference, *lines, outliers(record, i, rows))))
    return Figure(
        "States: figure 5 of the paper",
        "A fifth of a second of the first record, with the readings that are gross errors as far as they fit.",
        tuple(panels),
    )


def _parameters(outcome: Outcome) -> Figure:
    record = outcome.record("mixture")
    t, truth = record.truth["t"], record.truth["parameters"]
    panels = []
    for j, label in enumerate(PARAMETERS):
        marks: list[Line | Band] = []
        for name in (RA, TOTAL):
            mean, sigma = (outcome.trace("mixture", name, what).first[:, j] for what in ("parameters", "sigma"))
            marks += [Band(name, t, mean - 2 * sigma, mean + 2 * sigma, "2 sigma"), Line(name, t, mean)]
        marks.append(Line(NOMINAL, t, outcome.trace("mixture", NOMINAL, "parameters").first[:, j]))
        marks.append(Line("truth", t, truth[:, j], reference=True))
        panels.append(Panel(label, tuple(marks)))
    return Figure(
        "Parameters: figure 6 of the paper",
        "The first record, with bands of two standard deviations as the filters have them.",
        tuple(panels),
    )


def _nees_above(other: str) -> Check:
    return Check(
        f"NEES of x3, {other} less RA, mixture",
        lambda outcome: outcome.difference("mixture", "nees_x3", other, minus=RA),
        above(0.05),
    )


SENSITIVE = "more log10 MSE of states in mixture than in Gaussian noise"
CLAIMS = (
    Claim(
        "states (C1)",
        "Of KF, EKF and the robust filter the last tracks the states best, and it is approximately unbiased.",
        "figure 5, no numbers",
        (
            lower("x", "mixture", RA, NOMINAL),
            lower("x", "mixture", RA, TOTAL),
            lower("x", "mixture", RA, FROZEN),
            *(
                mean(f"bias of {each} in sigmas, RA, mixture", "mixture", RA, f"bias_{each}", between(-0.05, 0.05))
                for each in NAMES[:3]
            ),
        ),
        {"reproduced": "Other robust filters do as well or slightly better, see below."},
    ),
    Claim(
        "parameters (C2)",
        "The robust filter identifies viscous friction and bulk modulus accurately.",
        "figure 6, no numbers",
        (
            mean("RMSE of p1, RA, mixture", "mixture", RA, "rmse_p1", below(0.06)),
            mean("RMSE of p2, RA, mixture", "mixture", RA, "rmse_p2", below(0.03)),
            mean("bias of p1, RA, mixture", "mixture", RA, "bias_p1", between(-0.02, 0.02)),
            mean("bias of p2, RA, mixture", "mixture", RA, "bias_p2", between(-0.02, 0.02)),
            lower("p", "mixture", RA, TOLD, by=-0.05),
        ),
        {"reproduced": "It is about as good as the filter that knows the outliers."},
    ),
    Claim(
        "lowest curve (C3)",
        "The logarithm of the squared error of the robust filter is the lowest, for states and parameters.",
        "figure 7, no numbers",
        tuple(lower(what, "mixture", RA, other) for other in (NOMINAL, TOTAL, PRIOR) for what in ("x", "p")),
        {
            "reproduced": "For the parameters the advantage over an extended filter told the total variance is small, a factor "
            "of about 1.4 where it is 2.5 for the states."
        },
    ),
    Claim(
        "twice as accurate",
        "The robust filter halves the squared error of an extended filter that is told the total variance.",
        "not in the paper, which does not say what its EKF is told",
        (lower("x", "mixture", RA, TOTAL, by=0.3), lower("p", "mixture", RA, TOTAL, by=0.3)),
        {"partly": "It does for the states, not for the parameters."},
    ),
    Claim(
        "insensitive to the noise (C4)",
        "The robust filter is little sensitive to noise that is not Gaussian.",
        "in words",
        (
            across(SENSITIVE, RA, "mixture", "gaussian", below(0.15), where="same records but for the outliers"),
            across(SENSITIVE, NOMINAL, "mixture", "gaussian", above(0.5), where="same records but for the outliers"),
            lower("x", "t3", RA, TOTAL),
            lower("x", "bursts", RA, TOTAL),
            lower("x", "gaussian", RA, NOMINAL, by=-0.05),
            lower("p", "gaussian", RA, NOMINAL, by=-0.03),
        ),
    ),
    Claim(
        "better than other robust filters",
        "The robust filter is more accurate than later ones: correntropy and Student-t.",
        "not in the paper",
        (
            lower("x", "mixture", RA, CORRENTROPY),
            lower("x", "mixture", RA, STUDENT),
            lower("p", "mixture", RA, CORRENTROPY),
        ),
        {"not reproduced": "They are more accurate by some per cent of the squared error."},
    ),
    Claim(
        "honest",
        "Among the robust filters it is the one whose covariance tells its errors.",
        "not in the paper",
        (
            *(mean(f"NEES of {each}, RA, mixture", "mixture", RA, f"nees_{each}", between(0.8, 1.2)) for each in NAMES),
            *(_nees_above(other) for other in (CORRENTROPY, STUDENT)),
        ),
    ),
)


def chapter() -> Chapter:
    """Filters that know how the parameters walk, and how the readings are distributed or not."""
    experiments = tuple(
        judged(noise, title[0].upper() + title[1:], drive(NOISES[noise], walk=WALK), everybody(noise), baseline=TOTAL)
        for noise, title in TITLES.items()
    )
    return Chapter(experiments, CLAIMS, tables, figures)
