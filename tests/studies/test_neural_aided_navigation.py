"""The study of networks beside a navigation filter on a small budget: its numbers, as far as some records tell them."""

import dataclasses
import types

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.aiding import SensorMap
from gainful.networks import zero_map
from gainful.plants import TRACK_SCENARIOS
from gainful.studies import Chart, Outcome, Trace, find_study
from gainful.studies.monte_carlo import Results, run_experiment, run_key
from gainful.studies.neural_aided_navigation import aiding, outage, records, route_map, same_record, table_one
from gainful.studies.neural_aided_navigation.contenders import CMAC, CMAC_GATED, DESIGN, DESIGN_WIDE, ML, TRUE
from gainful.studies.neural_aided_navigation.records import ROWS, SCENARIOS, SEED, STEADY
from gainful.studies.neural_aided_navigation.settling import settling, settling_difference, settling_rows
from gainful.studies.neural_aided_navigation.transfer import FIXED, GATED
from gainful.studies.neural_aided_navigation.vehicle_contenders import (
    COMPASS,
    EXACT,
    knowing,
    navigator,
)

RUNS = 24


def run(experiment, names, runs=RUNS):
    """Some contenders of an experiment."""
    chosen = {name: experiment.contenders[name] for name in names}
    return run_experiment(dataclasses.replace(experiment, contenders=chosen, baseline=""), runs, SEED, quick=False)


def named(study, name):
    return next(each for each in study.experiments if each.name == name)


@pytest.fixture(scope="module")
def study():
    return find_study("neural-aided-navigation")


@pytest.fixture(scope="module")
def calibrated(study):
    return run(named(study, "calibrated"), (DESIGN, DESIGN_WIDE, ML, TRUE, CMAC))


def close(values, expected, share=0.0):
    """Within four standard errors of a mean, and a share of it for how well the other number is known."""
    assert values.mean() == pytest.approx(
        expected, abs=4 * values.std(ddof=1) / np.sqrt(len(values)) + share * expected
    )


def test_theory_says_what_an_independent_program_says_of_the_limits():
    found = table_one.bounds()
    np.testing.assert_allclose(found["the design filter"], (0.03122, 0.03120), atol=5e-6)
    best = found["corrected by the best line of the innovation"]
    np.testing.assert_allclose(best, (0.006393, 0.013268), atol=5e-7)
    for lags, speed in ((2, 0.01003), (5, 0.00789), (12, 0.00759)):
        assert found[f"by the best line of the last {lags} innovations"][1] == pytest.approx(speed, abs=5e-6)


def test_the_design_filter_errs_as_theory_says(calibrated):
    values = calibrated.values[DESIGN]
    for state, expected in zip(("displacement", "speed"), table_one.bounds()["the design filter"], strict=True):
        close(values[state], expected)


def test_noise_fitted_without_truth_is_nearly_as_good_as_the_true_noise(calibrated):
    fitted, true = (calibrated.values[name]["speed"] for name in (ML, TRUE))
    assert fitted.mean() < 1.03 * true.mean()


def test_the_cmac_is_better_than_the_design_and_no_better_than_theory_allows(calibrated):
    values = calibrated.values[CMAC]
    # Of an independent program; ten training sets differ by 2 %.
    close(values["displacement"], 0.0071, 0.06)
    close(values["speed"], 0.0147, 0.06)
    assert values["speed"].mean() > calibrated.values[ML]["speed"].mean()
    assert calibrated.values[DESIGN]["speed"].mean() > 1.7 * values["speed"].mean()


def test_no_filter_fails(calibrated):
    assert sum(failed.sum() for failed in calibrated.failed.values()) == 0


def test_the_design_filter_settles_late_only_because_its_start_is_believed(study, calibrated):
    outcome = Outcome(study, RUNS, SEED, {"calibrated": calibrated})
    for state in (0, 1):
        assert settling(outcome, "calibrated", DESIGN, state).value > 600.0
        assert settling(outcome, "calibrated", DESIGN_WIDE, state).value <= 30.0
        assert settling(outcome, "calibrated", CMAC, state).value <= 150.0
        found = settling_difference(outcome, "calibrated", DESIGN, CMAC, state)
        assert found.low <= found.value <= found.high
        assert found.value > 500.0


def test_settled_is_what_stays_within_its_band_for_two_hundred_seconds():
    rms = np.ones((2, ROWS))
    rms[:, :30] = 5.0
    rms[0, 60] = 1.6
    rms[1, 40] = 1.6
    assert settling_rows(rms).tolist() == [31.0, 42.0]
    assert settling_rows(rms, "last exit").tolist() == [62.0, 42.0]
    assert settling_rows(0.2 * rms, "common band").tolist() == [31.0, 42.0]
    assert np.isinf(settling_rows(rms, "common band")).all()
    rms[0, -1] = 9.0
    assert np.isinf(settling_rows(rms, "last exit")[0])


def test_records_of_training_are_none_of_those_that_anybody_is_judged_on():
    runs = {tuple(np.asarray(jax.random.key_data(run_key(SEED, index)))) for index in range(1000)}
    trained = {
        tuple(np.asarray(jax.random.key_data(key)))
        for k in range(len(SCENARIOS))
        for key in jax.random.split(records.training_key(k), records.TRAINING + records.VALIDATION)
    }
    assert len(trained) == len(SCENARIOS) * (records.TRAINING + records.VALIDATION)
    assert not runs & trained


