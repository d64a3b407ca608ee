"""A plant that becomes another one in the course of a run."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import SetPoint, StateFeedback
from gainful.errors import ConfigError
from gainful.plants import ChangingPlant, FlexibleSpacecraft, FlexibleStructure, RigidSpacecraft
from gainful.running import simulate
from gainful.running.loop import Rates

RATES = Rates(step=0.1, measure=1, control=1)
LIGHT = FlexibleStructure(inertia=[1500.0, 700.0, 1200.0], coupling=[70.0, 5.0, 40.0])
PUSH = StateFeedback(np.zeros((3, 13)), SetPoint(np.zeros(13), np.array([3.0, -1.0, 2.0])))


@jax.jit
def flown(plant: ChangingPlant) -> jax.Array:
    return simulate(plant, PUSH, key=jax.random.key(3), duration=4.0, rates=RATES).truth


def test_the_plant_is_the_one_before_until_it_changes_and_then_the_one_after() -> None:
    heavy, light = FlexibleSpacecraft(), FlexibleSpacecraft(LIGHT)
    never, always = (flown(ChangingPlant(heavy, light, jnp.asarray(time))) for time in (jnp.inf, 0.0))
    changed = flown(ChangingPlant(heavy, light, jnp.asarray(2.0)))
    alone = flown(ChangingPlant(light, light, jnp.asarray(1.0)))
    np.testing.assert_array_equal(changed[:21], never[:21])
    np.testing.assert_array_equal(always, alone)
    # A constant torque on half the inertia: twice the acceleration from then on, but for the panel.
    gained = changed[-1, 7:10] - changed[20, 7:10]
    kept = never[-1, 7:10] - never[20, 7:10]
    assert np.all(gained / kept > 1.6)


def test_plants_of_different_kinds_do_not_become_each_other() -> None:
    with pytest.raises(
        ConfigError,
        match="after: expected a plant like before in all but its numbers, got FlexibleSpacecraft and RigidSpacecraft",
    ):
        ChangingPlant(FlexibleSpacecraft(), RigidSpacecraft())
