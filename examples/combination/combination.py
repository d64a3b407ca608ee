"""Two stages, a robust update and adaptive noise in one filter, against each of them alone and in pairs.

python combination.py           # the comparison: tables, and a report in out/combination
python combination.py --tune    # what the settings below were found by
python combination.py --record  # one flight as the file that combination.toml reads
"""

# ruff: noqa: T201

import itertools
import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd

import gainful as gf
from gainful.errors import DataError
from gainful.estimates import Gaussian, TwoStage
from gainful.faults import (
    Bias,
    FaultySignals,
    actuator_offset,
    calibrate_threshold,
    detection_delay,
    fault_scores,
    windowed_mean,
    with_faults,
)
from gainful.linalg import root_and_inverse
from gainful.linearization import MarginalSigmaPoints
from gainful.models import Instant, Sample
from gainful.plants import RigidSpacecraft, fly, spacecraft_model
from gainful.plants.rigid_spacecraft import GYRO_SIGMA, STAR_TRACKER_SIGMA
from gainful.studies import (
    STUDIES,
    Chart,
    Check,
    Citation,
    Claim,
    Contender,
    Entry,
    Experiment,
    Figure,
    Line,
    Panel,
    Quantity,
    Record,
    Study,
    Table,
    below,
    between,
    median_interval,
    share_interval,
    tune,
)

HERE = Path(__file__).parent
DEGREE = np.pi / 180.0  # rad
DURATION, ONSET, SETTLED = 60.0, 25.0, 8.0  # s
OFFSET = 0.01  # N m, added by the wheel about x from the onset on
SHARE, GROSS = 0.05, 10.0  # of the readings, each on its own, and how many sigmas of the sensor they are off
FACTORS = (0.5, 4.0)  # true sigma of a sensor over the one in its data sheet: anything between
DATA_SHEET = np.repeat([GYRO_SIGMA, STAR_TRACKER_SIGMA], 3)  # rad/s and rad
START = 5.0 * DATA_SHEET  # sigma of the estimate before the first reading
RATE, MERGE, SOON = 2e-3, 1.0, 30.0  # false alarms per second; s; s after the onset by which a fault must be found
WINDOW = 20  # normalised innovations averaged where a filter has no fault among its states
SEED, TUNING_SEED = 7, 1007

TORQUES = ("torque_x", "torque_y", "torque_z")
READINGS = ("gyro_x", "gyro_y", "gyro_z", "star_phi", "star_theta", "star_psi")
FAULTS = tuple(f"offset_{name}" for name in TORQUES)
PLANT = spacecraft_model(RigidSpacecraft())
FAULTY = with_faults(PLANT, [actuator_offset(name, walk=2e-5, sigma=1e-3, per_step=True) for name in TORQUES])

STAGES, ROBUST, ADAPTIVE = "two-stage", "robust", "adaptive"
INGREDIENTS = (STAGES, ROBUST, ADAPTIVE)
CLIPPING = gf.MasreliezMartin(0.1)
"""Bounded influence: an innovation that is large because of the fault still pulls, one that is an outlier no further."""


def named(*parts):
    """Name of a filter by its ingredients."""
    return " + ".join(part for part in INGREDIENTS if part in parts) or "plain"


CHOICES = [chosen for count in range(4) for chosen in itertools.combinations(INGREDIENTS, count)]
NAMES = tuple(named(*parts) for parts in CHOICES)
ALL = named(*INGREDIENTS)
SETTINGS = {
    "plain": (40.0, 4.0),
    "two-stage": (2.5, 1.0),
    "robust": (40.0, 2.0),
    "adaptive": (40.0, 0.999),
    "two-stage + robust": (10.0, 1.0),
    "two-stage + adaptive": (10.0, 0.999),
    "robust + adaptive": (40.0, 0.995),
    "two-stage + robust + adaptive": (10.0, 0.999),
}
"""Process and readings of each filter as `--tune` finds them."""


