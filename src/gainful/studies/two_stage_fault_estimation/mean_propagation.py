"""Whether the extended filter errs periodically after a gyro fault, and where such an error comes from."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ...faults.modelling import FaultModel, with_faults
from ...filters import Info, two_stage_extended_kalman_filter, two_stage_unscented_kalman_filter
from ...plants import OrbitAngles, RigidSpacecraft, SwingTarget, TargetAngles, spacecraft_model
from ...plants.attitude_forms import AbstractAttitudeForm
from ..chapter import Chapter
from ..claims import Check, Claim, above, below
from ..experiment import Contender, Experiment, Quantity, Record
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, exactly
from .measures import rms
from .scenarios import DEGREE, END, GYRO, ONSET, STATES, StartsAtReading, flight_of, selected

RUNGE_KUTTA, EULER, LINEARISED = "Runge-Kutta 4", "forward Euler", "linearised mean"
MEANS = (RUNGE_KUTTA, EULER, LINEARISED)
TARGET, ORBIT = "noiseless-target", "noiseless-orbit"
EXTENDED, UNSCENTED = "TSEKF", "TSUKF"
LONG = 20.0  # s; the transient of the start is over
NOTICEABLE = 1e-3  # deg/s; a hundredth of the fault


class LinearisedMean(eqx.Module):
    """A motion whose mean goes where the linearised model takes it: `f(0) + A(x) x` in place of `f(x)`.

    What is quadratic in the state, such as `w x J w`, counts twice then. The Jacobian remains that of `f`.
    """

    motion: Callable[..., Array]

    def __call__(self, x: Array, u: Array, t: Array, dt: Array) -> Array:
        def moved(state: Array) -> Array:
            return self.motion(state, u, t, dt)

        there, slope = jax.jvp(moved, (x,), (x,))
        return there + jax.lax.stop_gradient(moved(jnp.zeros_like(x)) + slope - there)


def model_of(form: AbstractAttitudeForm, mean: str) -> FaultModel:
    """A model with the tuned walk of the gyro's biases that moves its mean in one of three ways."""
    craft = RigidSpacecraft(form=form)
    model = spacecraft_model(craft, step="euler" if mean == EULER else "runge_kutta_4")
    if mean == LINEARISED:
        model = eqx.tree_at(lambda each: each.dynamics.f.fn, model, replace_fn=LinearisedMean)
    return with_faults(model, GYRO.faults(GYRO.tuned))


def named(filtered: str, mean: str) -> str:
    """What the pair of a filter and a way to move the mean is called."""
    return f"{filtered}, {mean}"


class Errors(eqx.Module):
    """Errors of the bias estimates without noise, where all should be 0."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        t, errors = record.truth["t"], _errors(record, info)
        before, steady = selected(t, LONG, ONSET), selected(t, 0.5 * (ONSET + END), END)
        return {
            "before": jnp.max(jnp.where(before[:, None], jnp.abs(errors), 0.0)),
            "steady": rms(errors[:, 0], steady),
        }


class ErrorSeries(eqx.Module):
    """The same along the flight, about x."""

    def __call__(self, record: Record, info: Info) -> dict[str, Array]:
        return {"error": _errors(record, info)[:, 0]}


def _errors(record: Record, info: Info) -> Array:
    estimates = info.estimate.mean[:, STATES:] / DEGREE
    return estimates.at[:, 0].add(-record.truth["fault"])


def _experiment(name: str, title: str, form: AbstractAttitudeForm) -> Experiment:
    filters = {EXTENDED: two_stage_extended_kalman_filter(), UNSCENTED: two_stage_unscented_kalman_filter()}
    models = {mean: model_of(form, mean) for mean in MEANS}
    return Experiment(
        name,
        title,
        flight_of(GYRO, form=form, quiet=True),
        {
            named(kind, mean): Contender(each, model, StartsAtReading(model))
            for mean, model in models.items()
            for kind, each in filters.items()
        },
        Errors(),
        (
            Quantity("before", "largest error before the fault, any axis", "deg/s"),
            Quantity("steady", "steady RMSE, 100 to 150 s", "deg/s"),
        ),
        ErrorSeries(),
        random=False,
    )


def _before(experiment: str, kind: str, mean: str) -> Callable[[Outcome], Measured]:
    return lambda outcome: outcome.mean(experiment, named(kind, mean), "before")


def _cured(mean: str) -> Callable[[Outcome], Measured]:
    unscented, extended = named(UNSCENTED, mean), named(EXTENDED, mean)
    return lambda outcome: outcome.ratio(ORBIT, "before", unscented, over=extended)


def _apart(outcome: Outcome) -> Measured:
    """Greatest difference of the two filters' bias estimates in units of the fault."""
    errors = [outcome.trace(TARGET, named(kind, RUNGE_KUTTA), "error").first for kind in (UNSCENTED, EXTENDED)]
    return exactly(float(np.abs(errors[0] - errors[1]).max()) / GYRO.size)


