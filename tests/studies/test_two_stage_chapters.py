"""The later chapters of the study of two-stage fault estimation on a small budget: isolation, control, slew, limits, cost."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.studies.experiment import Record
from gainful.studies.monte_carlo import run_experiment
from gainful.studies.two_stage_fault_estimation import accuracy, isolation, reconfiguration, signatures, slew
from gainful.studies.two_stage_fault_estimation.scenarios import SCENARIOS

OFFSET, LOSS, GYRO = SCENARIOS
SEED = 12


def once(experiment, *names):
    """One run of some contenders, or of all."""
    chosen = {name: experiment.contenders[name] for name in names} or experiment.contenders
    found = run_experiment(dataclasses.replace(experiment, contenders=chosen, baseline=""), 1, SEED)
    return {name: {what: float(values[0]) for what, values in each.items()} for name, each in found.values.items()}


def decided(truth, *rows, onset=1):
    """What the judge makes of scores of three faults, the first two of one axis, row by row from the onset on."""
    scores = np.zeros((60, 3))
    scores[onset : onset + len(rows)] = rows
    scores[onset + len(rows) :] = rows[-1]
    record = Record(None, {"t": jnp.tile(signatures.FOUND - 0.05 + 0.05 * np.arange(60), (3, 1))})
    ranking = signatures.Ranking(jnp.asarray(scores), jnp.asarray(truth))
    return {name: float(value) for name, value in signatures.Judge(jnp.asarray([0, 0, 1]))(record, ranking).items()}


def test_a_decision_is_made_at_the_first_alarm_and_after_it_and_the_ambiguous_is_not_named():
    quiet, alike, parted = [1.0, 2.0, 0.0], [41.0, 38.0, 5.0], [45.0, 62.0, 5.0]
    found = decided(1, quiet, *[alike] * 10, parted)
    assert found["delay"] == pytest.approx(0.05, abs=1e-9)
    assert (found["group_0"], found["right_0"], found["certain_0"], found["misled_0"]) == (1, 0, 0, 0)
    assert (found["right_0.5"], found["certain_0.5"], found["certain_2"]) == (1, 1, 1)
    assert decided(0, parted)["misled_0"] == 1


def test_an_alarm_before_the_fault_finds_nothing_and_no_alarm_is_never():
    assert decided(0, [90.0, 0.0, 0.0], onset=0)["group_0"] == 0
    assert decided(0, [20.0, 0.0, 0.0])["delay"] == np.inf


def test_the_first_alarm_tells_the_axis_and_two_seconds_of_manoeuvre_the_fault():
    found = once(signatures.experiment(signatures.SIGNATURES, "signatures"))
    assert len(found) == 9
    assert all(each["group_0"] == 1 for each in found.values())
    # An independent implementation: 45 of 72 at once, 69 of 72 after 2 s; one of nine may be the exception.
    assert sum(each["right_2"] for each in found.values()) >= 8
    assert sum(each["misled_0"] for each in found.values()) <= 1
    for name, each in found.items():
        if name.startswith("bias"):
            assert each["delay"] == 0
            assert each["certain_0"] == 1


def test_of_four_wheels_offsets_alternating_in_sign_cannot_be_seen():
    told = isolation.wheels_told_apart().information
    assert told.rank == 3
    direction = np.linalg.eigh(told.gramian)[1][:, 0]
    # Equal priors, so that the Gramian's null vector is that of the wheels' axes; rounding of the largest information.
    assert np.abs(direction * np.sign(direction[0]) - np.array([0.5, -0.5, 0.5, -0.5])).max() < 1e-6


def test_a_controller_that_makes_up_for_the_fault_points_as_if_there_were_none():
    (experiment,) = reconfiguration.chapter().experiments
    named = reconfiguration.named
    names = [
        named(scenario, way) for scenario in SCENARIOS for way in (reconfiguration.RAW, reconfiguration.COMPENSATED)
    ]
    found = {name: each["pointing"] for name, each in once(experiment, *names).items()}
    # Five runs of an independent implementation [deg]; one run scatters by a tenth where noise is all there is.
    for scenario, raw, compensated in ((OFFSET, 1.121, 0.017), (LOSS, 1.709, 0.097), (GYRO, 0.602, 0.016)):
        assert found[named(scenario, reconfiguration.RAW)] == pytest.approx(raw, rel=0.03)
        assert found[named(scenario, reconfiguration.COMPENSATED)] == pytest.approx(compensated, rel=0.4)


def test_a_quaternion_passes_where_angles_lose_the_attitude():
    (experiment,) = slew.chapter().experiments
    found = once(experiment)
    # One flight of an independent implementation: 0.013 deg, 0.0021 N m; the largest of 3000 errors scatters.
    assert found[slew.QUATERNION]["attitude"] == pytest.approx(0.013, rel=0.5)
    assert found[slew.QUATERNION]["fault"] == pytest.approx(0.0021, rel=0.2)
    assert found[slew.ANGLES]["attitude"] > 1.0
    assert found[slew.ANGLES]["fault"] > 10 * found[slew.QUATERNION]["fault"]


@pytest.mark.parametrize(
    ("kind", "together", "after", "sigma"),
    # An independent implementation, to the digits it prints.
    [
        ("offset", ("offset",), 10.0, (4.5e-5, 4.5e-5, 4.5e-5)),
        ("offset", ("offset",), 100.0, (1.1e-5, 1.1e-5, 1.1e-5)),
        ("loss", ("loss",), 1.0, (0.03, 0.013, 0.22)),
        ("loss", ("loss",), 10.0, (0.003, 0.001, 0.012)),
        ("gyro", ("gyro",), 1.0, (0.0078, 0.0078, 0.0078)),
        ("gyro", ("gyro",), 100.0, (1.1e-4, 1.1e-4, 1.1e-4)),
        ("loss", ("offset", "loss"), 10.0, (0.015, 0.007, 0.012)),
    ],
)
def test_the_achievable_accuracy_is_that_of_an_independent_implementation(kind, together, after, sigma):
    assert accuracy.at(accuracy.sigmas(kind, together), after) == pytest.approx(sigma, rel=0.15)


def test_a_fault_is_never_better_known_for_others_that_there_may_be():
    for kind in accuracy.ALL:
        # Both are posterior variances of one Gaussian problem, to the rounding of a root carried through 2000 rows.
        assert (accuracy.sigmas(kind, accuracy.ALL) >= (1 - 1e-6) * accuracy.sigmas(kind, (kind,))).all()


def test_sigma_points_over_the_states_alone_save_operations_and_derivatives_do_not():
    cost = {name: accuracy.step_cost(*accuracy.problem(name, 3)).operations for name in accuracy.FILTERS}
    # 19 points against 13.
    assert 1.2 < cost["augmented UKF"] / cost["TSUKF"] < 19 / 13
    assert 0.8 < cost["augmented EKF"] / cost["TSEKF"] < 1.25
