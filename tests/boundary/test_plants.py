"""Messages of plants, excitations, tracks and disturbances: the argument, what was expected, what came."""

import jax
import jax.numpy as jnp
import pytest

from gainful.errors import ConfigError, ModelError, NumericalError, ShapeError
from gainful.faults import Bias, parameter_tracks, reflected_walk
from gainful.plants import (
    TRACK_SCENARIOS,
    MarineVehicle,
    SingleDofVehicle,
    VehicleStructure,
    bluerov2,
    design_excitation,
    drive_servo,
    drive_vehicle,
    gravity_direction,
    hydraulic_servo,
    hydraulic_servo_reduced,
    land_vehicle,
    multisine,
    prbs,
    run_track,
    single_dof_vehicle,
    staircase,
    track,
    vehicle_rows,
    weak_vehicle_rows,
)
from gainful.running import GaussianMixture, ImpulseBursts, SkewedOutliers, StudentTNoise

KEY = jax.random.key(0)


def drive(voltage=(1.0, 1.0), parameters=None, **options):
    return drive_servo(voltage, parameters, key=KEY, **options)


def marine(mass=(1.0,) * 6, drag=(1.0,) * 6, weight=1.0, r_g=(0.0, 0.0, 0.0), **options):
    return MarineVehicle(mass, drag, (1.0,) * 6, weight, 1.0, r_g, **options)


def columns(q, rate, acceleration):
    return jnp.stack([acceleration, rate], axis=-1)


def alike(q, rate, acceleration):
    return jnp.stack([rate, 2.0 * rate], axis=-1)


def design(limits=None, regressor=columns, **options):
    options = {"period": 10.0, "harmonics": 2, "starts": 1} | options
    return design_excitation(regressor, {"rate": 1.0} if limits is None else limits, **options)


STILL = jnp.zeros((20, 6))
VEHICLES = [
    (lambda: SingleDofVehicle(0.0, 1.0, 1.0), ModelError, "inertia: expected a number above 0, got 0.0"),
    (
        lambda: single_dof_vehicle("bluerov2_yax"),
        ModelError,
        "vehicle: 'bluerov2_yax' is not known; did you mean 'bluerov2_yaw'?",
    ),
    (
        lambda: SingleDofVehicle(1.0, 1.0, 1.0).simulate(jnp.arange(3.0), jnp.zeros(2)),
        ShapeError,
        "wrench: expected one number per time, shape (3,), got (2,)",
    ),
    (
        lambda: VehicleStructure(mass="simetric"),  # type: ignore[arg-type]
        ConfigError,
        "mass: 'simetric' is not known; did you mean 'symmetric'?",
    ),
    (
        lambda: VehicleStructure(drag="lever"),  # type: ignore[arg-type]
        ConfigError,
        "drag: 'lever' is not known; known: diagonal, full, symmetric",
    ),
    (
        lambda: VehicleStructure(levers=("x", "x")),
        ConfigError,
        "levers: expected any of x, y, z, each once, got ('x', 'x')",
    ),
    (
        lambda: VehicleStructure(offsets=("surg",)),
        ConfigError,
        "offsets: expected any of surge, sway, heave, roll, pitch, yaw, each once, got ('surg',)",
    ),
    (lambda: VehicleStructure().numbers(jnp.zeros(20)), ShapeError, "parameters: expected 21, got shape (20,)"),
    (
        lambda: gravity_direction(jnp.zeros(5)),
        ShapeError,
        "attitude: expected roll and pitch, with or without yaw, or a quaternion, got 5 numbers",
    ),
    (lambda: marine((1.0,) * 5), ShapeError, "mass_matrix: expected shape (6, 6), got (5, 5)"),
    (lambda: marine(weight=[1.0, 2.0]), ShapeError, "weight: expected shape (), got (2,)"),
    (
        lambda: marine(jnp.eye(6).at[0, 1].set(0.1)),
        ModelError,
        "mass_matrix: expected a symmetric matrix",
    ),
    (
        lambda: marine(jnp.eye(6).at[0, 2].set(0.1).at[2, 0].set(0.1)),
        ModelError,
        "structure: has no parameter for mass_matrix[0, 2] = 0.1, got VehicleStructure(mass='lever'",
    ),
    (
        lambda: marine(r_g=(0.5, 0.0, 0.0)),
        ModelError,
        "structure: has no parameter for lever[0] = 0.5, got VehicleStructure",
    ),
    (
        lambda: bluerov2().simulate(jnp.arange(3.0), jnp.zeros((2, 6))),
        ShapeError,
        "wrench: expected shape (3, 6), one row per time, got (2, 6)",
    ),
    (
        lambda: bluerov2().simulate(jnp.arange(3.0), jnp.zeros((3, 6)), nu=jnp.zeros(3)),
        ShapeError,
        "nu: expected shape (6,), got (3,)",
    ),
    (
        lambda: bluerov2().simulate(jnp.arange(3.0), jnp.zeros((3, 6)), attitude=jnp.zeros(2)),
        ShapeError,
        "attitude: expected roll, pitch and yaw, or a quaternion, got shape (2,)",
    ),
    (
        lambda: vehicle_rows(VehicleStructure(), STILL[:, :5], STILL[:, :2], STILL, 0.1),
        ShapeError,
        "nu: expected shape (times, 6), got (20, 5)",
    ),
    (
        lambda: weak_vehicle_rows(VehicleStructure(), STILL, STILL[:, :2], STILL[:19], 0.1),
        ShapeError,
        "wrench: expected shape (20, 6), as the velocities, got (19, 6)",
    ),
    (
        lambda: weak_vehicle_rows(VehicleStructure(), STILL, STILL[:19, :2], STILL, 0.1),
        ShapeError,
        "attitude: expected 20 rows, as the velocities have, got shape (19, 2)",
    ),
]

