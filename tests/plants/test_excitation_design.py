"""A designed excitation shows more than drawn ones do, and keeps its limits between the samples too."""

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.plants import SingleDofVehicle, design_excitation, fourier_excitation, published_vehicle

LIMITS = {"rate": 2.022, "acceleration": 1.864, "wrench": 521.7}  # rad/s, rad/s^2, N m: peaks of the published series
YAW = published_vehicle("benchmark_yaw")
PERIOD = 20.0  # s


def regressor(q, rate, acceleration):
    return SingleDofVehicle.regressor(acceleration, rate)


def densely(a, b, samples=100_003):
    """Rate, acceleration and wrench at many times of a period, none of them a sample of the design."""
    t = jnp.linspace(0.0, PERIOD, samples)
    _, rate, acceleration = fourier_excitation(a, b, PERIOD, t)
    return {"rate": rate, "acceleration": acceleration, "wrench": YAW.wrench(acceleration, rate)}


def smallest_eigenvalue(a, b):
    _, rate, acceleration = fourier_excitation(a, b, PERIOD, jnp.arange(2000) * (PERIOD / 2000))
    H = np.asarray(SingleDofVehicle.regressor(acceleration, rate))
    return np.linalg.eigvalsh(H.T @ H / len(H))[0]


@pytest.fixture(scope="module")
def design():
    return design_excitation(regressor, LIMITS, period=PERIOD, parameters=YAW.parameters, starts=6)


def test_a_design_keeps_its_limits_at_every_time_and_reaches_one(design) -> None:
    most = {name: float(np.abs(x).max()) for name, x in densely(design.a, design.b).items()}
    assert all(most[name] <= limit for name, limit in LIMITS.items())
    # Peaks that lie between the dense samples are above those by less than 1e-8 of them.
    assert {name: design.peaks[name] for name in LIMITS} == pytest.approx(most, rel=1e-8)
    assert design.active
    assert all(most[name] == pytest.approx(LIMITS[name], rel=1e-3) for name in design.active)


def test_a_design_shows_more_than_the_best_of_many_draws_under_the_same_limits(
    design, rng: np.random.Generator
) -> None:
    drawn = []
    for a, b in rng.standard_normal((100, 2, 5)):
        found = {name: np.asarray(x) for name, x in densely(a, b, 500).items()}
        rate, acceleration = found["rate"], found["acceleration"]
        low, high = 0.0, 10.0
        for _ in range(30):
            factor = 0.5 * (low + high)
            wrench = 80.0 * factor * acceleration + 50.0 * factor * rate + 100.0 * factor**2 * rate * np.abs(rate)
            scaled = {"rate": factor * rate, "acceleration": factor * acceleration, "wrench": wrench}
            within = all(np.abs(scaled[name]).max() <= limit for name, limit in LIMITS.items())
            low, high = (factor, high) if within else (low, factor)
        drawn.append(smallest_eigenvalue(low * a, low * b))
    assert smallest_eigenvalue(design.a, design.b) > max(drawn)
    # The published series is the best of 3000 draws.
    published = 0.07832
    assert design.smallest_eigenvalue > 1.02 * published
    # Its samples are a 24th of the fastest period apart, where the slope of r|r| has kinks.
    assert design.smallest_eigenvalue == pytest.approx(smallest_eigenvalue(design.a, design.b), rel=1e-3)
    assert list(design.starts) == sorted(design.starts, reverse=True)
    assert design.starts[0] == pytest.approx(design.smallest_eigenvalue, rel=1e-9)


def test_each_objective_is_best_at_its_own(design) -> None:
    other = design_excitation(
        regressor, LIMITS, period=PERIOD, parameters=YAW.parameters, starts=6, objective="log_determinant"
    )
    assert other.log_determinant > design.log_determinant
    assert other.smallest_eigenvalue < design.smallest_eigenvalue


def test_any_regressor_and_the_position_may_be_limited_and_a_seed_gives_the_same_again() -> None:
    def pendulum(q, rate, acceleration):
        return jnp.stack([acceleration, rate, jnp.sin(q)], axis=-1)

    limits = {"position": 0.5, "wrench": 3.0}
    given = {"period": 10.0, "harmonics": 3, "parameters": [1.0, 0.1, 2.0], "scales": [1.0, 0.1, 2.0], "starts": 2}
    found = design_excitation(pendulum, limits, **given)
    np.testing.assert_array_equal(found.a, design_excitation(pendulum, limits, **given).a)
    t = jnp.linspace(0.0, 10.0, 20_001)
    motion = fourier_excitation(found.a, found.b, 10.0, t)
    assert np.abs(motion[0]).max() <= 0.5
    assert np.abs(pendulum(*motion) @ jnp.array([1.0, 0.1, 2.0])).max() <= 3.0
    assert set(found.active) & set(limits)
