"""The study of robust joint estimation on a small budget: its numbers, as far as twenty records tell them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.studies import Chart, Outcome, Trace, find_study
from gainful.studies.monte_carlo import Results, run_experiment, run_key
from gainful.studies.robust_joint_estimation.contenders import (
    DETECTOR,
    NOMINAL,
    RA,
    TOTAL,
    TUNED,
    Belief,
    believing,
    contender,
)
from gainful.studies.robust_joint_estimation.linear import regression
from gainful.studies.robust_joint_estimation.measures import HOLD, NAMES, WINDOW, detection, judged, settling
from gainful.studies.robust_joint_estimation.records import NOISES, ONSETS, SAMPLES, WALK, drive
from gainful.studies.robust_joint_estimation.tuning import WALKS, tuned
from gainful.updates.change_detection import Changes

RUNS = 20


def run(noise, names, kind="constant", walk=0.0, others=None):
    law = NOISES[noise]
    chosen = {name: contender(name, believing(name, law, Belief())) for name in names} | (others or {})
    return run_experiment(judged(noise, noise, drive(law, kind, walk=walk), chosen), RUNS, 1)


@pytest.fixture(scope="module")
def study():
    return find_study("robust-joint-estimation")


@pytest.fixture(scope="module")
def gaussian():
    return run("gaussian", (NOMINAL, RA, DETECTOR), walk=WALK)


@pytest.fixture(scope="module")
def mixture():
    return run("mixture", (NOMINAL, TOTAL, RA, DETECTOR), walk=WALK, others={"regression": regression()})


@pytest.fixture(scope="module")
def abrupt():
    return run("mixture", (RA, DETECTOR), "abrupt")


@eqx.filter_jit
def simulated(drive, key):
    return drive(key)


def values(results, contender, quantity):
    return results.values[contender][quantity]


def of(results, contender, quantity):
    return float(values(results, contender, quantity).mean())


def test_the_extended_filter_is_consistent_in_gaussian_noise(gaussian):
    for name in NAMES:
        found = values(gaussian, NOMINAL, f"nees_{name}")
        # Errors are correlated over time, those of the parameters over most of a record: the records' own scatter tells.
        reach = max(0.1, 4 * found.std(ddof=1) / np.sqrt(RUNS))
        assert found.mean() == pytest.approx(1.0, abs=reach)
        assert reach < {"p1": 0.6, "p2": 0.25}.get(name, 0.12)


def test_as_many_whitened_innovations_are_inside_the_threshold_as_gaussian_ones_would_be(gaussian):
    # 2 Phi(k) - 1 = 0.7458 for a consistent covariance; the filter's own is a little large.
    assert 0.74 < of(gaussian, RA, "inside") < 0.765


# Half widths of the bands of 50 records, wider by sqrt(50 / 20) for the scatter of fewer.
WIDER = np.sqrt(50 / RUNS)


@pytest.mark.parametrize(("quantity", "middle", "half"), [("x", -0.60, 0.03), ("p", -2.755, 0.095)])
def test_the_errors_of_the_robust_filter_are_those_of_an_independent_implementation(mixture, quantity, middle, half):
    assert of(mixture, RA, quantity) == pytest.approx(middle, abs=half * WIDER)


def test_the_robust_filter_is_better_than_one_told_the_total_variance_as_elsewhere(mixture):
    off = values(mixture, RA, "x") - values(mixture, TOTAL, "x")
    assert off.mean() == pytest.approx(-0.405, abs=0.035 * WIDER)
    assert of(mixture, TOTAL, "x") < of(mixture, NOMINAL, "x")


def test_outliers_cost_the_robust_filter_little_and_gaussian_noise_next_to_nothing(gaussian, mixture):
    cost = values(mixture, RA, "x") - values(gaussian, RA, "x")
    assert cost.mean() == pytest.approx(0.080, abs=0.02)
    price = values(gaussian, RA, "x") - values(gaussian, NOMINAL, "x")
    assert price.mean() == pytest.approx(0.034, abs=0.01)


def test_the_robust_filter_is_unbiased_and_its_covariance_tells_its_errors(mixture):
    for name in NAMES[:3]:
        assert abs(of(mixture, RA, f"bias_{name}")) < 0.05
        assert of(mixture, RA, f"nees_{name}") == pytest.approx(1.0, abs=0.1)
        assert of(mixture, NOMINAL, f"nees_{name}") > 4.0


def test_the_detectors_scores_are_of_zero_mean_and_unit_variance_while_nothing_jumps(gaussian, mixture):
    for results in (gaussian, mixture):
        assert abs(of(results, DETECTOR, "score_mean")) < 0.03
        assert 0.8 < of(results, DETECTOR, "score_variance") < 1.1


def test_the_detector_raises_less_than_an_alarm_per_ten_thousand_samples_and_parameter(gaussian, mixture):
    for results in (gaussian, mixture):
        # 2 parameters, 1300 samples armed: 5.2 alarms at that rate, 2.2 at the one measured elsewhere.
        assert values(results, DETECTOR, "alarms").sum() <= 5


def test_every_jump_is_found_in_the_right_parameter_within_60_samples(abrupt):
    for name in ("p1", "p2"):
        assert (values(abrupt, DETECTOR, f"delay_{name}") <= 60).all()
    assert of(abrupt, DETECTOR, "wrong") <= 0.3
    assert 2.0 <= of(abrupt, DETECTOR, "alarms") <= 2.5


def test_the_detector_recovers_from_jumps_that_the_robust_filter_takes_for_outliers(abrupt):
    assert of(abrupt, DETECTOR, "p") == pytest.approx(-1.90, abs=0.10 * WIDER)
    assert of(abrupt, RA, "p") == pytest.approx(-1.08, abs=0.05)
    for name in ("p1", "p2"):
        assert np.median(values(abrupt, DETECTOR, f"settling_{name}")) < 30.0
        assert np.median(values(abrupt, RA, f"settling_{name}")) > 80.0


def test_regression_on_noisy_readings_is_biased(mixture):
    # Errors in the regressors: velocity and pressure are read ten times too wrong, now and then.
    assert of(mixture, "regression", "bias_p1") > 0.5
    assert abs(of(mixture, "regression", "bias_p2")) < 0.1


def test_no_filter_fails(gaussian, mixture, abrupt):
    for results in (gaussian, mixture, abrupt):
        assert sum(failed.sum() for failed in results.failed.values()) == 0


def test_tuning_finds_the_walk_that_the_study_uses():
    found = tuned(NOMINAL, runs=2)
    assert list(found.tried) == [f"{walk:g}" for walk in WALKS]
    assert not found.at_edge
    assert found.tried[f"{TUNED[NOMINAL]:g}"].value - found.tried[found.best].value < 0.03


def test_records_with_the_same_key_have_the_same_random_numbers():
    key = run_key(1, 0)
    plain, dirty, jumps = (
        simulated(drive(law, kind), key)
        for law, kind in (
            (NOISES["gaussian"], "constant"),
            (NOISES["mixture"], "constant"),
            (NOISES["mixture"], "abrupt"),
        )
    )
    same = dirty.truth["variance"] == plain.truth["variance"]
    assert 0.88 < same.mean() < 0.92
    np.testing.assert_array_equal(dirty.samples.y[same], plain.samples.y[same])
    before = slice(0, ONSETS[0])
    np.testing.assert_array_equal(dirty.samples.y[before], jumps.samples.y[before])
    assert jumps.truth["parameters"][ONSETS[0] - 1 : ONSETS[0] + 1, 0].tolist() == [1.0, 2.0]
    assert jumps.truth["parameters"][ONSETS[1] - 1 : ONSETS[1] + 1, 1].tolist() == pytest.approx([1.0, 0.6])


@pytest.mark.parametrize(
    ("inside", "expected"),
    [((0, WINDOW + HOLD), 1.0), ((40, WINDOW + HOLD), 41.0), ((40, 40 + HOLD - 1), np.inf), ((40, 40 + HOLD), 41.0)],
)
def test_settled_is_what_stays_within_the_tolerance_for_a_while(inside, expected):
    error = np.ones(SAMPLES)
    error[ONSETS[0] + inside[0] : ONSETS[0] + inside[1]] = 0.1
    assert float(settling(jnp.asarray(error), 0.3, ONSETS[0])) == expected


def test_an_alarm_is_wrong_unless_the_parameter_changed_just_before():
    parameters = np.ones((SAMPLES, 2))
    parameters[ONSETS[0] :, 0] = 2.0
    alarm = np.zeros((SAMPLES, 2))
    alarm[ONSETS[0] + 9, 0] = 1.0
    alarm[ONSETS[0] + 9, 1] = alarm[ONSETS[0] + 200, 0] = -1.0
    none = jnp.zeros((SAMPLES, 2))
    memory = (Changes(none, none, none, jnp.asarray(alarm), none, none, None), None)
    found = detection(jnp.asarray(parameters), memory)
    assert (float(found["alarms"]), float(found["wrong"])) == (3.0, 2.0)
    assert (float(found["delay_p1"]), float(found["delay_p2"])) == (10.0, np.inf)


def test_every_table_figure_and_claim_can_be_made_of_an_outcome(study):
    random = np.random.default_rng(0)
    record = simulated(study.experiments[0].simulate, run_key(1, 0))

    def series(width):
        some = random.uniform(0.1, 1.0, (SAMPLES, *width))
        return Trace(some, some, some, 2)

    widths = {"states": (3,), "parameters": (2,), "sigma": (2,), "x": (), "p": ()}
    results = {
        each.name: Results(
            each,
            {
                name: {
                    one.name: random.integers(0, 2, 2) if one.statistic == "share" else random.uniform(0.1, 1.0, 2)
                    for one in each.quantities
                }
                for name in each.contenders
            },
            {name: {what: series(width) for what, width in widths.items()} for name in each.contenders},
            {name: np.zeros(2, int) for name in each.contenders},
            record,
        )
        for each in study.experiments
    }
    outcome = Outcome(study, 2, 1, results)
    assert len(outcome.findings) == len(study.claims)
    assert all(len(table.rows) > 3 for table in study.tables_of(outcome))
    assert any(isinstance(figure, Chart) for figure in study.figures_of(outcome))


def test_the_study_is_known_by_its_name_and_has_a_fair_baseline_in_all_but_one_experiment(study):
    assert [each.name for each in study.experiments if not each.baseline] == ["misjudged"]
    assert study.runs == 50
