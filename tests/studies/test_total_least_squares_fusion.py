"""The study of total least squares fusion on a small budget: its numbers, as far as twenty records tell them."""

import dataclasses

import equinox as eqx
import jax
import numpy as np
import pytest

from gainful.studies import Chart, Measured, Outcome, Trace, find_study
from gainful.studies.monte_carlo import Results, run_experiment
from gainful.studies.total_least_squares_fusion import (
    bias,
    costs,
    fusion,
    intervals,
    jump,
    outage,
    realistic,
    unequal,
    vehicle,
)
from gainful.studies.total_least_squares_fusion.comparing import closest, rms_ratio, scaled, worst_of
from gainful.studies.total_least_squares_fusion.contenders import (
    MEAN_RLS,
    MEAN_RTLS,
    RLS1,
    RLS_F,
    RTLS1,
    RTLS2,
    RTLS_F,
)
from gainful.studies.total_least_squares_fusion.convergence import settled
from gainful.studies.total_least_squares_fusion.measures import AFTER
from gainful.studies.total_least_squares_fusion.records import YAW, noisy_rows, rows_of
from gainful.studies.total_least_squares_fusion.regressors import GENERAL, ISOTROPIC, PLAIN, WEAK_CROSS

RUNS = 20


def run(experiment, names, runs=RUNS, *, quick=False):
    """Some contenders of an experiment; quick for those without a recursion."""
    chosen = {name: experiment.contenders[name] for name in names}
    return run_experiment(dataclasses.replace(experiment, contenders=chosen, baseline=""), runs, 1, quick=quick)


def named(experiments, name):
    return next(each for each in experiments if each.name == name)


def mean(results, contender, quantity="error"):
    return float(results.values[contender][quantity].mean())


def rms(results, contender, quantity):
    return float(np.sqrt((results.values[contender][quantity] ** 2).mean()))


@pytest.fixture(scope="module")
def study():
    return find_study("total-least-squares-fusion")


@pytest.fixture(scope="module")
def yaw(study):
    names = (RLS1, RLS_F, RTLS1, RTLS2, RTLS_F, MEAN_RLS, MEAN_RTLS)
    return run(named(study.experiments, "yaw-0.1"), names)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("yaw-0.1", (-8.925, 3.960, -6.769)),
        ("yaw-0.2", (-16.058, 3.814, -10.616)),
        ("surge-0.1", (-23.985, -4.120, -1.937)),
        ("surge-0.2", (-43.156, -6.663, -4.614)),
    ],
)
def test_the_bias_in_theory_is_that_of_an_independent_program(name, expected):
    np.testing.assert_allclose(bias.theory(name), expected, atol=5.1e-4)


def test_stacked_least_squares_is_off_by_what_theory_says(yaw):
    for each, expected in zip(["m", "d", "d2"], bias.theory("yaw-0.1"), strict=True):
        found = yaw.values[RLS_F][each]
        assert found.mean() == pytest.approx(expected, abs=4 * found.std(ddof=1) / np.sqrt(RUNS))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (RLS1, 0.0883),
        (RLS_F, 0.0869),
        (RTLS1, 0.0321),
        (RTLS_F, 0.0214),
        (MEAN_RLS, 0.0518),
        (MEAN_RTLS, 0.0180),
    ],
)
def test_errors_are_those_of_an_independent_program(yaw, name, expected):
    found = yaw.values[name]["error"]
    # Four standard errors of twenty runs, and one and a half of theirs of two hundred.
    assert found.mean() == pytest.approx(expected, abs=5.5 * found.std(ddof=1) / np.sqrt(RUNS))


def test_fusion_of_stacked_rows_helps_total_least_squares_and_averaging_helps_least_squares(yaw):
    assert mean(yaw, RTLS_F) < 0.9 * (mean(yaw, RTLS1) + mean(yaw, RTLS2)) / 2
    assert mean(yaw, RTLS1) < 0.5 * mean(yaw, RLS1)
    assert mean(yaw, RLS_F) > 0.9 * mean(yaw, RLS1)
    assert mean(yaw, MEAN_RLS) < 0.7 * mean(yaw, RLS1)


