"""Recordings: sensors, their noise, and what is refused."""

import numpy as np
import pytest

from gainful.errors import ConfigError, DataError, ShapeError
from gainful.identification import Recording

from .problems import recording

T = np.arange(10.0)


def test_noise_comes_from_the_differences_of_sensors(rng) -> None:
    of = recording(rng, 0.05, 0.3, sensors=4)
    # A standard deviation from 3 x 1600 degrees of freedom has a relative error of 1 / sqrt(2 x 4800).
    assert of.noise == {"r": pytest.approx(0.05, rel=5 / np.sqrt(9600))}
    assert of.mean_noise()["r"] == pytest.approx(of.noise["r"] / 2)
    assert of.mean_noise(1)["r"] == pytest.approx(of.noise["r"] / np.sqrt(2))


def test_a_sensor_that_misses_leaves_the_mean_to_the_others() -> None:
    values = np.stack([np.full(10, 1.0), np.full(10, 3.0)], axis=1) + np.eye(10, 2)
    values[5, 0] = np.nan
    of = Recording(T, {"r": values})
    assert of.mean()["r"][[4, 5, 6]].tolist() == [2.0, 3.0, 2.0]
    assert of.mean(0)["r"][4] == 1.0


def test_a_late_sensor_is_found(rng) -> None:
    signal = np.convolve(rng.standard_normal(400), np.hanning(9), mode="same")
    both = np.stack([signal, np.roll(signal, 2)], axis=1)[10:-10]
    lags = Recording(np.arange(380.0), {"r": both}).lags
    assert lags["r"] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Recording(T[:2], {"r": T[:2]}), ShapeError, "t: expected at least 3 times, got shape (2,)"),
        (
            lambda: Recording(T**2, {"r": T}),
            DataError,
            "t: expected equal steps, got 1 s after t = 0 s where the mean is 9 s",
        ),
        (lambda: Recording(-T, {"r": T}), DataError, "t: expected equal steps"),
        (
            lambda: Recording(T, {"r": T[:4]}),
            ShapeError,
            "values: expected shape (10,) or (10, sensors) for 'r', got (4, 1)",
        ),
        (lambda: Recording(T, {"r": T * np.nan}), DataError, "values: expected numbers for 'r', got none"),
        (
            lambda: Recording(T, {"r": np.random.default_rng(0).normal(size=(10, 2)), "q": np.eye(10, 3)}),
            ShapeError,
            "values: expected one sensor of a signal or as many as of the others, got r 2, q 3",
        ),
        (
            lambda: Recording(T, {"r": np.stack([T, T], axis=1)}),
            DataError,
            "values: sensors 1 and 2 of 'r' are one and the same",
        ),
        (
            lambda: Recording(T, {"rate": T}, {"rat": 1.0}),
            ConfigError,
            "std: 'rat' is not a signal; did you mean 'rate'?",
        ),
        (
            lambda: Recording(T, {"r": T}, {"r": -1.0}),
            ConfigError,
            "std: expected a number of at least 0 for 'r', got -1.0",
        ),
    ],
)
def test_what_is_no_recording_is_refused(make, error, message) -> None:
    with pytest.raises(error) as caught:
        make()
    assert message in str(caught.value)
