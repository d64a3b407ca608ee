"""Attitude errors of an inertial unit: noise fitted to a clean trial, updates compared on all, one with a magnet.

python attitude.py FOLDER        # with the three trials
"""

# ruff: noqa: T201

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pandas as pd

import gainful as gf
from gainful.config import build_filter, build_model, build_prior, load_config

HERE = Path(__file__).parent
TRIALS = {
    "slow": "02_undisturbed_slow_rotation_B.csv.gz",
    "fast": "21_undisturbed_fast_combined.csv.gz",
    "magnet": "34_disturbed_attached_magnet_3cm.csv.gz",
}
FITTED = (5.0, 25.0)  # of the slow trial, 5 s at rest and 15 s in motion [s]
AXES = "xyz"
ACCELEROMETER, MAGNETOMETER = (tuple(f"{kind}{axis}" for axis in AXES) for kind in "am")
OFFSETS = dict.fromkeys(MAGNETOMETER, 1.0)  # walk per square root of a second [uT]
LAW = {"floor": 1.0, "ceiling": 1e4}  # never less than was fitted
CHOICES = {
    "exact": {},
    "gated": {"update": {"kind": "gated", "reacquire": 10}},
    "gated for good": {"update": {"kind": "gated", "reacquire": 0}},
    "huber_reweighted": {"update": "huber_reweighted"},
    "masreliez_martin": {"update": "masreliez_martin"},
    "student_t": {"update": {"kind": "student_t", "dof": 4.0}},
    "maximum_correntropy": {"update": "maximum_correntropy"},
    "innovation_scaling": {"update": {"kind": "innovation_scaling", "order": ["measurement"]}},
    "variational_noise": {"update": {"kind": "variational_noise", "memory": 0.995} | LAW},
    "innovation_matching": {"noise": {"kind": "innovation_matching", "window": 200} | LAW},
    "sage_husa": {"noise": {"kind": "sage_husa", "memory": 0.995} | LAW},
    "offset states": {"offsets": True},
}


def configuration(folder, trial, *, update=None, noise=None, offsets=False, **arguments):
    """That of `magnet.toml` for any trial, with another update or noise law, or the magnetometer's offset as states."""
    config = load_config(HERE / "magnet.toml")
    data = dataclasses.replace(config.data, folder=str(Path(folder).resolve()), file=TRIALS[trial])
    model, prior = dataclasses.replace(config.model, arguments=config.model.arguments | arguments), config.prior
    if offsets:
        model = dataclasses.replace(
            model, augment=dataclasses.replace(model.augment, biases=model.augment.biases | OFFSETS)
        )
        names = [f"bias_{name}" for name in MAGNETOMETER]
        mean, std = prior.mean | dict.fromkeys(names, 0.0), prior.std | dict.fromkeys(names, 1.0)
        prior = dataclasses.replace(prior, mean=mean, std=std)
    return dataclasses.replace(config, data=data, model=model, prior=prior, update=update, noise=noise)


def attitude_errors(result, moving):
    """Root mean square errors where the unit moves: in all, of the vertical, and of the heading [deg].

    Args:
        result: with the cameras' attitude as truth.
        moving: rows to count.
    """
    names = [f"attitude_{axis}" for axis in "xyzw"]
    truth = np.stack([result.log.truth[name] for name in names], axis=1)
    found = np.stack([result[name] for name in names], axis=1)
    told = moving & np.isfinite(truth).all(axis=1)
    x, y, z, w = between(found[told], truth[told]).T
    parts = (
        2 * np.arccos(np.minimum(np.abs(w), 1)),
        2 * np.arcsin(np.minimum(np.hypot(x, y), 1)),
        2 * np.arctan2(z, w),
    )
    wrapped = (np.remainder(part + np.pi, 2 * np.pi) - np.pi for part in parts)
    return [float(np.degrees(np.sqrt(np.mean(part**2)))) for part in wrapped]


def between(found, truth):
    """The rotation, in earth axes, from the true attitude to the one found, as quaternions."""
    vector = -found[:, 3:] * truth[:, :3] + truth[:, 3:] * found[:, :3] - np.cross(found[:, :3], truth[:, :3])
    return np.concatenate([vector, np.sum(found * truth, axis=1)[:, None]], axis=1)


class Trials:
    """The records, the model and the prior of some choice."""

    def __init__(self, folder, names=tuple(TRIALS), *, offsets=False, **arguments):
        first = configuration(folder, names[0], offsets=offsets, **arguments)
        self.folder = folder
        self.model = build_model(first.model, HERE)
        self.prior = build_prior(first, self.model)
        self.logs = {name: gf.read_log(self.model, configuration(folder, name).data, HERE) for name in names}

    def moving(self, name):
        table = pd.read_csv(Path(self.folder) / TRIALS[name], usecols=["t_s", "movement"])
        return np.isin(self.logs[name].t, table.t_s[table.movement == 1])

    def run(self, name, **choice):
        """The filter with an update or a noise law along a trial."""
        config = configuration(self.folder, name, **choice)
        return gf.run(build_filter(config, self.model), self.model, self.prior, self.logs[name])


def excerpt(trials):
    """The part of the slow trial that the noise is fitted to."""
    log = trials.logs["slow"]
    rows = (log.t >= FITTED[0]) & (log.t < FITTED[1])
    return gf.Log(*(getattr(log, name)[rows] for name in ("t", "dt", "u", "y", "seen")))


def fitted(trials, *, gyro):
    """Noise by likelihood: one sigma for each sensor, and one for the gyro if it is not taken from its rest."""
    rotation = [tuple(f"attitude_rotation_{axis}" for axis in AXES)] if gyro else ()
    sensors = [ACCELEROMETER, MAGNETOMETER]
    return gf.fit_noise(
        gf.extended_kalman_filter(),
        trials.model,
        trials.prior,
        excerpt(trials),
        process=rotation,
        measurement=sensors,
        held_out=0.0,
        skip=1000,
    )


def main(folder):
    plain = Trials(folder)
    for gyro in (False, True):
        fit = fitted(plain, gyro=gyro)
        print(fit.sentence)
        for each in fit.entries:
            print(f"  {each.entry.label}: {each.fitted[0]:.4g}, known to {100 * (each.standard_error or 0):.1f} %")
        for name, log in plain.logs.items():
            result = gf.run(fit.estimator, plain.model, plain.prior, log)
            print(f"  {name:8}", *(f"{each:6.2f}" for each in attitude_errors(result, plain.moving(name))))
    wide = Trials(folder, offsets=True)
    for label, choice in CHOICES.items():
        trials = wide if choice.get("offsets") else plain
        for name in TRIALS:
            found = attitude_errors(trials.run(name, **choice), trials.moving(name))
            print(f"{label:20} {name:8}", *(f"{each:6.2f}" for each in found))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
