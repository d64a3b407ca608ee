"""What is asked for one sample ahead."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import (
    FollowReference,
    QuinticSlews,
    RateCommand,
    SetPoint,
    euler321_rates,
    euler321_rates_inverse,
)

T = 0.1
SLEWS = QuinticSlews(np.radians([[0.0, 0.0, 0.0], [20.0, 10.0, -15.0]]))
BRAKING = jnp.array([2e-3, 4e-3, 2.4e-3])


def state(angles: jax.Array, rate: jax.Array, modes: int = 3) -> jax.Array:
    return jnp.concatenate([angles, 0.01 * jnp.arange(modes), rate, jnp.zeros(modes)])


def asked(command: RateCommand, x: jax.Array, t: float = 10.0, carry: jax.Array | None = None) -> np.ndarray:
    modes = (len(x) - 6) // 2
    carry = command.init() if carry is None else carry
    memory, wanted = command.desired(carry, jnp.asarray(t), x)
    np.testing.assert_array_equal(memory, wanted[3 + modes : 6 + modes])
    return np.asarray(memory)


def test_on_the_reference_the_rate_asked_for_is_the_references() -> None:
    ahead = jnp.asarray(10.0 + T)
    rate = SLEWS.target_rate(jnp.asarray(10.0))
    angles = SLEWS.angles(ahead) - T * euler321_rates(SLEWS.angles(10.0)) @ rate
    # The rates of the angles are taken at the angles themselves, which are this far from the reference's.
    found = asked(RateCommand(T, SLEWS), state(angles, rate, 0))
    np.testing.assert_allclose(found, SLEWS.target_rate(ahead), atol=1e-5)


def test_every_term_of_a_rate_command_is_what_it_is_called(rng: np.random.Generator) -> None:
    angles, rate = jnp.asarray(0.1 * rng.normal(size=3)), jnp.asarray(0.01 * rng.normal(size=3))
    x, ahead = state(angles, rate), jnp.asarray(10.0 + T)
    error = SLEWS.angles(ahead) - angles - T * euler321_rates(angles) @ rate
    plain = SLEWS.target_rate(ahead) + 0.7 * error
    np.testing.assert_allclose(asked(RateCommand(T, SLEWS, 0.7), x), plain, rtol=1e-13)
    panel, resting = jnp.array([0.03, 0.25, 0.07]), 2.0 * jnp.eye(3)
    damped = plain + panel * (x[3:6] - resting @ SLEWS.target_acceleration(ahead))
    found = asked(RateCommand(T, SLEWS, 0.7, panel_gain=panel, quasi_static=resting), x)
    np.testing.assert_allclose(found, damped, rtol=1e-13)
    np.testing.assert_allclose(
        asked(RateCommand(T, SLEWS, 0.7, panel_gain=jnp.diag(panel), quasi_static=resting), x), damped
    )
    before = jnp.array([0.01, 0.02, -0.01])
    found = asked(RateCommand(T, SLEWS, 0.7, contraction=0.4), x, carry=before)
    np.testing.assert_allclose(found, plain + 0.6 * (rate - before), rtol=1e-13)
    # Nothing was asked for before the first sample.
    np.testing.assert_allclose(asked(RateCommand(T, SLEWS, 0.7, contraction=0.4), x), plain, rtol=1e-13)


def test_braking_limits_the_approach_and_leaves_small_errors_alone() -> None:
    angles = SLEWS.angles(10.0 + T)
    free, braked = RateCommand(T, SLEWS), RateCommand(T, SLEWS, braking=BRAKING)
    small, large = (state(angles - size, jnp.zeros(3)) for size in (1e-3, 0.5))
    np.testing.assert_array_equal(asked(braked, small), asked(free, small))
    approach = asked(braked, large) - np.asarray(SLEWS.target_rate(10.0 + T))
    np.testing.assert_allclose(approach, np.sqrt(2.0 * BRAKING * 0.5), rtol=1e-12)
    away = asked(braked, state(angles + 0.5, jnp.zeros(3))) - np.asarray(SLEWS.target_rate(10.0 + T))
    np.testing.assert_allclose(away, -approach, rtol=1e-12)


def test_a_rate_command_has_a_derivative_on_the_reference() -> None:
    braked = RateCommand(T, SLEWS, braking=BRAKING)
    slope = jax.jacfwd(lambda x: braked.desired(braked.init(), jnp.asarray(10.0), x)[1])(
        state(SLEWS.angles(10.0 + T), jnp.zeros(3))
    )
    assert np.isfinite(slope).all()


def test_a_turn_beyond_half_a_circle_is_made_the_short_way() -> None:
    command = RateCommand(T, QuinticSlews([[0.0, 0.0, 3.0], [0.0, 0.0, 3.1]]))
    found = asked(command, state(jnp.array([0.0, 0.0, -3.1]), jnp.zeros(3)), t=0.0)
    assert -0.2 < found[2] < 0.0


def test_errors_are_how_far_the_state_is_off() -> None:
    x = jnp.array([1.0, 2.0])
    follow = FollowReference(T, SetPoint([0.5, 0.0], [0.0]))
    np.testing.assert_allclose(follow.error(jnp.asarray(0.0), x), [0.5, 2.0])
    assert follow.desired(None, jnp.asarray(0.0), x)[1].tolist() == [0.5, 0.0]
    t = jnp.asarray(10.0)
    off = state(SLEWS.angles(t) + 1e-3 * jnp.array([1.0, 0.0, 0.0]), jnp.zeros(3))
    # A turn of roll is a turn about the body's x axis.
    np.testing.assert_allclose(RateCommand(T, SLEWS).error(t, off), [1e-3, 0.0, 0.0], atol=1e-12)


def test_rates_of_angles_and_body_rates_agree_along_the_slew() -> None:
    t = 10.0
    np.testing.assert_allclose(
        euler321_rates_inverse(SLEWS.angles(t)) @ SLEWS.angle_rates(t), SLEWS.target_rate(t), rtol=1e-13
    )
    assert pytest.approx(0.0, abs=1e-12) == float(jnp.linalg.norm(SLEWS.target_rate(0.0)))
