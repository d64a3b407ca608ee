"""Every message of the studies: the argument, what was expected, what came."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.errors import ConfigError, ModelError, ShapeError
from gainful.studies import (
    Band,
    Chart,
    Check,
    Citation,
    Claim,
    Experiment,
    Figure,
    Line,
    Panel,
    Quantity,
    Study,
    Table,
    Tolerance,
    below,
    difference_interval,
    exactly,
    find_study,
    mean_interval,
    near,
    ratio_interval,
    share_interval,
    tune,
)
from gainful.studies.monte_carlo import run_experiment
from gainful.studies.two_stage_fault_estimation.scenarios import OFFSET
from gainful.studies.two_stage_fault_estimation.tuning import retune

T = np.arange(3.0)


def experiment(**changes):
    given = {
        "name": "e",
        "title": "E",
        "simulate": lambda key: jnp.zeros(2),
        "contenders": {"a": lambda record: record},
        "measure": lambda record, reading: {"q": reading[0]},
        "quantities": (Quantity("q", "Q"),),
        "baseline": "a",
    }
    return Experiment(**given | changes)


def claim(**changes):
    given = {
        "name": "c",
        "statement": "C.",
        "published": "1",
        "checks": (Check("q", lambda outcome: exactly(0.0), below(1)),),
    }
    return Claim(**given | changes)


def study(**changes):
    given = {
        "name": "s",
        "title": "S",
        "about": "S.",
        "citations": (Citation(("A",), 2000, "T", "V"),),
        "experiments": (experiment(),),
        "claims": (claim(),),
    }
    return Study(**given | changes)


def judged(measure):
    return run_experiment(experiment(measure=measure), 1, 0)


MESSAGES = [
    (lambda: mean_interval([]), ConfigError, "values: expected at least one run, got none"),
    (lambda: mean_interval([1.0], level=1.0), ConfigError, "level: expected a probability between 0 and 1, got 1.0"),
    (lambda: share_interval([0.0, 0.5]), ConfigError, "successes: expected true or false per run, got 0.5"),
    (lambda: ratio_interval([1.0], [1.0, 2.0]), ConfigError, "above and below: expected the same runs, got 1 and 2"),
    (
        lambda: difference_interval([1.0], [1.0, 2.0]),
        ConfigError,
        "first and second: expected the same runs, got 1 and 2",
    ),
    (
        lambda: Tolerance(2.0, 1.0),
        ConfigError,
        "tolerance: expected low <= high and one of them finite, got 2.0 and 1.0",
    ),
    (lambda: Tolerance(), ConfigError, "one of them finite, got -inf and inf"),
    (lambda: Tolerance(math.nan, 1.0), ConfigError, "expected low <= high and one of them finite, got nan and 1.0"),
    (lambda: near(1.0, relative=-0.1), ConfigError, "relative and absolute: expected at least 0, got -0.1 and 0.0"),
    (lambda: claim(checks=()), ConfigError, "claim 'c': expected at least one check, got none"),
    (
        lambda: claim(why={"partially": "x"}),
        ConfigError,
        "claim 'c': why: expected a verdict (reproduced, partly, not reproduced, undecided), got 'partially'",
    ),
    (
        lambda: Quantity("q", "Q", statistic="mode"),
        ConfigError,
        "quantity 'q': statistic 'mode' is not known; known: mean, median, rms, share",
    ),
    (
        lambda: experiment(contenders={}),
        ConfigError,
        "experiment 'e': contenders: expected at least one, got none",
    ),
    (lambda: experiment(baseline="b"), ConfigError, "experiment 'e': baseline 'b' is not a contender; known: a"),
    (lambda: experiment(most_runs=0), ConfigError, "experiment 'e': most_runs: expected at least 1, got 0"),
    (lambda: Figure("f", "", ()), ConfigError, "figure 'f': expected at least one panel, and in each a line or a band"),
    (lambda: Figure("f", "", (Panel("p", ()),)), ConfigError, "and in each a line or a band"),
    (lambda: Chart("c", "", "x", {}), ConfigError, "chart 'c': expected at least one number, got none"),
    (lambda: Table("t", ("a", "b"), (("x",),)), ShapeError, "table 't': expected 2 cells in each row, got 1"),
    (lambda: Line("a", T, T[:2]), ShapeError, "y of 'a': expected a vector as long as x (3,), got (2,)"),
    (
        lambda: Band("a", T, T, T[:2], "spread"),
        ShapeError,
        "high of 'a': expected a vector as long as x (3,), got (2,)",
    ),
    (
        lambda: judged(lambda record, reading: {"r": 1.0}),
        ModelError,
        "measure of experiment 'e': expected ['q'], got ['r']",
    ),
    (
        lambda: run_experiment(experiment(trace=lambda record, reading: {"ratio": reading}, kept=("ratios",)), 1, 0),
        ModelError,
        "experiment 'e': kept: 'ratios' is no trace; did you mean 'ratio'?",
    ),
    (
        lambda: retune("GRL", OFFSET),
        ConfigError,
        "contender: 'GRL' was not tuned; did you mean 'GLR'?",
    ),
    (
        lambda: judged(lambda record, reading: {"q": reading}),
        ModelError,
        "measure of experiment 'e': 'q': expected a single number, got shape (2,)",
    ),
    (
        lambda: study().run(1).mean("f", "a", "q"),
        ConfigError,
        "experiment of study 's': 'f' is not known; known: e",
    ),
    (lambda: study(citations=()), ConfigError, "study 's': citations: expected at least one, got none"),
    (
        lambda: study(claims=()),
        ConfigError,
        "study 's': claims: expected at least one, each name once, got none",
    ),
    (
        lambda: study(experiments=(experiment(), experiment())),
        ConfigError,
        "study 's': experiments: expected at least one, each name once, got 'e' twice",
    ),
    (
        lambda: study(experiments=(experiment(baseline=""),)),
        ConfigError,
        "study 's': baseline: expected a fairly tuned one in at least one experiment, got none",
    ),
    (lambda: study().run(0), ConfigError, "runs: expected a whole number of at least 1, got 0"),
    (lambda: study().run(1, True), ConfigError, "seed: expected a whole number of at least 0, got True"),
    (
        lambda: tune(experiment(), {"x": lambda record: record}, "r", runs=1, seed=0),
        ConfigError,
        "'r' is not a quantity of experiment 'e'; known: q",
    ),
    (
        lambda: tune(experiment(), {"x": lambda record: record + jnp.nan}, "q", runs=1, seed=0),
        ConfigError,
        "settings: none of 1 came to a q in every run",
    ),
    (lambda: find_study("no such thing"), ConfigError, "'no such thing' is not a study; "),
]


@pytest.mark.parametrize(("attempt", "error", "message"), MESSAGES)
def test_a_message_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
