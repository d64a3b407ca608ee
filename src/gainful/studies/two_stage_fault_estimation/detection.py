"""How soon each statistic finds the faults when all give equally few false alarms."""

from __future__ import annotations

import functools

import jax
import numpy as np
from jaxtyping import Float

from ...errors import DataError
from ...faults import Threshold, calibrate_threshold, cusum, detection_delay, windowed_mean
from ...filters import two_stage_unscented_kalman_filter
from ..chapter import Chapter
from ..claims import Check, Claim, below
from ..figures import Figure, Line, Panel, Table
from ..outcome import Outcome
from ..statistics import Measured, mean_interval, median_interval, share_interval
from .contenders import GLR, PUBLISHED, TUNED, likelihood_ratio, started
from .estimation import experiment
from .measures import SETTLED, SOON, WINDOW
from .scenarios import ONSET, SCENARIOS, Scenario, sound_flight

RATE = 1e-3  # 1/s; one false alarm in 1000 s
RATES = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)  # 1/s
MERGE = 1.0  # s; exceedances closer than that are one alarm
DRIFT = 1.0  # sigma
RUNS = 20

SINGLE, WINDOWED = "NIS", f"mean of {WINDOW} NIS"
SCORE, SCORE_TUNED = "largest |z|, published Qb", "largest |z|, tuned Qb"
CUMULATED, RATIO = "CUSUM of z, tuned Qb", "likelihood ratio"
STATISTICS = (SINGLE, WINDOWED, SCORE, SCORE_TUNED, CUMULATED, RATIO)


def faulty(scenario: Scenario) -> str:
    """Name of the experiment in which faults are to be found."""
    return f"detection-{scenario.name}"


def sound(scenario: Scenario) -> str:
    """Name of the experiment in which there are none."""
    return f"fault-free-{scenario.name}"


def series(outcome: Outcome, name: str, statistic: str) -> Float[np.ndarray, "runs T"]:
    """A statistic of every run of an experiment."""
    if statistic in (SINGLE, WINDOWED):
        nis = outcome.every(name, PUBLISHED, "nis")
        return np.asarray(_averaged(nis)) if statistic == WINDOWED else nis
    if statistic == RATIO:
        return outcome.every(name, GLR, "ratio")
    scores = outcome.every(name, PUBLISHED if statistic == SCORE else TUNED, "scores")
    if statistic == CUMULATED:
        return np.asarray(_summed(scores)).max(axis=-1)
    return np.abs(scores).max(axis=-1)


@jax.jit
def _averaged(nis: jax.Array) -> jax.Array:
    return jax.vmap(functools.partial(windowed_mean, window=WINDOW))(nis)


@jax.jit
def _summed(scores: jax.Array) -> jax.Array:
    return jax.vmap(functools.partial(cusum, drift=DRIFT))(scores)


def threshold(outcome: Outcome, scenario: Scenario, statistic: str, rate: float = RATE) -> Threshold | None:
    """The threshold for a rate of false alarms; None if there were too few flights without a fault to tell."""
    t = outcome.record(sound(scenario)).truth["t"]
    values = series(outcome, sound(scenario), statistic)
    try:
        return calibrate_threshold(values, t, rate, merge=MERGE, hold_off=SETTLED)
    except DataError:
        return None


def delays(outcome: Outcome, scenario: Scenario, statistic: str, limit: float) -> Float[np.ndarray, "runs"]:
    """Time from the onset until a statistic exceeds a limit [s]; infinite where it does not within 10 s."""
    t = outcome.record(faulty(scenario)).truth["t"]
    found = detection_delay(t, series(outcome, faulty(scenario), statistic) > limit, ONSET, ONSET + SOON)
    return np.where(np.isnan(found), np.inf, found)


def median_delay(outcome: Outcome, scenario: Scenario, statistic: str, rate: float = RATE) -> Measured:
    """The median delay at a rate of false alarms [s]; no number if that rate could not be calibrated."""
    chosen = threshold(outcome, scenario, statistic, rate)
    if chosen is None:
        return mean_interval([np.nan], unit="s")
    return median_interval(delays(outcome, scenario, statistic, chosen.value), unit="s")