def test_no_recursion_fails(yaw):
    assert sum(failed.sum() for failed in yaw.failed.values()) == 0


def test_a_recursion_of_one_sensor_does_not_look_at_the_other(study, yaw):
    worse = dataclasses.replace(named(study.experiments, "yaw-0.1"), simulate=noisy_rows(YAW, (0.1, 7.0)))
    found = run(worse, (RLS1, RTLS1, RTLS_F), 1)
    for name in (RLS1, RTLS1):
        np.testing.assert_array_equal(found.every[name]["theta"][0], yaw.every[name]["theta"][0])
    assert mean(found, RTLS_F) != yaw.values[RTLS_F]["error"][0]


def test_rows_are_the_motion_with_equal_noise_in_all_columns():
    records = noisy_rows(YAW, (0.1, 0.4), 2000)
    rows = np.asarray(rows_of(eqx.filter_jit(records)(jax.random.key(1))))
    clean = np.concatenate([records.regressors, (records.regressors @ np.array(YAW.theta))[:, None]], axis=1)
    spread = (rows - clean[:, None]).var(axis=0)
    # A variance of 2000 samples is known to 3 % of it.
    np.testing.assert_allclose(spread, np.array([[0.1] * 4, [0.4] * 4]), rtol=0.13)


def test_intervals_of_the_full_formula_hold_and_those_of_first_order_are_too_narrow(study):
    experiment = named(study.experiments, intervals.asked("yaw-0.2"))
    found = run(experiment, (intervals.SINGLE, intervals.MEAN), 60, quick=True).values
    for contender in (intervals.SINGLE, intervals.MEAN):
        for each in ("m", "d", "d2"):
            # 0.95 less four standard errors of sixty runs.
            assert found[contender][f"full_{each}"].mean() >= 0.84
            assert found[contender][f"sandwich_{each}"].mean() >= 0.84
    assert found[intervals.SINGLE]["first order_d"].mean() < 0.84


def test_isotropic_total_least_squares_of_real_logs_is_far_worse_than_least_squares(study):
    names = (PLAIN, ISOTROPIC, GENERAL, WEAK_CROSS)
    quiet = run(named(study.experiments, realistic.QUIET), names, 10, quick=True)
    loud = run(named(study.experiments, realistic.LOUD), names, 10, quick=True)
    # An independent program, forty runs: both are biases, hardly a matter of the runs.
    assert rms(quiet, ISOTROPIC, "d") == pytest.approx(559, rel=0.1)
    assert rms(loud, ISOTROPIC, "d") == pytest.approx(2971, rel=0.1)
    assert rms(quiet, PLAIN, "m") == pytest.approx(5.4, rel=0.1)
    assert rms(loud, PLAIN, "m") == pytest.approx(48, rel=0.05)
    for contender in (GENERAL, WEAK_CROSS):
        assert rms(quiet, contender, "d") < 30
        assert rms(loud, contender, "d") < 0.6 * rms(loud, PLAIN, "d")
        assert rms(loud, contender, "m") < 2


def test_the_gate_holds_an_estimate_through_an_outage(study):
    found = run(named(study.experiments, "outage-0.316"), (outage.OPEN, outage.GATED), 4).values
    assert found[outage.GATED]["worst"].max() < 1
    assert np.median(found[outage.OPEN]["worst"]) > 20
    np.testing.assert_allclose(found[outage.GATED]["before"], found[outage.OPEN]["before"], rtol=1e-9)


def test_forgetting_follows_a_jump(study):
    slow, fast = (jump.with_forgetting(RTLS_F, factor) for factor in (1.0, 0.995))
    found = run(named(study.experiments, "jump"), (slow, fast), 6)
    # An independent program, fifty runs.
    assert rms(found, slow, "row_2200") == pytest.approx(20.7, rel=0.1)
    assert rms(found, slow, "row_3999") == pytest.approx(11.3, rel=0.1)
    assert rms(found, fast, "row_3000") < 4.0
    assert rms(found, fast, "row_1999") > rms(found, slow, "row_1999")


