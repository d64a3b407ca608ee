"""Networks that predict a signal: what they are told, how they run by themselves, and what they are held against."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.identification import (
    LaggedModel,
    Lags,
    NetworkRecipe,
    Recording,
    free_run_of,
    identify_network,
    linear_equation,
)
from gainful.networks import AffineMap, SummedNetwork
from gainful.regression import KalmanTraining

LAGS = Lags("y", 2, {"u": 2, "w": 1}, delay=1)


def record(length: int = 400, curved: float = 0.3) -> Recording:
    rng = np.random.default_rng(7)
    u, w, y = rng.normal(size=length), rng.normal(size=length), np.zeros(length)
    for k in range(2, length):
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + 0.5 * u[k - 1] + 0.2 * u[k - 2] - 0.1 * w[k - 1]
        y[k] += curved * np.tanh(u[k - 1]) * np.tanh(y[k - 1])
    return Recording(np.arange(float(length)), {"y": y, "u": u, "w": w})


def test_what_a_network_is_told_is_in_the_order_of_its_names() -> None:
    signals = {name: np.arange(6.0) + start for name, start in (("y", 0.0), ("u", 100.0), ("w", 200.0))}
    assert LAGS.names == ("lag(u)", "lag(u, 2)", "lag(w)", "lag(y)", "lag(y, 2)")
    assert (LAGS.depth, LAGS.signals) == (2, ("y", "u", "w"))
    rows = LAGS.rows(signals)
    assert np.isnan(rows[:2]).any(axis=1).all()
    np.testing.assert_array_equal(rows[3], [102.0, 101.0, 202.0, 2.0, 1.0])


@pytest.mark.parametrize("form", ["increment", "absolute"])
def test_an_affine_network_is_the_linear_equation(form: str) -> None:
    signals = record(60).mean()
    theta = np.array([0.5, 0.2, -0.1, 1.2, -0.5])
    own = theta - np.array([0.0, 0.0, 0.0, 1.0, 0.0]) * (form == "increment")
    model = LaggedModel(AffineMap(jnp.asarray(own[None]), jnp.zeros(1)), jnp.ones(()), LAGS, form)
    equation = linear_equation(LAGS)
    rows = LAGS.rows(signals)
    np.testing.assert_allclose(model.one_step(signals), rows @ theta, rtol=1e-12, atol=1e-12)
    run = free_run_of(equation, "y")
    assert run is not None
    here, there = model.free_run(signals), run(theta, signals, 1.0)
    # The equation starts one depth later; what it starts from is forgotten at 0.7 per row.
    np.testing.assert_allclose(here[50:], there[50:], rtol=0, atol=1e-5)
    np.testing.assert_array_equal(here[:2], signals["y"][:2])


def test_least_squares_finds_the_equation_that_made_the_rows() -> None:
    whole = record(curved=0.0)
    found = identify_network(LAGS, whole.part(0, 300), NetworkRecipe("affine"))
    slopes = jax.jacfwd(found.model)(jnp.zeros(5))
    # Ridge: r / (lambda N) = 3e-9 of weights near 1, in units of the increment's spread.
    np.testing.assert_allclose(slopes, [0.5, 0.2, -0.1, 1.2, -0.5], rtol=0, atol=1e-6)
    assert found.check(whole.part(300, 400)).simulated_share > 1 - 1e-9
    assert found.cautions == ()
    assert found.adapted(whole) is None
    assert set(found.linear_checks(whole)) == {"ls", "tls"}
    assert found.linear_checks(whole)["ls"].signal == "y"


def test_networks_tell_what_the_linear_equation_cannot() -> None:
    whole = record()
    kept = whole.part(300, 400)
    recipes = {
        "rbf": NetworkRecipe("rbf", noise_variance=1e-4),
        "mlp": NetworkRecipe("mlp", training=KalmanTraining((4,), noise_variance=1e-2)),
        "bilinear": NetworkRecipe("bilinear", noise_variance=1e-4),
    }
    for kind, recipe in recipes.items():
        found = identify_network(LAGS, whole.part(0, 300), recipe)
        line = found.linear_checks(kept)["ls"]
        check = found.check(kept)
        assert check.residual < 0.75 * line.residual, kind
        assert check.fit > line.fit
        assert check.simulation_error < line.simulation_error
        assert isinstance(found.model.network, SummedNetwork) == (kind == "mlp")


def test_weights_that_walk_are_followed_on_rows_kept_back_too() -> None:
    length = 900
    rng = np.random.default_rng(3)
    u, y, gain = rng.normal(size=length), np.zeros(length), np.linspace(0.5, 2.0, length)
    for k in range(1, length):
        y[k] = 0.5 * y[k - 1] + gain[k] * u[k]
    whole = Recording(np.arange(float(length)), {"y": y, "u": u})
    recipe = NetworkRecipe("affine", random_walk=1e-4)
    found = identify_network(Lags("y", 1, {"u": 1}), whole.part(0, 600), recipe)
    frozen, adapted = found.check(whole.part(600, 900)), found.adapted(whole.part(600, 900))
    assert adapted is not None
    assert adapted.residual < 0.2 * frozen.residual
    forgetting = identify_network(Lags("y", 1, {"u": 1}), whole, NetworkRecipe("affine", forgetting=0.95))
    assert float(jax.jacfwd(forgetting.model)(jnp.zeros(2))[0]) == pytest.approx(2.0, abs=0.1)


def test_missing_samples_are_left_out_and_the_run_takes_the_longest_stretch() -> None:
    whole = record()
    signals = whole.mean()
    signals["u"][120] = np.nan
    holed = Recording(whole.t, signals)
    found = identify_network(LAGS, holed, NetworkRecipe("affine"))
    assert found.rows == 400 - 2 - 2
    run = found.check(holed).simulated
    assert np.isnan(run[:121]).all()
    assert np.isfinite(run[123:]).all()


def test_rows_outside_of_what_was_trained_on_are_counted_and_few_rows_said() -> None:
    whole = record(60)
    found = identify_network(LAGS, whole, NetworkRecipe("bilinear", centres=0))
    far = Recording(whole.t, {name: 100.0 * each for name, each in whole.values.items()})
    assert found.outside(whole) == 0.0
    assert found.outside(far) > 0.9
    few = identify_network(LAGS, record(14), NetworkRecipe("bilinear"))
    assert "16 weights from 12 rows: the prior tells what the rows do not" in few.cautions