def test_the_same_training_gives_the_same_network_to_the_last_bit():
    first = aiding.trained(CMAC, "calibrated")
    again = aiding.trained.__wrapped__(CMAC, "calibrated")
    assert again is not first
    assert bool(eqx.tree_equal(first.network, again.network))


def test_the_offline_gate_refuses_what_cannot_help(study):
    assert not aiding.trained(CMAC, "matched").accepted.any()
    assert aiding.trained(CMAC, "calibrated").accepted.all()
    found = run(named(study, "matched"), (DESIGN, CMAC_GATED), 4).values
    np.testing.assert_array_equal(found[CMAC_GATED]["speed"], found[DESIGN]["speed"])
    assert not found[CMAC_GATED]["corrects_speed"].any()


def test_the_online_gate_keeps_a_network_from_doing_harm_where_it_was_not_trained(study):
    found = run(named(study, "used in matched"), (DESIGN, FIXED, GATED), 12).values
    speed = {name: each["speed"].mean() for name, each in found.items()}
    # An independent program: 16 times the error without the gate, 3 % more with it.
    assert speed[FIXED] > 8.0 * speed[DESIGN]
    assert speed[GATED] < 1.5 * speed[DESIGN]
    assert found[GATED]["passed"].mean() < 0.05


def test_a_network_flatters_itself_on_the_record_it_was_taught_with():
    found = run(same_record.same_record_experiment(), (same_record.SAME, same_record.NEW)).values
    same, new = (found[name]["speed"] for name in (same_record.SAME, same_record.NEW))
    close(same, 0.0110, 0.1)
    close(new, 0.0199, 0.1)


def test_the_map_of_the_fixes_is_the_true_one():
    network, scenario = route_map.learned()[0].network, TRACK_SCENARIOS["map"]
    places = jnp.linspace(1000.0, 14_000.0, 100)
    wrong = jax.vmap(lambda x: network(x[None])[0])(places) - scenario.fix_error(places)
    # Waves of 1.27 m; the table's tiles are a thousand metres wide, its quanta sixty.
    assert float(jnp.sqrt(jnp.mean(wrong**2))) < 0.15


def test_knowing_what_sensors_do_wrong_shortens_an_outage(study):
    experiment = named(study, "outage")
    chosen = {COMPASS: navigator(), EXACT: knowing()}
    found = run_experiment(dataclasses.replace(experiment, contenders=chosen), 6, SEED, quick=False)
    distances = {name: np.sqrt((each["distance_120"] ** 2).mean()) for name, each in found.values.items()}
    assert distances[EXACT] < 0.5 * distances[COMPASS]
    assert sum(failed.sum() for failed in found.failed.values()) == 0


def fake_map(signal):
    context = {"compass": 1}.get(signal, 2)
    report = types.SimpleNamespace(before=1.0, in_sample=0.5)
    return SensorMap(signal, ("x",) * context, zero_map(context, 1), jnp.asarray(0.1)), report


def test_every_table_figure_and_claim_can_be_made_of_an_outcome(study, monkeypatch):
    monkeypatch.setattr(outage, "learned", lambda signal, passes=1, kind="CMAC": fake_map(signal))
    monkeypatch.setattr(route_map, "learned", lambda: fake_map("compass"))
    random, runs = np.random.default_rng(0), 8

    def numbers(quantity):
        return random.integers(0, 2, runs) if quantity.statistic == "share" else random.uniform(0.1, 1.0, runs)

    results = {}
    for each in study.experiments:
        shape = {"calibrated": (ROWS, 2), "outage": (131,)}.get(each.name)
        what = "square" if each.name == "outage" else "error"
        series = {} if shape is None else {what: random.uniform(0.1, 1.0, (runs, *shape))}
        results[each.name] = Results(
            each,
            {name: {one.name: numbers(one) for one in each.quantities} for name in each.contenders},
            {
                name: {key: Trace(one[0], one[0], one[0], runs) for key, one in series.items()}
                for name in each.contenders
            },
            {name: np.zeros(runs, int) for name in each.contenders},
            eqx.filter_jit(each.simulate)(jax.random.key(0)) if each.name == "calibrated" else None,
            dict.fromkeys(each.contenders, series) if each.kept else {},
        )
    outcome = Outcome(study, runs, 1, results)
    assert len(outcome.findings) == len(study.claims)
    assert all(len(table.rows) >= 2 for table in study.tables_of(outcome))
    figures = study.figures_of(outcome)
    assert any(isinstance(figure, Chart) for figure in figures)
    assert sum("of the paper" in figure.title for figure in figures) == 2


def test_the_study_is_known_by_its_name_and_always_shows_the_tuned_filter(study):
    assert study.runs == 100
    assert STEADY == 150
    assert {each.name for each in study.experiments if not each.baseline} == {"one record"}
    assert {each.baseline for each in study.experiments} == {ML, COMPASS, ""}
    assert set(SCENARIOS) <= {each.name for each in study.experiments}
