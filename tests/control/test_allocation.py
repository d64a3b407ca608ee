"""Wheels together give the torque asked for, those at fault included."""

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import Adjustment, allocate_torque
from gainful.plants import orthogonal_axes, pyramid_axes

EXACT = 1e-15  # N m: a few roundings of torques of 0.1 N m


@pytest.fixture
def torque(rng: np.random.Generator) -> jnp.ndarray:
    return jnp.asarray(0.05 * rng.normal(size=3))  # N m


def adjustment(wheels: int = 4, **known: list[float]) -> Adjustment:
    none = Adjustment.none(wheels)
    given = {name: jnp.asarray(values) for name, values in known.items()}
    return Adjustment(
        **{name: given.get(name, getattr(none, name)) for name in ("offset", "loss", "active", "gyro_bias")}
    )


def achieved(axes: jnp.ndarray, command: jnp.ndarray, known: Adjustment) -> np.ndarray:
    """What wheels with these faults do to the body; an idle wheel still adds its offset."""
    return np.asarray(axes @ ((1.0 - known.loss) * command + known.offset))


def test_a_pyramid_gives_the_torque_with_the_least_effort(torque: jnp.ndarray) -> None:
    axes = pyramid_axes()
    command = allocate_torque(axes, torque)
    np.testing.assert_allclose(axes @ command, torque, atol=EXACT)
    null = jnp.array([1.0, -1.0, 1.0, -1.0])
    assert abs(float(null @ command)) < EXACT  # nothing along what does nothing


@pytest.mark.parametrize("dead", range(4))
def test_three_wheels_of_a_pyramid_do_without_the_fourth(dead: int, torque: jnp.ndarray) -> None:
    axes = pyramid_axes()
    active = np.ones(4)
    active[dead] = 0.0
    known = adjustment(active=active)
    command = allocate_torque(axes, torque, known)
    assert float(command[dead]) == 0.0
    np.testing.assert_allclose(axes @ command, torque, atol=4 * EXACT)


def test_known_offsets_and_losses_are_made_up_for(torque: jnp.ndarray) -> None:
    known = adjustment(offset=[0.03, 0.0, -0.01, 0.0], loss=[0.0, 0.5, 0.2, -0.3])
    for axes, faults in (
        (pyramid_axes(), known),
        (orthogonal_axes(), adjustment(3, offset=[0.03, 0.0, -0.01], loss=[0.0, 0.5, 0.2])),
    ):
        command = allocate_torque(axes, torque, faults)
        np.testing.assert_allclose(achieved(axes, command, faults), torque, atol=4 * EXACT)


def test_what_an_idle_wheel_adds_of_itself_is_carried_by_the_others(torque: jnp.ndarray) -> None:
    axes, known = pyramid_axes(), adjustment(offset=[0.0, 0.02, 0.0, 0.0], active=[1.0, 0.0, 1.0, 1.0])
    command = allocate_torque(axes, torque, known)
    assert float(command[1]) == 0.0
    np.testing.assert_allclose(achieved(axes, command, known), torque, atol=4 * EXACT)


def test_a_wheel_taken_for_dead_is_not_asked_for_more_than_ten_times_its_share() -> None:
    torque = jnp.array([0.01, 0.0, 0.0])
    command = allocate_torque(orthogonal_axes(), torque, adjustment(3, loss=[1.0, 0.0, 0.0]))
    np.testing.assert_allclose(command, [0.1, 0.0, 0.0], atol=EXACT)


def test_without_a_wheel_the_nearest_torque_is_given(torque: jnp.ndarray) -> None:
    command = allocate_torque(orthogonal_axes(), torque, adjustment(3, active=[1.0, 0.0, 1.0]))
    np.testing.assert_allclose(command, torque * jnp.array([1.0, 0.0, 1.0]), atol=EXACT)
