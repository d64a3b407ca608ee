"""Sines and cosines of angles are found by least squares, whatever the number of angles."""

import numpy as np
import pytest

from gainful.networks import HarmonicTraining


def test_a_deviation_curve_is_found_and_closes(rng, key):
    angle = rng.uniform(-np.pi, np.pi, (80, 1))
    waves = (np.sin(angle), np.cos(angle), np.sin(2 * angle), np.cos(2 * angle))
    curve = 2.0 + sum(a * wave for a, wave in zip((4.0, -3.0, 2.0, 1.0), waves, strict=True))
    network, report = HarmonicTraining()(angle, curve, key=key)
    np.testing.assert_allclose(network.amplitudes[0, :, 0], [[4.0, 2.0], [-3.0, 1.0]], atol=1e-12)
    assert float(network.offset[0]) == pytest.approx(2.0, abs=1e-12)
    np.testing.assert_allclose(network(np.array([np.pi])), network(np.array([-np.pi])), atol=1e-12)
    assert report.after[0] < 1e-24


def test_a_recipe_with_fewer_harmonics_leaves_the_others(rng, key):
    angle = rng.uniform(-np.pi, np.pi, (400, 2))
    curve = np.sin(angle[:, :1]) + 0.5 * np.cos(3 * angle[:, 1:])
    network, report = HarmonicTraining(1)(angle, curve, key=key)
    # What is left is a wave of half a unit; 400 samples tell the rest to within a few standard errors of 0.018.
    np.testing.assert_allclose(network.amplitudes[0, 0], [[1.0], [0.0]], atol=0.1)
    assert report.after[0] == pytest.approx(0.125, rel=0.15)
    assert HarmonicTraining(3)(angle, curve, key=key)[1].after[0] < 1e-24
