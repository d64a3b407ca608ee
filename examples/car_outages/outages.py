"""How far a car gets without satellites: outages cut into one record, with and without what was learned before them.

python outages.py FOLDER        # with imu.csv, can.csv, gnss_ublox.csv and reference.csv
"""

# ruff: noqa: T201

import dataclasses
import math
import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import scipy.stats

import gainful as gf
from gainful.aiding import learn_sensor_map, with_sensor_maps
from gainful.config import build_filter, build_model, build_parameters, build_prior, load_config
from gainful.networks import AffineTraining, CMACTraining
from gainful.running import with_outage

HERE = Path(__file__).parent
STARTS = np.arange(10.0, 38.0, 2.5)  # of the outages [s]
LENGTH = 20.0  # of each [s]
AFTER = (0.0, 5.0, 10.0, 20.0)  # into the outage, when errors are told [s]
SATELLITES = ("gnss_east", "gnss_north", "course")
PHONE = 0.06836  # the gyro's bias as the phone itself tells it, raw less corrected [rad/s]
KNOWN = ("bias_gnss_east", "bias_gnss_north")  # how far fixes lie off the reference is learned by all
FEW = CMACTraining(levels=12, layers=4, compress="none", epochs=3)  # a map of few cells: ten to thirty seconds teach it


@dataclasses.dataclass(frozen=True)
class Contender:
    """What is learned before an outage, and what is measured in it.

    Attributes:
        learned: errors of sensors that are states; the others are taken to be none, the gyro's bias what the phone says.
        wheels: whether the wheels are read at all.
        training: of a map from speed to the wheels' error, in place of states for it.
    """

    learned: tuple[str, ...] = ()
    wheels: bool = True
    training: AffineTraining | CMACTraining | None = None


GYRO = ("bias_turn_rate", "mount")
CONTENDERS = {
    "no wheels, nothing learned": Contender(wheels=False),
    "no wheels, gyro and mount": Contender(GYRO, wheels=False),
    "wheels, nothing learned": Contender(),
    "wheels, gyro and mount": Contender(GYRO),
    "wheels, wheel offset": Contender(("bias_wheel",)),
    "wheels, gyro, mount and wheel offset": Contender((*GYRO, "bias_wheel")),
    "wheels, gyro, mount and wheel scale": Contender((*GYRO, "wheel_scale")),
    "wheels, all with both scales": Contender((*GYRO, "bias_wheel", "wheel_scale", "gyro_scale")),
    "wheels, gyro, mount and a line": Contender(GYRO, training=AffineTraining()),
    "wheels, gyro, mount and a CMAC": Contender(GYRO, training=FEW),
}
ALL = ("mount", "wheel_scale", "gyro_scale", "bias_turn_rate", "bias_wheel", *KNOWN)


class Drive:
    """The record, and the one filter for all outages and contenders: what is not learned has no uncertainty.

    Args:
        folder: of the record.
    """

    def __init__(self, folder):
        config = load_config(HERE / "outage.toml")
        scales = {name: dataclasses.replace(config.parameters["mount"], sigma=0.02) for name in ALL[1:3]}
        data = dataclasses.replace(config.data, folder=str(Path(folder).resolve()), outages=[])
        self.config = dataclasses.replace(config, data=data, parameters=config.parameters | scales)
        self.model = build_parameters(self.config, build_model(self.config.model, HERE))
        self.filter = build_filter(self.config, self.model)
        self.log = gf.read_log(self.model, data, HERE)

    def parts(self, learned):
        """Model and prior in which only some of the sensors' errors are unknown: the others neither vary nor walk."""
        learned = (*learned, *KNOWN)
        prior, names = build_prior(self.config, self.model), list(self.model.space.tangent_names)
        fixed = [names.index(name) for name in ALL if name not in learned]
        cov, mean = np.array(prior.cov), np.array(prior.mean)
        cov[fixed, :] = cov[:, fixed] = 0.0
        if "bias_turn_rate" not in learned:
            mean[names.index("bias_turn_rate")] = PHONE
        biases = self.model.base  # the parameters' states were added last, and none of them walks
        walks = jnp.where(jnp.array([name in learned for name in biases.extra.names]), biases.walk, 0.0)
        model = eqx.tree_at(lambda whole: whole.base.walk, self.model, walks)
        return model, gf.make_prior(model, mean, cov=cov)

    def without_satellites(self, model, start, wheels=True):
        log = with_outage(self.log, model, SATELLITES, start, start + LENGTH)
        return log if wheels else with_outage(log, model, ["wheel"], -math.inf)

    def learned_map(self, start, training):
        """A map from speed to the wheels' error, from what satellites and gyro say until the outage, and its report."""
        model, prior = self.parts(GYRO)
        past = with_outage(self.log, model, (*SATELLITES, "wheel"), start)
        teacher = gf.smooth(gf.run(self.filter, model, prior, with_outage(past, model, ["wheel"], -math.inf)))
        # Nothing is measured from the outage on, so nothing after it teaches anything.
        return learn_sensor_map(
            model, [past], [teacher], "wheel", ["speed"], key=jax.random.key(0), training=training, start=1.0
        )

    def run(self, contender, start):
        """The filter's result with an outage."""
        model, prior = self.parts(contender.learned)
        if contender.training is not None:
            learned, _ = self.learned_map(start, contender.training)
            model = with_sensor_maps(model, [learned])
        return gf.run(self.filter, model, prior, self.without_satellites(model, start, contender.wheels))