CLAIMS = (
    Claim(
        "a plain threshold is as fast",
        "A threshold on the tuned filter's estimate in its own sigmas finds faults as soon as the likelihood ratio does.",
        "a finding of this study, not of the paper",
        tuple(
            Check(
                f"median delay, {SCORE_TUNED} less {RATIO}, {each.name} [s]",
                lambda outcome, each=each: _later(outcome, each, SCORE_TUNED, RATIO),
                below(0.2),
            )
            for each in SCENARIOS
        ),
        {"reproduced": "The ratio dates the fault, tells which it is and resets the filter: that is what it is for."},
    ),
)


def _later(outcome: Outcome, scenario: Scenario, statistic: str, other: str) -> Measured:
    """How much later one statistic finds the fault than another, median over runs [s]."""
    chosen = [threshold(outcome, scenario, each) for each in (statistic, other)]
    if chosen[0] is None or chosen[1] is None:
        return mean_interval([np.nan], unit="s")
    late, early = (
        delays(outcome, scenario, name, each.value) for name, each in ((statistic, chosen[0]), (other, chosen[1]))
    )
    return median_interval(late - early, unit="s")


def tables(outcome: Outcome) -> list[Table]:
    """Thresholds, delays and misses, for one false alarm in 1000 s."""
    out = []
    for scenario in SCENARIOS:
        rows = []
        for statistic in STATISTICS:
            chosen = threshold(outcome, scenario, statistic)
            if chosen is None:
                rows.append((statistic, None, None, None, None))
                continue
            late = delays(outcome, scenario, statistic, chosen.value)
            slowest = float(np.quantile(late, 0.95, method="inverted_cdf"))
            rows.append(
                (statistic, chosen.value, median_interval(late, unit="s"), slowest, share_interval(np.isinf(late)))
            )
        heads = ("statistic", "threshold", "median delay [s]", "95 % are found within [s]", "missed")
        out.append(Table(f"Detection at one false alarm in 1000 s: {scenario.title.lower()}", heads, tuple(rows)))
    return out


def figures(outcome: Outcome) -> list[Figure]:
    """The delay against the rate of false alarms."""
    panels = []
    for scenario in SCENARIOS:
        lines = []
        for statistic in STATISTICS:
            values = [median_delay(outcome, scenario, statistic, rate).value for rate in RATES]
            lines.append(Line(statistic, 1000 * np.array(RATES), np.array(values)))
        panels.append(Panel(scenario.title, tuple(lines), "s"))
    return [
        Figure(
            "Delay and false alarms",
            "Median delay of the detection, for thresholds calibrated on flights without a fault. All begin with no false "
            "alarm merged with another within 1 s.",
            tuple(panels),
            x_label="false alarms per 1000 s",
            x_log=True,
        )
    ]


def chapter() -> Chapter:
    """Six statistics, calibrated on flights without a fault."""
    experiments = []
    for each in SCENARIOS:
        model = each.model()
        filters = {
            PUBLISHED: started(two_stage_unscented_kalman_filter(), model),
            TUNED: started(two_stage_unscented_kalman_filter(), each.model(each.tuned)),
            GLR: started(likelihood_ratio(each), model),
        }
        common = {"kept": ("nis", "scores", "ratio"), "most_runs": RUNS}
        experiments += [
            experiment(each, filters, name=faulty(each), title=f"{each.title}, to be found", **common),
            experiment(
                each,
                filters,
                name=sound(each),
                title=f"No fault, filters for: {each.title.lower()}",
                simulate=sound_flight(),
                **common,
            ),
        ]
    return Chapter(
        tuple(experiments),
        CLAIMS,
        tables,
        figures,
        (
            "Thresholds are calibrated on as many flights of 200 s without a fault, with noise of their own; at least six are "
            "needed for one false alarm in 1000 s. A fault not found within 10 s is missed.",
        ),
    )
