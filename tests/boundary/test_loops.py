"""Messages of plants, controllers and closed loops."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.control import EstimatedFaults, Reading
from gainful.errors import ConfigError, ModelError, ShapeError
from gainful.plants import RigidSpacecraft, Wheels, fly, rigid_spacecraft, spacecraft_model, tracking_controller
from gainful.running import Observer, Rates

from .problems import walk


def reading():
    return Reading(jnp.zeros(6), jnp.zeros(3), None)


def act(**options):
    return tracking_controller(RigidSpacecraft(), **options).act(None, jnp.zeros(()), reading())


def observed(model):
    prior = gf.make_prior(model, np.zeros(model.space.size), np.ones(model.space.dof))
    return fly(key=jax.random.key(0), duration=0.0, observer=Observer(gf.kalman_filter(), model, prior))


def told_less():
    """A model of the spacecraft's readings that knows of one input only."""
    full = spacecraft_model(RigidSpacecraft())
    sensors = list(full.sensor_parts)
    return gf.discrete_model(
        lambda x, u, t: x, states=full.space, inputs={"torque": "N*m"}, Q=0.1 * np.ones(6), sensors=sensors
    )


faults = EstimatedFaults.named(["a", "b"], 3)

LOOPS = [
    (lambda: Rates(step=0.0), ConfigError, "step: expected a time above 0 s, got 0.0"),
    (lambda: Rates(measure=0), ConfigError, "measure: expected a whole number of steps of at least 1, got 0"),
    (lambda: Rates(control=2.5), ConfigError, "control: expected a whole number of steps of at least 1, got 2.5"),
    (
        lambda: fly(key=jax.random.key(0), duration=0.12),
        ConfigError,
        "duration: expected a whole number of readings of 0.05 s, got 0.12 s",
    ),
    (lambda: fly(key=jax.random.key(0), duration=-1.0), ConfigError, "duration: expected a whole number of readings"),
    (
        lambda: observed(walk()),
        ShapeError,
        "observer: expected a model of the readings gyro_x, gyro_y, gyro_z, star_phi",
    ),
    (lambda: observed(told_less()), ShapeError, "observer: expected a model of 6 inputs, got 1"),
    (lambda: act(feedback="guess"), ConfigError, "feedback: expected one of readings, estimate, got 'guess'"),
    (
        lambda: act(feedback="estimate"),
        ConfigError,
        "feedback: expected an estimator in the loop for 'estimate', got none",
    ),
    (lambda: act(reconfigure=faults), ModelError, "reconfigure: expected an estimator in the loop, got none"),
    (
        lambda: EstimatedFaults.named(["bias"], 3, offset={"bia": (0, 1.0)}),
        ModelError,
        "state 'bia' is not one of the model's; did you mean 'bias'?",
    ),
    (
        lambda: EstimatedFaults.named(["bias"], 3, loss={"bias": (3, 1.0)}),
        ModelError,
        "state 'bias': expected a wheel or axis from 0 to 2, got 3",
    ),
    (lambda: rigid_spacecraft("targt"), ModelError, "attitude: 'targt' is not known; did you mean 'target'?"),
    (
        lambda: spacecraft_model(RigidSpacecraft(), step="eulr"),
        ModelError,
        "step: 'eulr' is not known; did you mean 'euler'?",
    ),
    (lambda: RigidSpacecraft([1.0, 2.0]), ShapeError, "inertia: expected shape (3,) or (3, 3), got (2,)"),
    (lambda: RigidSpacecraft(start_error=0.1), ShapeError, "start_error: expected 3 angles, got shape ()"),
    (lambda: Wheels(np.eye(4)), ShapeError, "axes: expected shape (3, wheels), got (4, 4)"),
    (lambda: Wheels(max_torque=[0.1, 0.2]), ShapeError, "max_torque: expected one number or 3, got shape (2,)"),
    (lambda: Wheels(max_momentum=np.eye(3)), ShapeError, "max_momentum: expected one number or 3, got shape (3, 3)"),
]


@pytest.mark.parametrize(("attempt", "error", "message"), LOOPS)
def test_a_message_of_a_loop_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