def position_errors(result, start):
    """Distances from the reference, so many seconds into an outage [m]."""
    truth = result.log.truth
    off = np.hypot(result["east"] - truth["east"], result["north"] - truth["north"])
    told = np.flatnonzero(np.isfinite(off))
    return [float(off[told[np.searchsorted(result.t[told], start + after, side="right") - 1]]) for after in AFTER]


def errors(drive, names=tuple(CONTENDERS), starts=STARTS):
    """Position errors [m], one row per contender, outage and time into it."""
    rows = []
    for name in names:
        for start in starts:
            found = position_errors(drive.run(CONTENDERS[name], start), start)
            rows += [(name, start, after, error) for after, error in zip(AFTER, found, strict=True)]
    return pd.DataFrame(rows, columns=["contender", "start", "after", "error"])


def spread(table):
    """Median, smallest and largest error over the outages, by contender and time into the outage."""
    return table.groupby(["contender", "after"], sort=False).error.agg(["median", "min", "max"])


def difference(table, first, second, after):
    """How much larger the first contender's errors are over the same outages: mean, 95 % half width, share above 0.

    Outages that overlap tell the same thing again. The interval counts as many as fit into the record side by side
    up to `after`; where that is but one, there is none.
    """
    wide = table[table.after == after].pivot_table(index="start", columns="contender", values="error")
    gain = (wide[first] - wide[second]).to_numpy()
    apart = 1 + math.floor((wide.index.max() - wide.index.min()) / after)
    half = scipy.stats.t.ppf(0.975, apart - 1) * gain.std(ddof=1) / math.sqrt(apart) if apart > 1 else math.inf
    return float(gain.mean()), float(half), float(np.mean(gain > 0))


PAIRS = (
    ("no wheels, nothing learned", "wheels, nothing learned"),
    ("wheels, nothing learned", "wheels, wheel offset"),
    ("wheels, wheel offset", "wheels, gyro, mount and wheel offset"),
    ("wheels, gyro, mount and wheel offset", "wheels, gyro, mount and wheel scale"),
    ("wheels, gyro, mount and wheel offset", "wheels, all with both scales"),
    ("wheels, gyro, mount and wheel offset", "wheels, gyro, mount and a line"),
    ("wheels, gyro, mount and wheel offset", "wheels, gyro, mount and a CMAC"),
)


def main(folder):
    table = errors(Drive(folder))
    print("position errors over the outages [m]: median, smallest, largest")
    print(spread(table).round(2).unstack().to_string())
    print("\ndifferences of errors over the same outages [m], 95 % half widths, share of outages with that sign")
    for first, second in PAIRS:
        for after in AFTER[1:]:
            mean, half, share = difference(table, first, second, after)
            print(f"{first} - {second}, {after:g} s: {mean:.2f} +- {half:.2f}   {max(share, 1 - share):.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
