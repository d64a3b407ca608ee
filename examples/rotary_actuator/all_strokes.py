"""Parameters of every stroke, and whether they tell faulty actuators from healthy ones.

python all_strokes.py FOLDER        # with runs.csv.gz and runs_index.csv
"""

# ruff: noqa: T201

import dataclasses
import itertools
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.stats

import gainful as gf
from gainful.config import build_filter, build_model, build_parameters, build_prior, load_config
from gainful.diagnostics import weighing

HERE = Path(__file__).parent
SAMPLES = 340  # of every stroke, so that one compiled filter serves all
FROM = 0.03  # share of its way at which a stroke's part begins: the valve is open and the shaft broken away
TRAVEL = 4300.0  # counts from stop to stop, of most
PARAMETERS = ("gain", "load", "friction", "leakage", "opening")
SIZES = ("resistance", "opening", "by_travel")
PAIRS = {"butterfly_valve": (1, 4), "ball_valve": (2, 3), "none": (5, 6)}
SLIPPED = 0.4  # share of angle readings that count less than half, above which the reading has slipped


def stroke(record, row):
    """Samples, angle from the stroke's start on, pressures at inlet and outlet, and share of the way, of one stroke.

    The second result is the outlet's mean pressure at the end of the record, when the shaft is held at its stop.
    """
    up = row.direction == "up"
    angle = (1.0 if up else -1.0) * (record.angle - record.angle.iloc[0]).to_numpy(float)
    inlet, back = (record.pg_1, record.pg_2) if up else (record.pg_2, record.pg_1)
    way = angle / abs(row.angle_end - row.angle_start)
    first = int(np.argmax(way > FROM))
    part = slice(first, first + SAMPLES)
    moving = [np.asarray(each, float)[part] for each in (record["sample"], angle, inlet, back, way)]
    return moving, float(back.iloc[-100:].mean())


def estimates(folder):
    """One row per stroke: what it is, and its parameters.

    `resistance` is load and friction together half way, in pressure counts: a stroke of constant speed cannot tell them apart.
    `opening` is a thousand times the speed per root of the outlet's pressure, `by_travel` the same if every reading went
    `TRAVEL` counts from stop to stop, and `slipped` whether the angle's reading did not follow the shaft.
    """
    config = load_config(HERE / "stroke.toml")
    model = build_parameters(config, build_model(config.model, HERE))
    chosen = build_filter(config, model)
    index, records = pd.read_csv(Path(folder) / "runs_index.csv"), pd.read_csv(Path(folder) / "runs.csv.gz")
    by_run, names, rows = dict(iter(records.groupby("run_id"))), model.space.names, []
    for row in index.itertuples():
        (t, angle, inlet, back, way), held_back = stroke(by_run[row.run_id], row)
        held = np.stack([inlet, back], axis=1)
        mean_input = np.concatenate([held[:1], 0.5 * (held[1:] + held[:-1])])  # over the interval that ends at the row
        start = dataclasses.replace(config.prior, mean=config.prior.mean | {"angle": float(angle[0])})
        prior = build_prior(dataclasses.replace(config, prior=start), model)
        result = gf.run(chosen, model, prior, gf.make_log(model, t, np.stack([angle, back], axis=1), mean_input))
        half, travel = int(np.argmax(way > 0.5)), abs(row.angle_end - row.angle_start)
        last = {name: float(result[name][-1]) for name in names}
        left = np.nanmin(result.std, axis=0) / result.std[0]
        rows.append(
            {
                "run_id": row.run_id,
                "actuator": row.actuator,
                "condition": row.condition,
                "load": row.load,
                "direction": row.direction,
                "temperature": row.internal_temp,
                "resistance": float(result["load"][half] + result["friction"][half] * result["speed"][half]),
                "opening": 1000.0 * last["opening"],
                "by_travel": 1000.0 * last["opening"] * TRAVEL / travel,
                "held_outlet": held_back,
                "slipped": weighing(result)[0].outliers > SLIPPED,
            }
            | {f"{name} left": left[names.index(name)] for name in PARAMETERS}
        )
    return pd.DataFrame(rows)


