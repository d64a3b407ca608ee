"""The vehicle in six degrees of freedom on one run: who finds its parameters, and what single equations make of its motion."""

import dataclasses

import numpy as np
import pytest

from gainful.studies.monte_carlo import run_experiment
from gainful.studies.total_least_squares_fusion import vehicle
from gainful.studies.total_least_squares_fusion.vehicle_contenders import ISOTROPIC, PLAIN, SINGLE, WEAK, WEAK_CROSS

LOUD, CLEAN = (vehicle.chapter().experiments[k] for k in (1, 2))


def test_without_noise_six_equations_find_everything_and_single_ones_mistake_it() -> None:
    found = run_experiment(CLEAN, 1, 0).values
    # The information's condition is 60^2, which costs 1e-12; the bound leaves room and is far below any other error.
    assert all(found[vehicle.COUPLED][group][0] < 1e-6 for group in vehicle.GROUPS)
    single = found[SINGLE]
    published = {"surge_m": 11.7, "surge_d": 26.7, "surge_d2": -14.4, "surge_told": 0.75, "yaw_told": 0.42}
    assert {name: single[name][0] for name in published} == pytest.approx(published, abs=0.06)
    assert np.isnan(single["lever"][0])


def test_with_noise_neither_differences_nor_isotropy_find_what_the_weak_form_does() -> None:
    chosen = {name: LOUD.contenders[name] for name in (PLAIN, ISOTROPIC, WEAK, WEAK_CROSS)}
    found = run_experiment(dataclasses.replace(LOUD, contenders=chosen), 1, 0).values
    mass, drag = ({name: found[name][group][0] for name in chosen} for group in ("mass", "quadratic"))
    # Over runs these scatter by some per cent (differences) to a half (weak) of what they are: 78, 5 and 1 %.
    assert mass[PLAIN] == pytest.approx(78.0, abs=5.0)
    assert mass[WEAK] == pytest.approx(5.0, abs=2.5)
    assert mass[WEAK_CROSS] < mass[WEAK]
    assert drag[ISOTROPIC] > 50.0 * drag[PLAIN]
