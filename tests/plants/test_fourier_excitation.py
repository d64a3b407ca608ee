"""The modified Fourier series starts and ends at rest, and its derivatives are its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np

from gainful.plants import fourier_excitation

A, B, PERIOD = (-0.01, 0.12, -0.21, 0.18, 0.65), (-0.07, 0.53, -0.13, -0.37, -0.06), 20.0


def test_the_series_has_the_published_value() -> None:
    found = fourier_excitation(A, B, PERIOD, jnp.array(5.0))
    np.testing.assert_allclose(found, [2.3607510696, 0.7949992496, -1.8547868826], atol=6e-11)


def test_the_series_rests_at_the_ends_of_its_period() -> None:
    for t in (0.0, PERIOD - 1e-9, PERIOD, 3 * PERIOD):
        # A nanosecond before the end the jerk, some rad/s^3, has let the acceleration grow by some 1e-9.
        assert np.abs(fourier_excitation(A, B, PERIOD, jnp.array(t))).max() < 1e-8
    assert np.abs(fourier_excitation(A, B, PERIOD, jnp.array(0.0))).max() < 1e-12


def test_rate_and_acceleration_are_derivatives() -> None:
    t = jnp.linspace(0.1, 39.9, 50)
    rate_of = jax.vmap(jax.grad(lambda s: fourier_excitation(A, B, PERIOD, s)[0]))
    acceleration_of = jax.vmap(jax.grad(lambda s: fourier_excitation(A, B, PERIOD, s)[1]))
    _, rate, acceleration = fourier_excitation(A, B, PERIOD, t)
    np.testing.assert_allclose(rate_of(t), rate, atol=1e-11)
    np.testing.assert_allclose(acceleration_of(t), acceleration, atol=1e-11)