CLAIMS = (
    Claim(
        "periodic error of the TSEKF",
        "For gyro faults the TSEKF has a periodic error that no tuning removes, and the UKF cures it.",
        "introduction",
        (
            *(
                Check(
                    f"error of the noise-free TSEKF, {word} angles [deg/s]",
                    _before(name, EXTENDED, RUNGE_KUTTA),
                    above(NOTICEABLE),
                )
                for name, word in ((TARGET, "target"), (ORBIT, "orbit"))
            ),
            *(
                Check(f"error of the TSUKF over that of the TSEKF, orbit angles, {mean}", _cured(mean), below(0.5))
                for mean in (EULER, LINEARISED)
            ),
        ),
        {
            "not reproduced": "Such an error comes from moving the mean by the linearised model or in Euler steps, whatever "
            "the covariance does, and the unscented filter then has it too; with Runge-Kutta 4 there is none."
        },
    ),
    Claim(
        "accuracy of sigma points",
        "The unscented transform is more accurate than linearisation here.",
        "section 2",
        (Check("TSUKF and TSEKF apart, in units of the fault", _apart, above(1e-3)),),
        {"not reproduced": "Over a step of 0.05 s the plant is as good as linear across the filter's uncertainty."},
    ),
)  # fmt: skip


def tables(outcome: Outcome) -> list[Table]:
    """Error before the fault and steady error, for both kinds of angles."""
    heads = (
        "filter and mean",
        "target angles: largest before [deg/s]",
        "steady RMSE [deg/s]",
        "orbit angles: largest before [deg/s]",
        "steady RMSE [deg/s]",
    )
    rows = tuple(
        (
            name,
            *(outcome.mean(where, name, what) for where in (TARGET, ORBIT) for what in ("before", "steady")),
        )
        for name in (named(kind, mean) for mean in MEANS for kind in (EXTENDED, UNSCENTED))
    )
    return [Table("Gyro bias without noise: how the mean is moved", heads, rows)]


def figures(outcome: Outcome) -> list[Figure]:
    """The error of the bias along the flight, for the two ways to move the mean that have one."""
    t = outcome.record(ORBIT).truth["t"][::5]
    panels = tuple(
        Panel(
            mean,
            tuple(
                Line(kind, t, outcome.trace(ORBIT, named(kind, mean), "error").first[::5])
                for kind in (EXTENDED, UNSCENTED)
            ),
            "deg/s",
        )
        for mean in (EULER, LINEARISED)
    )
    return [
        Figure(
            "The periodic error, without noise",
            "Error of the bias about x where angles are relative to the orbit. The two filters lie on each other; with "
            "Runge-Kutta 4 both errors are below 1e-7 deg/s.",
            panels,
        )
    ]


def chapter() -> Chapter:
    """The extended filter's periodic error: three ways to move the mean, two kinds of angles, two filters."""
    target = SwingTarget()
    return Chapter(
        (
            _experiment(TARGET, "Gyro bias without noise, target angles", TargetAngles(target)),
            _experiment(ORBIT, "Gyro bias without noise, orbit angles", OrbitAngles(target)),
        ),
        CLAIMS,
        tables,
        figures,
    )
