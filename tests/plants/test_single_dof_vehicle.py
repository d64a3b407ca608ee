"""A vehicle in one degree of freedom: its regressors, its dynamics both ways, and its parameters as states of a filter."""

import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.config.build import build_model
from gainful.config.schema import ModelSection
from gainful.plants import SingleDofVehicle, fourier_excitation, published_vehicle, single_dof_vehicle

COSINES, SINES, PERIOD = (-0.01, 0.12, -0.21, 0.18, 0.65), (-0.07, 0.53, -0.13, -0.37, -0.06), 20.0  # rad/s, rad/s, s
LITERATURE = {
    "benchmark_yaw": (80.0, 50.0, 100.0),
    "benchmark_surge": (215.0, 70.0, 100.0),
    "bluerov2_yaw": (0.28, 0.07, 1.55),
    "bluerov2_surge": (17.0, 4.03, 18.18),
}


@pytest.mark.parametrize("name", LITERATURE)
def test_vehicles_of_the_literature_have_its_numbers(name: str) -> None:
    vehicle = published_vehicle(name)
    np.testing.assert_allclose(vehicle.parameters, LITERATURE[name], rtol=1e-12)
    assert vehicle.units["rate"] == ("rad/s" if name.endswith("yaw") else "m/s")
    assert vehicle.cautions == ()


@pytest.mark.parametrize(("name", "peak"), [("benchmark_yaw", 521.7), ("benchmark_surge", 659.9)])
def test_the_series_of_the_literature_takes_the_published_wrench(name: str, peak: float) -> None:
    _, rate, acceleration = fourier_excitation(COSINES, SINES, PERIOD, jnp.arange(400) * 0.05)
    assert np.abs(published_vehicle(name).wrench(acceleration, rate)).max() == pytest.approx(peak, abs=0.05)


def test_regressors_times_parameters_are_the_wrench_and_its_acceleration_undoes_it(rng: np.random.Generator) -> None:
    vehicle = published_vehicle("bluerov2_surge")
    acceleration, rate = rng.standard_normal((2, 7))
    m, d, d2 = LITERATURE["bluerov2_surge"]
    expected = m * acceleration + d * rate + d2 * rate * np.abs(rate)
    np.testing.assert_allclose(vehicle.wrench(acceleration, rate), expected, rtol=1e-12)
    np.testing.assert_allclose(vehicle.regressor(acceleration, rate) @ vehicle.parameters, expected, rtol=1e-12)
    np.testing.assert_allclose(vehicle.acceleration(rate, expected), acceleration, rtol=1e-11)


def test_a_simulation_comes_to_the_speed_that_drag_allows() -> None:
    vehicle = published_vehicle("bluerov2_surge")
    t = jnp.arange(400) * 0.1
    # Drag of 4.03 + 18.18 N at 1 m/s; the slowest mode there decays with (4.03 + 2 * 18.18) / 17 per s.
    rate = vehicle.simulate(t, jnp.full(400, 22.21))
    assert float(rate[0]) == 0.0
    assert float(rate[-1]) == pytest.approx(1.0, abs=1e-12)


def test_drag_that_pushes_is_told_and_kept() -> None:
    vehicle = SingleDofVehicle(1.0, -2.0, 3.0)
    assert vehicle.cautions == ("linear_drag is -2 N*m*s: drag that pushes",)
    assert float(vehicle.linear_drag) == -2.0


def test_a_filter_finds_the_parameters_of_the_model_in_the_catalogue(tmp_path, rng: np.random.Generator) -> None:
    section = ModelSection(
        catalogue="single_dof_vehicle", arguments={"vehicle": "bluerov2_yaw", "wrench_density": 1e-6}
    )
    model = gf.augment(
        build_model(section, tmp_path), parameters=dict.fromkeys(("inertia", "linear_drag", "quadratic_drag"), 0.0)
    )
    assert model.space.names == ("rate", "inertia", "linear_drag", "quadratic_drag")
    vehicle, t = published_vehicle("bluerov2_yaw"), np.arange(800) * 0.05
    _, rate, acceleration = fourier_excitation(0.5 * np.array(COSINES), 0.5 * np.array(SINES), 8.0, t - 0.025)
    wrench = np.asarray(vehicle.wrench(acceleration, rate))
    truth = np.asarray(vehicle.simulate(t, wrench))
    log = gf.make_log(model, t, truth + 0.01 * rng.standard_normal(800), wrench)
    start = np.array([0.0, 0.35, 0.15, 1.2])
    prior = gf.make_prior(model, start, [0.01, 0.1, 0.1, 0.5])
    estimate = gf.run(gf.unscented_kalman_filter(), model, prior, log).estimates
    error = np.asarray(estimate.mean[-1, 1:]) - np.asarray(vehicle.parameters)
    spread = np.sqrt(np.diagonal(np.asarray(estimate.cov[-1])))[1:]
    # Four sigma once in 16000 normal numbers; each must have learned something.
    assert np.all(np.abs(error) < 4.0 * spread)
    assert np.all(spread < [0.01, 0.05, 0.1])


def test_the_model_names_rates_and_wrenches_after_its_motion() -> None:
    surge = single_dof_vehicle(published_vehicle("benchmark_surge"))
    assert (surge.space.units, surge.input_units) == (("m/s",), ("N",))
