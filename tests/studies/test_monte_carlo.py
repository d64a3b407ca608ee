"""Runs: one key each, the same numbers however they are scheduled, and nothing that fails goes untold."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.running import compiled
from gainful.studies import Contender, Quantity, Record, Study, tune
from gainful.studies.monte_carlo import run_experiment, run_key

from . import walk


@pytest.fixture(scope="module")
def small():
    """Two contenders without a jump."""
    chosen = {name: each for name, each in walk.contenders().items() if name != "nervous"}
    return walk.experiment(contenders=chosen)


@pytest.fixture(scope="module")
def results(small):
    return run_experiment(small, 5, 1)


def same(one, other):
    for contender, quantities in one.values.items():
        for name, values in quantities.items():
            np.testing.assert_array_equal(values, other.values[contender][name][: len(values)])


@pytest.mark.parametrize("at_once", [1, 2, 5, 9])
def test_numbers_do_not_depend_on_how_many_runs_are_under_way(small, results, at_once):
    other = run_experiment(small, 5, 1, at_once=at_once)
    same(results, other)
    for contender, traces in results.traces.items():
        for name, trace in traces.items():
            np.testing.assert_array_equal(trace.mean, other.traces[contender][name].mean)
            np.testing.assert_array_equal(trace.std, other.traces[contender][name].std)


def test_more_runs_begin_with_the_same(small, results):
    same(results, run_experiment(small, 7, 1))


def test_another_seed_gives_other_numbers(small, results):
    other = run_experiment(small, 5, 2)
    assert not np.isin(other.values["tuned"]["square"], results.values["tuned"]["square"]).any()


def test_runs_stepped_as_one_batch_differ_in_rounding_only(small, results):
    other = run_experiment(small, 5, 1, at_once=2, together=True)
    assert other.runs == 5
    for name, values in results.values.items():
        # A stable filter does not amplify rounding: a few ulp per row at most.
        np.testing.assert_allclose(other.values[name]["square"], values["square"], rtol=1e-12)
    np.testing.assert_allclose(other.record.truth["x"], results.record.truth["x"], rtol=1e-12)


def test_programs_compiled_quickly_differ_in_rounding_only(small, results):
    other = run_experiment(small, 5, 1, quick=True)
    for name, values in results.values.items():
        np.testing.assert_allclose(other.values[name]["square"], values["square"], rtol=1e-12)


@pytest.fixture(scope="module")
def by_hand(small):
    """The first runs of the tuned filter, without the machinery: numbers and traces."""

    @jax.jit
    def one(key):
        record = small.simulate(key)
        info = small.contenders["tuned"](record)
        return small.measure(record, info), small.trace(record, info)

    return [one(run_key(1, run)) for run in range(5)]


def test_a_run_is_what_its_parts_give_by_hand(results, by_hand):
    # Compiled as one program rather than two: a few ulp per row.
    wanted = [float(numbers["square"]) for numbers, _ in by_hand]
    np.testing.assert_allclose(results.values["tuned"]["square"], wanted, rtol=1e-12)


def test_all_experiments_see_the_same_noise():
    records = [run_experiment(walk.experiment(jump=jump), 1, 4).record for jump in (0.0, 8.0)]
    shift = records[1].samples.y - records[0].samples.y
    np.testing.assert_allclose(np.unique(shift.round(12)), [0.0, 8.0])


def test_a_trace_is_the_first_run_and_the_mean_and_spread_of_all(results, by_hand):
    each = [np.asarray(traces["square"]) for _, traces in by_hand]
    trace = results.traces["tuned"]["square"]
    np.testing.assert_allclose(trace.first, each[0], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(trace.mean, np.mean(each, axis=0), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(trace.std, np.std(each, axis=0, ddof=1), rtol=1e-8, atol=1e-15)
    assert trace.runs == 5


def test_contenders_that_differ_in_numbers_share_a_program():
    before = len(compiled._executables)
    run_experiment(walk.experiment(measure=lambda record, info: walk.measure(record, info)), 1, 1)
    # One to simulate, one for all three filters.
    assert len(compiled._executables) - before == 2


def test_numbers_do_not_depend_on_how_many_contenders_are_run_at_once(small, results):
    for workers in (1, 3):
        same(results, run_experiment(small, 5, 1, workers=workers))


def test_contenders_of_two_experiments_share_their_programs(small):
    run_experiment(small, 1, 1)
    before = len(compiled._executables)
    run_experiment(dataclasses.replace(small, name="again", title="Again"), 1, 1)
    assert len(compiled._executables) == before


def test_a_program_wanted_by_two_threads_is_compiled_once():
    def doubled(fixed, x):
        return fixed * x

    def call(_):
        return compiled.compiled_call(doubled, 2.0, jnp.arange(3.0))

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(call, range(8)))
    assert sum(seconds > 0 for _, seconds in found) == 1
    for value, _ in found:
        np.testing.assert_array_equal(value, [0.0, 2.0, 4.0])


def test_traces_that_are_kept_are_those_of_every_run(small, by_hand):
    kept = run_experiment(dataclasses.replace(small, kept=("square",)), 5, 1)
    assert list(kept.every["tuned"]) == ["square"]
    wanted = [np.asarray(traces["square"]) for _, traces in by_hand]
    np.testing.assert_allclose(kept.every["tuned"]["square"], wanted, rtol=1e-9, atol=1e-15)
    together = run_experiment(dataclasses.replace(small, kept=("square",)), 5, 1, at_once=2, together=True)
    np.testing.assert_allclose(together.every["tuned"]["square"], wanted, rtol=1e-9, atol=1e-15)
    outcome = walk.study(experiments=(dataclasses.replace(small, kept=("square",)),)).run(5, 1)
    np.testing.assert_array_equal(outcome.every("quiet", "tuned", "square"), kept.every["tuned"]["square"])


def test_an_experiment_without_noise_is_run_once_and_a_costly_one_not_too_often(small):
    assert dataclasses.replace(small, random=False).runs(20) == 1
    assert dataclasses.replace(small, most_runs=5).runs(20) == 5
    assert dataclasses.replace(small, most_runs=5).runs(3) == 3


def test_progress_counts_the_runs_of_all_experiments(small):
    told = []
    experiments = (small, dataclasses.replace(small, name="costly", most_runs=1))
    walk.study(experiments=experiments).run(3, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_steps_that_failed_and_numbers_that_are_none_are_told(small):
    def sour(key):
        record = walk.simulate(key)
        bad = jnp.where(jax.random.uniform(key) < 2.0, jnp.nan, 1.0)
        return Record(record.samples, {"x": record.truth["x"] * bad})

    def judged(record, info):
        flag = jnp.where(jnp.isnan(record.truth["x"][0]), jnp.nan, 1.0)
        odd = jnp.where(info.residual[5, 0] > 0, flag, 1.0)
        return {"odd": odd, "never": jnp.nan}

    breaking = gf.discrete_model(
        lambda x, u, t: jnp.where(t > 100, jnp.nan, 1.0) * x,
        lambda x, u, t: x,
        states=["x"],
        outputs=["y"],
        Q=0.1,
        R=1.0,
    )
    contenders = {"broken": Contender(gf.extended_kalman_filter(), breaking, walk.PRIOR)}
    quantities = (Quantity("odd", "odd"), Quantity("never", "never"))
    sick = walk.experiment(
        simulate=sour, measure=judged, quantities=quantities, contenders=contenders, trace=None, baseline="broken"
    )
    outcome = walk.study(experiments=(sick,)).run(8)
    steps, odd = outcome.warnings
    failed = outcome.results["quiet"].failed["broken"]
    assert (failed >= 1).all()
    assert steps == f"broken in experiment 'quiet': {failed.sum()} steps failed, in 8 of 8 runs"
    count = int(np.isnan(outcome.values("quiet", "broken", "odd")).sum())
    assert 0 < count < 8
    assert odd == f"broken in experiment 'quiet': no odd in {count} of 8 runs"


def test_a_contender_may_start_from_the_record_or_be_any_function(small):
    def first(record):
        return gf.Gaussian.start(record.samples.y[0], jnp.eye(1), walk.MODEL.space)

    contenders = {
        "from the record": Contender(gf.kalman_filter(), walk.MODEL, first),
        "raw": lambda record: record.samples.y[:, 0],
    }

    def measure(record, reading):
        x = reading if isinstance(reading, jax.Array) else reading.estimate.mean[:, 0]
        return {"square": jnp.mean((x - record.truth["x"]) ** 2)}

    made = run_experiment(
        dataclasses.replace(
            small, contenders=contenders, measure=measure, quantities=walk.QUANTITIES[:1], trace=None, baseline=""
        ),
        4,
        0,
    )
    assert made.values["raw"]["square"].mean() > made.values["from the record"]["square"].mean() > 0


def test_tuning_finds_the_noise_that_the_walk_has(small):
    settings = {f"{q:g}": Contender(gf.kalman_filter(), walk.walk(q), walk.PRIOR) for q in (1e-3, 0.1, 10.0)}
    found = tune(small, settings, "square", runs=6, seed=11)
    assert found.best == "0.1"
    assert not found.at_edge
    assert list(found.tried) == ["0.001", "0.1", "10"]
    del settings["0.001"]
    assert tune(small, settings, "square", runs=6, seed=11).at_edge


def test_a_study_is_data(small):
    assert isinstance(walk.study(), Study)