DESIGNS = [
    (lambda: design({}), ConfigError, "limits: expected at least one, got none"),
    (lambda: design({"rates": 1.0}), ConfigError, "limits: 'rates' is not known; did you mean 'rate'?"),
    (lambda: design({"rate": 0.0}), ConfigError, "limits: expected a rate above 0, got 0.0"),
    (lambda: design({"wrench": 1.0}), ConfigError, "parameters: missing; a limit of the wrench needs them"),
    (lambda: design(harmonics=0), ConfigError, "harmonics: expected a whole number of at least 1, got 0"),
    (lambda: design(period=0.0), ConfigError, "period: expected a time above 0 s, got 0.0"),
    (lambda: design(starts=0), ConfigError, "starts: expected a whole number of at least 1, got 0"),
    (
        lambda: design(objective="determinant"),
        ConfigError,
        "objective: 'determinant' is not known; did you mean 'log_determinant'?",
    ),
    (
        lambda: design(parameters=[1.0]),
        ShapeError,
        "parameters: expected 2, one per column of the regressor, got shape (1,)",
    ),
    (lambda: design(scales=[1.0]), ShapeError, "scales: expected 2, one per column of the regressor, got shape (1,)"),
    (
        lambda: design(
            {"wrench": 1.0}, lambda q, rate, _: jnp.stack([rate, jnp.cos(q)], axis=-1), parameters=[1.0, 2.0]
        ),
        ConfigError,
        "limits: expected a wrench above the one at rest, got a smaller one",
    ),
    (
        lambda: design(
            {"wrench": 1.0}, lambda q, rate, _: 0.1 * jnp.sin(jnp.stack([q, rate], -1)), parameters=[1.0, 2.0]
        ),
        ConfigError,
        "limits: expected a rate or an acceleration too, as the wrench never reaches its limit",
    ),
    (
        lambda: design(regressor=alike),
        NumericalError,
        "regressor: no start shows all parameters; are two columns always alike, or one always 0?",
    ),
]

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
    (lambda: track(fix_sigma=-1.0), ModelError, "fix_sigma: expected a standard deviation of at least 0, got -1.0"),
    (
        lambda: run_track(TRACK_SCENARIOS["matched"], key=KEY, rows=0),
        ConfigError,
        "rows: expected at least 1, got 0",
    ),
    (lambda: land_vehicle(gnss_sigmas=(1.0,)), ModelError, "gnss_sigmas: expected 2 numbers, got 1"),
    (lambda: drive_vehicle(key=KEY, duration=0.5), ConfigError, "duration: expected at least 1 s, got 0.5"),
]


@pytest.mark.parametrize(("attempt", "error", "message"), [*ATTEMPTS, *VEHICLES, *DESIGNS])
def test_a_message_of_a_plant_names_the_argument_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
