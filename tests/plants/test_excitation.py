"""Excitations have the spectra, periods and levels they promise."""

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.plants import chirp, multisine, prbs


def test_the_default_sequence_has_period_511_and_one_more_high_than_low():
    bits = np.asarray(prbs(2 * 511, clock=1))
    assert bits[:511].tolist() == bits[511:].tolist()
    assert not any(bits[:511].tolist() == np.roll(bits[:511], k).tolist() for k in range(1, 511))
    assert bits[:511].sum() == 1.0
    assert bits[:9].tolist() == [1.0] * 9  # the register as it starts


def test_a_sequence_of_full_length_is_white_over_its_period():
    bits = np.asarray(prbs(511, clock=1))
    correlation = [int(bits @ np.roll(bits, k)) for k in range(511)]
    assert correlation == [511] + [-1] * 510


@pytest.mark.parametrize(("register", "taps"), [(5, (5, 3)), (7, (7, 6)), (10, (10, 7))])
def test_other_registers_have_their_full_period_too(register, taps):
    period = 2**register - 1
    bits = np.asarray(prbs(period + register, register=register, taps=taps, clock=1))
    words = {tuple(bits[k : k + register]) for k in range(period)}
    assert len(words) == period  # every word but all low occurs once


def test_a_clock_holds_the_signal_and_the_amplitude_is_its_size():
    fast, slow = np.asarray(prbs(30, clock=1)), np.asarray(prbs(295, clock=10, amplitude=2.5))
    assert slow.shape == (295,)
    assert slow.tolist() == (2.5 * np.repeat(fast, 10)[:295]).tolist()


def test_a_multisine_has_its_power_at_its_frequencies_and_a_low_peak():
    t = 1e-3 * jnp.arange(1000)
    frequencies = np.arange(1, 21, dtype=float)  # Hz
    signal = np.asarray(multisine(t, frequencies, 0.7))
    power = 2.0 * np.abs(np.fft.rfft(signal) / 1000) ** 2
    np.testing.assert_allclose(power[1:21], 0.7**2 / 20, rtol=1e-9)
    assert power[21:].max() < 1e-20
    # In phase they would reach sqrt(2 n) = 6.3 times their root mean square.
    assert np.abs(signal).max() < 2.5 * 0.7


def test_a_chirp_runs_from_its_first_to_its_last_frequency():
    t = 1e-4 * jnp.arange(20001)
    signal = np.asarray(chirp(t, 5.0, 45.0, 0.5))
    crossings = np.flatnonzero(np.diff(np.sign(signal[1:])) != 0)
    half_periods = 1e-4 * np.diff(crossings)
    # 10 to 90 Hz of half periods; over one of them the frequency moves by at most 20 Hz/s times it.
    assert 0.5 / half_periods[0] == pytest.approx(6.0, abs=1.5)
    assert 0.5 / half_periods[-1] == pytest.approx(45.0, abs=1.0)
    assert np.abs(signal).max() == pytest.approx(0.5, rel=1e-3)
    # 25 Hz on average for 2 s
    assert len(crossings) == pytest.approx(100, abs=1)