def assembled(name, process, readings):
    """A filter of the package's own parts; no ingredient needs to know of another.

    Args:
        name: its ingredients.
        process: factor on the sigma of the faults' walk, or of the rates' noise where no fault is estimated.
        readings: factor on the data sheet's sigmas, or the memory of the law that learns them.
    """
    states = {state: jnp.asarray(process) for state in (FAULTS if STAGES in name else ("wx", "wy", "wz"))}
    if ADAPTIVE in name:
        noise = gf.SageHusa(memory=jnp.asarray(readings), inner=gf.Scaled(states))
    else:
        noise = gf.Scaled(states, {reading: jnp.asarray(readings) for reading in READINGS})
    update = CLIPPING if ROBUST in name else gf.Exact()
    if STAGES in name:
        return Contender(
            gf.KalmanFilter(MarginalSigmaPoints(gf.Unscented()), update, noise, TwoStage), FAULTY, Starts(FAULTY)
        )
    return Contender(gf.KalmanFilter(gf.SigmaPoints(gf.Unscented()), update, noise), PLANT, Starts(PLANT))


class Starts(eqx.Module):
    """The estimate before the first reading."""

    model: gf.models.AbstractModel

    def __call__(self, record):
        start, sigma = record.truth["start"], jnp.asarray(START)
        if self.model is not PLANT and self.model.space.dof > len(DATA_SHEET):
            start, sigma = jnp.concatenate([start, jnp.zeros(3)]), jnp.concatenate([sigma, self.model.sigma])
        return Gaussian.start(start, jnp.diag(sigma**2), self.model.space)


class Flight(eqx.Module):
    """A flight whose sensors are other than their data sheet says, with gross errors, and with a fault or without."""

    size: float
    fold: int = eqx.field(static=True, default=0)

    def __call__(self, key):
        noise, factors, gross, size, start = jax.random.split(jax.random.fold_in(key, self.fold), 5)
        low, high = np.log(FACTORS)
        gyro, tracker = jnp.exp(jax.random.uniform(factors, (2,), minval=low, maxval=high))
        craft = RigidSpacecraft(gyro_sigma=gyro * GYRO_SIGMA, star_tracker_sigma=tracker * STAR_TRACKER_SIGMA)
        fault = FaultySignals(TORQUES, (Bias("torque_x", self.size, ONSET),))
        flight = fly(craft, key=noise, duration=DURATION, actuator_fault=fault)
        sigma = DATA_SHEET * jnp.repeat(jnp.stack([gyro, tracker]), 3)
        hit = jax.random.bernoulli(gross, SHARE, flight.y.shape)
        y = flight.y + jnp.where(hit, GROSS * sigma * jax.random.normal(size, flight.y.shape), 0.0)
        t = flight.t[1:]
        truth = {
            "t": t,
            "states": flight.truth[1:],
            "offset": jnp.where(t >= ONSET, self.size, 0.0),
            "start": flight.truth[0] + START * jax.random.normal(start, (6,)),
            "sigma": sigma,
        }
        return Record(Sample(Instant(t, jnp.diff(flight.t), flight.u[1:]), y[1:], jnp.ones(y[1:].shape, bool)), truth)


def _rms(values, rows):
    return jnp.sqrt(jnp.sum(jnp.where(rows[:, None], values**2, 0.0)) / jnp.sum(rows) / values.shape[1])


def _squared(cov, off):
    """Of a deviation, in units of its covariance."""
    return jnp.sum((root_and_inverse(cov)[1] @ off) ** 2)


def measure(record, info):
    """How far off, and how far off by what the filter claims."""
    t, mean = record.truth["t"], info.estimate.mean
    off = mean[:, :6] - record.truth["states"]
    cov = jax.vmap(lambda each: each.cov)(info.estimate)[:, :6, :6]
    nees = jax.vmap(_squared)(cov, off) / 6
    rows, later = t >= SETTLED, t >= ONSET
    rate, angle = _rms(off[:, :3], rows), _rms(off[:, 3:], rows)
    fault = jnp.nan
    if mean.shape[1] > 6:
        fault = _rms(mean[:, 6:7] - record.truth["offset"][:, None], later)
    return {
        "rate": 1e3 * rate / DEGREE,
        "angle": 1e3 * angle / DEGREE,
        "fault": 1e3 * fault,
        "nees": jnp.sum(jnp.where(rows, nees, 0.0)) / jnp.sum(rows),
        "score": jnp.log(rate / GYRO_SIGMA) + jnp.log(angle / STAR_TRACKER_SIGMA),
    }