def test_settled_is_what_stays_below_from_some_sample_on():
    errors = np.ones((8, len(AFTER)))
    errors[:, 50:] = 0.05
    errors[:, 60] = 0.2
    errors[:3, 100] = 0.3  # fewer than half
    assert settled(errors, 0.1).value == AFTER[61]
    assert settled(errors, 0.01).value == np.inf
    assert settled(errors, 2.0).value == 1


def test_numbers_of_several_parameters_and_contenders_are_compared_run_by_run(study):
    values = {
        "a": {"m": np.array([1.0, -2.0, 0.1]), "error": np.array([1.0, 2.0, 3.0])},
        "b": {"m": np.array([-0.5, 3.0, 0.2]), "error": np.array([2.0, 1.0, 2.0])},
    }
    experiment = dataclasses.replace(unequal.chapter().experiments[0], name="x", baseline="")
    outcome = Outcome(study, 3, 0, {"x": Results(experiment, values, {}, {"a": np.zeros(3)}, None)})
    assert [each.value for each in closest(outcome, "x", "m", ("a", "b")).values()] == pytest.approx([2 / 3, 1 / 3])
    found = rms_ratio(outcome, "x", "error", "a", "b")
    assert found.value == pytest.approx(np.sqrt(14 / 9))
    numbers = {"m": Measured(1.0, -1.0, 3.0, 9), "d": Measured(-2.0, -4.0, 0.0, 9), "d2": Measured(0.0, -1.0, 1.0, 9)}
    assert worst_of(lambda _, each: numbers[each])(outcome) == numbers["d"]
    assert scaled(numbers["m"], 2.0, "%", 1.0) == Measured(4.0, 0.0, 8.0, 9, "%")


def test_every_table_figure_and_claim_can_be_made_of_an_outcome(study, monkeypatch):
    monkeypatch.setattr(costs, "timed", lambda: dict.fromkeys(costs.ESTIMATORS, 1e-5))
    random = np.random.default_rng(0)
    runs = 8

    def numbers(quantity):
        low = 0.1 if quantity.statistic != "share" else 0.0
        return random.integers(0, 2, runs) if quantity.statistic == "share" else random.uniform(low, 1.0, runs)

    results = {}
    for each in study.experiments:
        lengths = {"error": (), "theta": (3,)} if each.kept else {}
        rows = len(each.trace.rows) if each.kept else 0
        series = {what: random.uniform(0.1, 1.0, (runs, rows, *width)) for what, width in lengths.items()}
        results[each.name] = Results(
            each,
            {name: {one.name: numbers(one) for one in each.quantities} for name in each.contenders},
            {
                name: {what: Trace(one[0], one[0], one[0], runs) for what, one in series.items()}
                for name in each.contenders
            },
            {name: np.zeros(runs, int) for name in each.contenders},
            eqx.filter_jit(each.simulate)(jax.random.key(0)) if each.name == jump.NAME else None,
            dict.fromkeys(each.contenders, series),
        )
    outcome = Outcome(study, runs, 1, results)
    assert len(outcome.findings) == len(study.claims)
    assert all(len(table.rows) >= 2 for table in study.tables_of(outcome))
    figures = study.figures_of(outcome)
    assert any(isinstance(figure, Chart) for figure in figures)
    assert sum("of the paper" in figure.title for figure in figures) == 2 * len(fusion.CASES) + 2


def test_the_study_is_known_by_its_name_and_its_cases_are_the_papers(study):
    assert list(fusion.CASES) == ["yaw-0.1", "yaw-0.2", "surge-0.1", "surge-0.2"]
    assert study.runs == 200
    assert {each.name for each in study.experiments if not each.baseline} == {
        *(intervals.asked(name) for name in fusion.CASES),
        *outage.STDS,
        jump.NAME,
        vehicle.CLEAN,
    }
