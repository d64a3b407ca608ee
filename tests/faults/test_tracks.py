"""Parameters change as the faults of signals do, and a bounded walk stays in its bounds."""

import jax
import jax.numpy as jnp
import numpy as np

from gainful.faults import Bias, Intermittent, Loss, parameter_tracks, ramp, reflected_walk

T = 1e-3 * (np.arange(1500) + 0.5)
NOMINAL = {"p1": 1.0, "p2": 1.0}


def test_a_jump_is_there_from_the_interval_that_starts_with_it():
    tracks = parameter_tracks(T, NOMINAL, [Bias("p1", 1.0, onset=0.6), Loss("p2", 0.4, onset=0.9)])
    np.testing.assert_allclose(tracks[:, 0], np.where(np.arange(1500) >= 600, 2.0, 1.0), rtol=1e-14)
    np.testing.assert_allclose(tracks[:, 1], np.where(np.arange(1500) >= 900, 0.6, 1.0), rtol=1e-14)


def test_a_ramp_grows_from_start_to_end_and_stays():
    tracks = parameter_tracks(T, NOMINAL, [*ramp("p1", 1.0, 0.45, 1.05), *ramp("p2", -0.4, 0.45, 1.05)])
    share = np.clip((T - 0.45) / 0.6, 0.0, 1.0)
    np.testing.assert_allclose(tracks, np.stack([1.0 + share, 1.0 - 0.4 * share], axis=1), atol=1e-12)


def test_a_fault_that_comes_and_goes_does_so_every_two_hundred_samples():
    fault = Intermittent(Bias("p1", 1.0, onset=0.6), period=0.4, duty=0.5)
    track = parameter_tracks(T, NOMINAL, [fault])[:, 0]
    k = np.arange(1500)
    there = (k >= 600) & ((k - 600) % 400 < 200)
    np.testing.assert_allclose(track, np.where(there, 2.0, 1.0), rtol=1e-14)


def test_without_faults_parameters_are_nominal():
    assert parameter_tracks(T[:3], {"p1": 1.0, "p2": 0.5}).tolist() == [[1.0, 0.5]] * 3


def test_a_reflected_walk_stays_in_its_bounds_and_is_a_free_walk_while_it_reaches_none():
    key = jax.random.key(3)
    track = np.asarray(reflected_walk(key, 20000, 0.02))
    assert track.min() >= 0.4
    assert track.max() <= 2.0
    assert np.abs(np.diff(track)).max() < 6 * 0.02  # reflection makes no jumps
    free = 1.0 + np.cumsum(0.02 * np.asarray(jax.random.normal(key, (20000,))))
    first = int(np.flatnonzero((free < 0.4) | (free > 2.0))[0])
    np.testing.assert_allclose(track[:first], free[:first], atol=1e-12)
    np.testing.assert_allclose(track[first], 0.8 - free[first] if free[first] < 0.4 else 4.0 - free[first], atol=1e-12)


def test_a_long_reflected_walk_is_spread_evenly_between_its_bounds():
    # Steps of 0.2 forget where they were within (1.6 / 0.2)^2 = 64 samples or so: 64 apart, over 200 walks, they are
    # independent and uniform.
    walks = jax.vmap(lambda key: reflected_walk(key, 320, 0.2)[63::64])(jax.random.split(jax.random.key(0), 400))
    quarters = np.histogram(np.asarray(walks[:, 1:]).ravel(), bins=4, range=(0.4, 2.0))[0]
    expected, count = walks[:, 1:].size / 4, walks[:, 1:].size
    assert np.all(np.abs(quarters - expected) < 4.0 * np.sqrt(count * 0.25 * 0.75))


def test_tracks_are_drawn_in_batches():
    onsets = jnp.array([0.2, 0.7])
    batch = jax.vmap(lambda onset: parameter_tracks(T, NOMINAL, [Bias("p1", 1.0, onset=onset)]))(onsets)
    assert batch.shape == (2, 1500, 2)
    np.testing.assert_allclose(batch[:, :, 0].sum(axis=1), [1500 + 1300, 1500 + 800], rtol=1e-12)
