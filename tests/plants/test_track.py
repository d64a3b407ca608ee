"""Scenarios of a track differ in what they say they differ in, and the model believes what its designer did."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.models import Instant
from gainful.plants import TRACK_SCENARIOS, run_track, settled_track_covariance, track
from gainful.plants.track_scenarios import LEG, correlated

RUNS = 60


@pytest.fixture(scope="module")
def records(generator):
    """Sixty records of every scenario, from the same keys; one program serves all."""
    keys = jax.random.split(jax.random.key(int(generator("tracks").integers(2**31))), RUNS)
    drawn = jax.jit(lambda scenario: jax.vmap(lambda key: run_track(scenario, key=key))(keys))
    return {name: jax.tree.map(np.asarray, drawn(scenario)) for name, scenario in TRACK_SCENARIOS.items()}


def noise(record):
    return record.y[..., 0] - record.states[..., 0]


def pushes(record):
    """What moved the state in each step besides its speed (runs, T - 1, 2)."""
    return record.states[:, 1:] - np.asarray(record.states[:, :-1]) @ np.array([[1.0, 10.0], [0.0, 1.0]]).T


def test_the_model_moves_with_the_interval_and_so_does_its_noise():
    model = track(1.0, 0.1, 0.5)
    when = Instant(jnp.asarray(5.0), jnp.asarray(5.0), jnp.zeros(0))
    x = jnp.array([3.0, 2.0])
    np.testing.assert_allclose(model.transition(x, when), [13.0, 2.0])
    np.testing.assert_allclose(model.process_noise(x, when), np.diag([0.5, 0.005]))
    np.testing.assert_allclose(model.measurement_noise(x, when), [[0.25]])


def test_the_settled_covariance_is_the_one_that_a_step_leaves_alone():
    cov = settled_track_covariance(1.0, 0.02, 0.3)
    F = np.array([[1.0, 10.0], [0.0, 1.0]])
    before = F @ cov @ F.T + np.diag([1.0, 0.02**2])
    gain = before[:, :1] / (before[0, 0] + 0.3**2)
    np.testing.assert_allclose(before - gain @ before[:1], cov, atol=1e-10)


def test_the_noise_has_the_sizes_of_the_scenario(records):
    # 18 000 numbers: a standard deviation is known to 0.5 %, four of these.
    for name in ("matched", "calibrated"):
        scenario, record = TRACK_SCENARIOS[name], records[name]
        np.testing.assert_allclose(noise(record).std(), scenario.fix_sigma, rtol=0.025)
        sizes = [scenario.position_sigma, scenario.speed_sigma]
        np.testing.assert_allclose(pushes(record).std(axis=(0, 1)), sizes, rtol=0.025)


def test_a_key_draws_the_same_random_numbers_whatever_the_scenario(records):
    np.testing.assert_allclose(records["bias"].states, records["calibrated"].states)
    np.testing.assert_allclose(noise(records["bias"]), noise(records["calibrated"]) + 0.5, atol=1e-9)
    struck = np.abs(noise(records["outliers"]) - noise(records["calibrated"])) > 1e-9
    # A share of 18 000 is known to 0.16 %, four of these.
    assert struck.mean() == pytest.approx(0.05, abs=0.0065)


def test_the_filter_starts_with_errors_of_the_size_told_and_of_random_signs(records):
    off = np.array([0.0, 5.0]) - records["calibrated"].start
    np.testing.assert_allclose(np.abs(off), 5.0)
    assert {tuple(row) for row in np.sign(off)} == {(1, 1), (1, -1), (-1, 1), (-1, -1)}
    off = np.array([0.0, 5.0]) - records["matched"].start
    # Variances of 60 draws: four of their standard errors.
    np.testing.assert_allclose(off.var(axis=0), np.diag(settled_track_covariance()), rtol=4 * np.sqrt(2 / RUNS))


def test_legs_of_acceleration_last_ten_steps_with_at_least_twenty_between(records):
    quiet = dataclasses.replace(TRACK_SCENARIOS["manoeuvre"], position_sigma=0.0, speed_sigma=0.0)
    record = run_track(quiet, key=jax.random.key(3))
    change = np.diff(np.asarray(record.states)[:, 1], prepend=5.0)
    moving = np.abs(change) > 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving.astype(int), [0]])))
    begins, ends = edges[::2], edges[1::2]
    assert 5 <= begins[0] < 20
    whole = ends - begins
    assert (whole[:-1] == LEG).all()
    assert whole[-1] <= LEG
    gaps = begins[1:] - ends[:-1]
    assert ((gaps >= 20) & (gaps < 60)).all()
    size = np.abs(change[moving]) / 10.0
    assert ((size > 0.005 - 1e-9) & (size < 0.02 + 1e-9)).all()


def test_coloured_noise_is_as_correlated_as_told():
    white = jax.random.normal(jax.random.key(0), (40_000,))
    found = np.asarray(correlated(white, jnp.asarray(0.9)))
    # Worth 40 000 (1 - rho) / (1 + rho) = 2100 independent numbers: sixths of these standard errors are 9 % of the variance.
    assert found.var() == pytest.approx(1.0, abs=0.13)
    assert np.mean(found[1:] * found[:-1]) / found.var() == pytest.approx(0.9, abs=0.02)
    np.testing.assert_array_equal(correlated(white, jnp.asarray(0.0)), white)


def test_fixes_of_the_map_are_off_by_the_map(records):
    record, scenario = records["map"], TRACK_SCENARIOS["map"]
    wrong = np.asarray(scenario.fix_error(jnp.asarray(record.states[..., 0])))
    np.testing.assert_allclose(noise(record) - wrong, noise(records["calibrated"]), atol=1e-8)
    assert wrong.std() == pytest.approx(np.sqrt((1.5**2 + 1.0) / 2), rel=0.1)


def test_noise_that_varies_is_constant_within_500_seconds_and_within_its_range(records):
    ratio = noise(records["timevarying"]) / noise(records["calibrated"])
    blocks = ratio.reshape(RUNS, -1, 50)
    np.testing.assert_allclose(blocks, np.repeat(blocks[..., :1], 50, axis=2), rtol=1e-6)
    assert ratio.min() > 1.0 - 1e-6
    assert ratio.max() < 50.0 + 1e-4
    assert ratio.max() > 30.0