def traces(record, info):
    """The fault, and what an alarm is raised by."""
    mean = info.estimate.mean
    if mean.shape[1] > 6:
        cov = jax.vmap(lambda each: each.cov)(info.estimate)
        return {"alarm": jnp.max(jnp.abs(fault_scores(mean, cov, 3)), axis=1), "fault": 1e3 * mean[:, 6]}
    return {"alarm": windowed_mean(info.nis, window=WINDOW), "fault": jnp.full(len(mean), jnp.nan)}


QUANTITIES = (
    Quantity("rate", "rate RMSE", "mdeg/s"),
    Quantity("angle", "attitude RMSE", "mdeg"),
    Quantity("fault", "fault RMSE", "mN m"),
    Quantity("nees", "NEES per degree"),
    Quantity("score", "log of rate times attitude RMSE, in sigmas of the data sheet"),
)


def experiment(name, title, flight, baseline=""):
    """All eight filters on the same flights."""
    filters = {each: assembled(each, *SETTINGS[each]) for each in NAMES}
    return Experiment(name, title, flight, filters, measure, QUANTITIES, traces, baseline, kept=("alarm",))


def delays(outcome, name):
    """Seconds from the onset to the alarm, at the stated rate of false alarms; None if too few flights tell it."""
    t = outcome.record("sound").truth["t"]
    try:
        limit = calibrate_threshold(outcome.every("sound", name, "alarm"), t, RATE, merge=MERGE, hold_off=SETTLED).value
    except DataError:
        return None
    found = detection_delay(t, outcome.every("faulty", name, "alarm") > limit, ONSET, ONSET + SOON)
    return np.where(np.isnan(found), np.inf, found)


def tables(outcome):
    """What each filter comes to."""
    rows = []
    for name in NAMES:
        late = delays(outcome, name)
        found = (None, None) if late is None else (median_interval(late, unit="s"), share_interval(np.isinf(late)))
        told = [outcome.mean("faulty", name, each.name) for each in QUANTITIES[:4]]
        rows.append((name, *(each if np.isfinite(each.value) else None for each in told), *found))
    heads = [f"{each.title} [{each.unit}]" if each.unit != "1" else each.title for each in QUANTITIES[:4]]
    title = "Mean over flights with 95 % intervals; one false alarm in 500 s"
    return [Table(title, ("filter", *heads, "median delay [s]", "missed"), tuple(rows))]


def figures(outcome):
    """The estimate of the fault in one flight, and the errors compared."""
    truth = outcome.record("faulty").truth
    staged = [name for name in NAMES if STAGES in name]
    lines = [Line(name, truth["t"][::4], outcome.trace("faulty", name, "fault").first[::4]) for name in staged]
    lines.append(Line("truth", truth["t"][::4], 1e3 * truth["offset"][::4], reference=True))
    errors = [
        Chart(
            "Errors compared",
            f"{each.title[0].upper()}{each.title[1:]}, mean over flights, with 95 % intervals.",
            each.title,
            {name: outcome.mean("faulty", name, each.name) for name in (staged if each.name == "fault" else NAMES)},
            each.unit,
            log=True,
        )
        for each in QUANTITIES[:4]
    ]
    shown = Figure(
        "The fault as it is estimated",
        f"One flight. From {ONSET:g} s on a wheel adds {1e3 * OFFSET:g} mN m; one reading in twenty is a gross error, and "
        "nobody knows how noisy the sensors are.",
        (Panel("offset of the wheel about x", tuple(lines), "mN m"),),
        telling=True,
    )
    return [shown, *errors]


def _over(quantity, other):
    return Check(
        f"{quantity}, {ALL} over {other}",
        lambda outcome: outcome.ratio("faulty", quantity, ALL, over=other),
        below(1.0),
    )


