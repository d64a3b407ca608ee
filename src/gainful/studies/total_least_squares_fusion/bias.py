"""The bias of least squares as theory has it and as it is, the paper's tables 1 and 2, and that of total least squares."""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ...regression import least_squares_bias
from ..chapter import Chapter
from ..claims import Check, Claim, between
from ..figures import Table
from ..outcome import Outcome
from ..statistics import Measured
from .comparing import scaled, worst_of
from .contenders import RLS_F, RTLS_F
from .fusion import CASES, title
from .intervals import STACKED, asked
from .records import PARAMETERS, SAMPLES, SURGE, WORDS, YAW, motion


@functools.cache
def theory(name: str) -> Float[np.ndarray, "3"]:
    """The bias of stacked least squares in the limit of many rows, which two equal sensors share with one."""
    axis, variance = CASES[name]
    regressors = motion(SAMPLES)
    moment = regressors.T @ regressors / SAMPLES
    return np.asarray(least_squares_bias(moment, jnp.asarray(axis.theta), variance * jnp.eye(4)))


def tables(outcome: Outcome) -> list[Table]:
    """Tables 1 and 2 of the paper, and the same for total least squares."""
    out = []
    for number, axis in enumerate((YAW, SURGE), 1):
        cases = [name for name, (which, _) in CASES.items() if which is axis]
        rows = tuple(
            (
                f"{WORDS[each]} [{unit}]",
                *(
                    cell
                    for name in cases
                    for cell in (
                        f"{theory(name)[i]:.3f}",
                        outcome.mean(name, RLS_F, each),
                        outcome.mean(asked(name), STACKED, f"bias_{each}"),
                    )
                ),
            )
            for i, (each, unit) in enumerate(axis.unit_of.items())
        )
        heads = [f"{what}, {CASES[name][1]:g}" for name in cases for what in ("theory", "found", "from the record")]
        out.append(Table(f"Bias of RLS_F, {axis.name}: table {number} of the paper", ("Parameter", *heads), rows))
    rows = tuple(
        (title(name).capitalize(), *(outcome.mean(name, RTLS_F, each) for each in PARAMETERS)) for name in CASES
    )
    out.append(Table("Bias of RTLS_F after 2000 samples", ("Experiment", *WORDS.values()), rows))
    return out


def _percent(found: Measured, name: str, parameter: str, less: float = 0.0) -> Measured:
    """A bias, less another, in per cent of the parameter."""
    return scaled(found, 100.0 / CASES[name][0].theta[PARAMETERS.index(parameter)], "%", -less)


def _off_theory(name: str) -> Check:
    return Check(
        f"bias found less theory, the parameter with the greatest difference, {name}",
        worst_of(
            lambda outcome, each: _percent(
                outcome.mean(name, RLS_F, each), name, each, float(theory(name)[PARAMETERS.index(each)])
            )
        ),
        between(-1.5, 1.5),
    )


def _from_record(name: str) -> Check:
    return Check(
        f"bias estimated from the record less theory, the parameter with the greatest difference, {name}",
        worst_of(
            lambda outcome, each: _percent(
                outcome.mean(asked(name), STACKED, f"bias_{each}"),
                name,
                each,
                float(theory(name)[PARAMETERS.index(each)]),
            )
        ),
        between(-3.0, 3.0),
    )


def _unbiased(name: str) -> Check:
    return Check(
        f"bias of RTLS_F, the parameter with the greatest, {name}",
        worst_of(lambda outcome, each: _percent(outcome.mean(name, RTLS_F, each), name, each)),
        between(-3.0, 3.0),
    )


def _early(name: str) -> Check:
    def over_typical(outcome: Outcome) -> Measured:
        """The mean over the median, whose own interval is narrow beside the mean's."""
        mean, median = (getattr(outcome, which)(name, RTLS_F, "error_50") for which in ("mean", "median"))
        return scaled(mean, 1.0 / median.value)

    return Check(f"mean over median of the error after 50 samples, RTLS_F, {name}", over_typical, between(0.67, 1.5))


CLAIMS = (
    Claim(
        "bias of LS (1)",
        "The theoretical bias of the stacked least squares estimate agrees with experiment.",
        "tables 1 and 2",
        (*map(_off_theory, CASES), *map(_from_record, CASES)),
        {"reproduced": "It can also be told from a record alone, where the noise is isotropic."},
    ),
    Claim(
        "unbiased (9)",
        "Total least squares is unbiased.",
        "in words",
        (*map(_unbiased, CASES), *map(_early, CASES)),
        {
            "partly": "It is consistent: its bias is gone after many samples. After few it has no mean to speak of, its errors "
            "being ratios whose denominator may vanish; medians tell, means do not."
        },
    ),
)


def chapter() -> Chapter:
    """What the paper's tables say; it reads the experiments of the fusion and of the intervals."""
    return Chapter((), CLAIMS, tables)