def means(table):
    """Mean and standard deviation over strokes of each actuator and direction."""
    return (
        table[~table.slipped].groupby(["direction", "load", "actuator", "condition"])[list(SIZES)].agg(["mean", "std"])
    )


def difference(table, first, second, size):
    """Mean of the second actuator minus that of the first, its 95 % half width, and how well single strokes separate.

    Directions are compared apart and averaged. The half width (Welch) is that of the strokes' scatter alone. The last
    number is the share of pairs of one stroke each in which the second one's is larger: 0.5 if they are alike.
    """
    sound = table[~table.slipped]
    parts = [
        [sound[(sound.actuator == k) & (sound.direction == d)][size] for k in (first, second)] for d in ("up", "down")
    ]
    mean = np.mean([b.mean() - a.mean() for a, b in parts])
    terms = np.array([each.var() / len(each) / 4.0 for pair in parts for each in pair])
    degrees = terms.sum() ** 2 / sum(
        v**2 / (len(each) - 1) for v, each in zip(terms, itertools.chain(*parts), strict=True)
    )
    half = scipy.stats.t.ppf(0.975, degrees) * np.sqrt(terms.sum())
    larger = np.mean([np.mean(b.to_numpy()[:, None] > a.to_numpy()) for a, b in parts])
    return float(mean), float(half), float(larger)


def by_actuator(table):
    """Temperature, outlet pressure when held, and sizes of each actuator, mean of both directions."""
    mean = (
        table[~table.slipped]
        .groupby(["actuator", "condition", "direction"])[["temperature", "held_outlet", *SIZES]]
        .mean()
    )
    return mean.groupby(["actuator", "condition"]).mean().reset_index("condition")


def expected(each, size):
    """Where a further healthy actuator is expected with 95 %, from the four there are.

    Returns:
        Lower and upper end if it does not matter how warm the stand is, and table of both by actuator if it does: then a
        line over temperature goes through the four, and the ends are those of its prediction.
    """
    healthy = each[each.condition == "healthy"]
    count, values = len(healthy), healthy[size]
    reach = scipy.stats.t.ppf(0.975, count - 1) * values.std() * np.sqrt(1.0 + 1.0 / count)
    fit = scipy.stats.linregress(healthy.temperature, values)
    off = healthy.temperature - healthy.temperature.mean()
    rest = np.sqrt(np.sum((values - fit.intercept - fit.slope * healthy.temperature) ** 2) / (count - 2))
    away = each.temperature - healthy.temperature.mean()
    middle = fit.intercept + fit.slope * each.temperature
    wide = scipy.stats.t.ppf(0.975, count - 2) * rest * np.sqrt(1.0 + 1.0 / count + away**2 / np.sum(off**2))
    return values.mean() - reach, values.mean() + reach, pd.DataFrame({"lower": middle - wide, "upper": middle + wide})


def main(folder):
    table = estimates(folder)
    each = by_actuator(table)
    print("slipped:", ", ".join(map(str, table[table.slipped].run_id)))
    print("\nsigma left, median over strokes")
    print(table.filter(like=" left").median().round(2).to_string())
    print("\nmeans and standard deviations over strokes")
    print(means(table).round(1).to_string())
    print(
        "\ndifferences, their 95 % half widths from the strokes' scatter, share of pairs of strokes that show their sign"
    )
    for load, (first, second) in PAIRS.items():
        for size in SIZES:
            mean, half, larger = difference(table, first, second, size)
            print(f"{load:16} {second} - {first}  {size:10} {mean:8.1f} +- {half:4.1f}   {max(larger, 1 - larger):.2f}")
    print("\nhealthy actuators with different loads")
    for first, second in itertools.combinations((1, 2, 5, 6), 2):
        mean, half, larger = difference(table, first, second, "by_travel")
        print(f"{second} - {first}  by_travel {mean:8.1f} +- {half:4.1f}   {max(larger, 1 - larger):.2f}")
    print("\nby actuator")
    print(each.round(1).to_string())
    for size in ("opening", "by_travel"):
        low, high, warm = expected(each, size)
        print(f"\n{size} expected of a healthy actuator: {low:.1f} to {high:.1f}, by temperature")
        print(warm.round(1).to_string())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
