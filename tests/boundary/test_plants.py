"""Messages of plants, excitations, tracks and disturbances: the argument, what was expected, what came."""

import jax
import jax.numpy as jnp
import pytest

from gainful.errors import ConfigError, ModelError, ShapeError
from gainful.faults import Bias, parameter_tracks, reflected_walk
from gainful.plants import drive_servo, hydraulic_servo, hydraulic_servo_reduced, multisine, prbs, staircase
from gainful.running import GaussianMixture, ImpulseBursts, SkewedOutliers, StudentTNoise

KEY = jax.random.key(0)


def drive(voltage=(1.0, 1.0), parameters=None, **options):
    return drive_servo(voltage, parameters, key=KEY, **options)


ATTEMPTS = [
    (lambda: GaussianMixture(1.0), ConfigError, "probability: expected a number from 0 to below 1, got 1.0"),
    (lambda: SkewedOutliers(-0.1), ConfigError, "probability: expected a number from 0 to below 1, got -0.1"),
    (lambda: GaussianMixture(0.1, 0.0), ConfigError, "ratio: expected a number above 0, got 0.0"),
    (lambda: StudentTNoise(0), ConfigError, "dof: expected a number above 0, got 0"),
    (
        lambda: ImpulseBursts(length=2.5),
        ConfigError,
        "length: expected a whole number of samples of at least 1, got 2.5",
    ),
    (lambda: prbs(9, taps=(5, 3)), ConfigError, "taps: expected stages from 1 to 9 with the last among them, got"),
    (lambda: prbs(9, taps=(9, 0)), ConfigError, "taps: expected stages from 1 to 9 with the last among them, got"),
    (lambda: prbs(9, clock=0), ConfigError, "clock: expected a whole number of samples of at least 1, got 0"),
    (lambda: multisine(jnp.arange(3.0), []), ConfigError, "frequencies: expected at least one, got none"),
    (
        lambda: staircase(jnp.arange(3.0), [2.0, 1.0], [0.0, 1.0]),
        ConfigError,
        "times: expected one rising time per level, got [2.0, 1.0] for [0.0, 1.0]",
    ),
    (lambda: staircase(jnp.arange(3.0), [1.0], []), ConfigError, "times: expected one rising time per level, got"),
    (
        lambda: reflected_walk(KEY, 3, 0.1, lower=1.0, upper=0.5),
        ConfigError,
        "bounds: expected lower < upper, got 1.0 and 0.5",
    ),
    (
        lambda: parameter_tracks(jnp.arange(3.0), {"p1": 1.0}, [Bias("p2", 1.0)]),
        ConfigError,
        "faults: 'p2' is not a signal; known: p1",
    ),
    (lambda: hydraulic_servo({"mas": 1.0}), ModelError, "numbers: 'mas' is not one of the axis; did you mean 'mass'?"),
    (
        lambda: hydraulic_servo_reduced(sensors=["positon"]),
        ModelError,
        "sensors: 'positon' is not one of the axis; did you mean 'position'?",
    ),
    (
        lambda: hydraulic_servo_reduced(process_sigmas=(1.0, 1.0)),
        ModelError,
        "process_sigmas: expected 3 numbers, one per state, got shape (2,)",
    ),
    (lambda: drive([[1.0]]), ShapeError, "voltage: expected a vector, got shape (1, 1)"),
    (lambda: drive(parameters=jnp.ones(2)), ShapeError, "parameters: expected shape (2, 2), got (2,)"),
    (lambda: drive(plant="ful"), ModelError, "plant: 'ful' is not one; did you mean 'full'?"),
]


@pytest.mark.parametrize(("attempt", "error", "message"), ATTEMPTS)
def test_a_message_of_a_plant_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