CLAIMS = (
    Claim(
        "better states",
        "The rates are better than with any one or two of the ingredients.",
        "not published",
        tuple(_over("rate", other) for other in NAMES[:-1]),
    ),
    Claim(
        "better attitude",
        "So is the attitude.",
        "not published",
        tuple(_over("angle", other) for other in NAMES[:-1]),
    ),
    Claim(
        "better fault",
        "So is the fault, of those that estimate one.",
        "not published",
        tuple(_over("fault", other) for other in NAMES[:-1] if STAGES in other),
    ),
    Claim(
        "honest",
        "Its uncertainty is right.",
        "not published",
        (Check(f"NEES per degree, {ALL}", lambda outcome: outcome.mean("faulty", ALL, "nees"), between(0.8, 1.25)),),
    ),
)


def study():
    """The comparison, as a study of its own."""
    return Study(
        name="combination",
        title="Two stages, a robust update and adaptive noise in one filter",
        about=(
            "A spacecraft's wheel begins to add torque, one reading in twenty is a gross error, and each sensor is between "
            "half and four times as noisy as its data sheet says. Three cures, alone, in pairs, and together."
        ),
        citations=(
            Citation(
                ("X. Chen", "R. Sun", "F. Wu", "W. Jiang"),
                2019,
                "Fault estimation in satellite attitude control system based on ATSUKF algorithm",
                "Acta Aeronautica et Astronautica Sinica 40(5), 322551",
                note="the two stages; the combination is published nowhere",
            ),
            Citation(
                ("C. J. Masreliez", "R. D. Martin"),
                1977,
                "Robust Bayesian estimation for the linear model and robustifying the Kalman filter",
                "IEEE Transactions on Automatic Control 22(3), 361-371",
            ),
            Citation(
                ("A. P. Sage", "G. W. Husa"),
                1969,
                "Adaptive filtering with unknown prior statistics",
                "Joint Automatic Control Conference, 760-769",
            ),
        ),
        experiments=(
            experiment("faulty", "With the fault", Flight(OFFSET), baseline="plain"),
            experiment("sound", "Without it", Flight(0.0, fold=1)),
        ),
        claims=CLAIMS,
        figures=figures,
        tables=tables,
        runs=40,
        seed=SEED,
    )


GRID = {
    "process": {True: (2.5, 10.0, 40.0), False: (10.0, 40.0, 160.0)},  # by whether faults are estimated
    "readings": {True: (0.98, 0.995, 0.999), False: (1.0, 2.0, 4.0)},  # by whether it adapts
}
"""Nine settings for every filter."""


def settings(name):
    """The settings that are tried for a filter."""
    return list(itertools.product(GRID["process"][STAGES in name], GRID["readings"][ADAPTIVE in name]))


def tuned(name, runs=10):
    """The setting with the least error of the states, on flights of their own."""
    tried = {repr(each): assembled(name, *each) for each in settings(name)}
    return tune(experiment("tuning", "Tuning", Flight(OFFSET, fold=2)), tried, "score", runs=runs, seed=TUNING_SEED)


def write_record(path):
    """One flight of the comparison as a file."""
    record = jax.tree.map(np.asarray, Flight(OFFSET)(jax.random.fold_in(jax.random.key(SEED), 0)))
    table = pd.DataFrame({"t": record.truth["t"].round(3)})
    for k, name in enumerate(PLANT.inputs):
        table[name] = record.samples.when.u[:, k].round(7)
    for k, name in enumerate(READINGS):
        table[name] = record.samples.y[:, k].round(7)
    for k, name in enumerate(PLANT.space.names):
        table[f"true_{name}"] = record.truth["states"][:, k].round(8)
    table["true_offset"] = record.truth["offset"]
    table.to_csv(path, index=False, compression={"method": "gzip", "mtime": 0})


def main(arguments):
    if "--tune" in arguments:
        for name in NAMES:
            found = tuned(name)
            print(name, found.best, {key: round(each.value, 3) for key, each in found.tried.items()}, flush=True)
        return
    if "--record" in arguments:
        write_record(HERE / "data" / "flight.csv.gz")
        return
    STUDIES["combination"] = Entry("two stages, robust and adaptive in one filter", f"{__name__}:study")
    from gainful.cli.findings import print_findings
    from gainful.jobs import run_study

    print_findings(run_study("combination", "out/combination"))


if __name__ == "__main__":
    main(sys.argv[1:])
