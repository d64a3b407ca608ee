"""Parameters of equations: found exactly where there is no noise, honestly where there is."""

import numpy as np
import pytest

from gainful.errors import ConfigError, Status
from gainful.identification import METHODS, RECURSIVE, Recording, identify, parse_equation

from .problems import DT, ROWS, TERMS, THETA, equation, motion, recording

NOISY = {"rate": 0.04, "torque": 0.05}


@pytest.fixture(scope="module")
def noisy(generator):
    return recording(generator("noisy yaw"), **NOISY)


@pytest.mark.parametrize("method", ["ls", "weak-ls", "iv", "weak-iv"])
def test_parameters_without_noise_are_found(method) -> None:
    rate, torque = motion()
    found = identify(equation(), Recording(DT * np.arange(ROWS), {"r": rate, "tau": torque}), method)
    # Differences and test functions bend a motion of up to 5 harmonics in 8 s: (w dt)^4 / 30, and (w W dt)^2 / 100 for the
    # square of a filtered rate against the filtered square.
    np.testing.assert_allclose(found.theta, THETA, rtol=3e-2, atol=5e-3)
    assert found.status == Status.ok


@pytest.mark.parametrize("method", ["weak-iv", "weak-gtls", "weak-bcls", "iv", "gtls", "bcls", "rtls"])
def test_intervals_hold_the_truth_where_regressors_are_noisy(noisy, method) -> None:
    found = identify(equation(), noisy, method)
    assert (np.abs(found.theta - THETA) < 4 * found.std).all()
    assert (found.std < [0.02, 0.1, 0.2]).all()


def test_least_squares_is_pulled_and_says_so(noisy) -> None:
    found = identify(equation(), noisy, "ls")
    assert found.theta[0] < 0.9 * THETA[0]
    assert any("noise in the regressors pulls least squares: mass by about -" in each for each in found.cautions)


def test_total_least_squares_with_unequal_noise_says_not_to_use_it(noisy) -> None:
    found = identify(equation(), noisy, "tls")
    assert np.abs(found.theta[1] / THETA[1] - 1.0) > 1.0
    assert any("do not use these numbers" in each for each in found.cautions)
    alone = identify(equation(), Recording(noisy.t, noisy.mean()), "tls")
    assert any("nothing here says they are" in each for each in alone.cautions)


def test_the_method_is_chosen_by_what_there_is(noisy) -> None:
    assert identify(equation(), noisy).method == "weak-iv"
    alone = Recording(noisy.t, noisy.mean())
    assert identify(equation(), alone).method == "weak-ls"
    told = Recording(noisy.t, noisy.mean(), {"r": 0.04 / np.sqrt(2), "tau": 0.05})
    assert identify(equation(), told).method == "weak-gtls"
    still = parse_equation("tau", {"a": "r", "b": "r*abs(r)"}, ["r", "tau"])
    assert identify(still, noisy).method == "iv"


def test_shared_noise_of_the_regressand_is_found_from_the_residuals(noisy) -> None:
    noise = identify(equation(), noisy, "weak-gtls").problem.noise
    # A covariance of residuals smoothed over 15 samples has about 1600 / 8 degrees of freedom.
    assert noise["tau"] == pytest.approx(NOISY["torque"], rel=0.25)


def test_a_difference_equation_is_found_by_simulated_instruments(rng) -> None:
    u, y = rng.standard_normal(6000), np.zeros(6000)
    for k in range(2, 6000):
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + 0.8 * u[k - 1]
    noisy = Recording(np.arange(6000.0), {"y": y + 0.3 * rng.standard_normal(6000), "u": u})
    relation = parse_equation("y", {"a1": "lag(y)", "a2": "lag(y, 2)", "b": "lag(u)"}, ["y", "u"])
    truth = np.array([1.2, -0.5, 0.8])
    least, simulated = identify(relation, noisy, "ls"), identify(relation, noisy, "iv")
    assert np.abs(least.theta - truth).max() > 0.05
    assert (np.abs(simulated.theta - truth) < 4 * simulated.std).all()
    assert simulated.std.max() < 0.02
    assert simulated.assessment.simulated_share > least.assessment.simulated_share


def test_a_recursion_comes_to_what_all_rows_give(noisy) -> None:
    for recursive, together in (("rls", "ls"), ("rtls", "gtls")):
        found, whole = identify(equation(), noisy, recursive), identify(equation(), noisy, together)
        assert found.track is not None
        assert found.track.theta.shape == (ROWS, 3)
        assert (np.abs(found.theta - whole.theta) < 0.1 * whole.std).all()
        # Of independent rows the recursion and the sandwich have the same size, to the noise of the sandwich.
        np.testing.assert_allclose(found.std, whole.std, rtol=0.25)


def test_a_recursion_that_is_not_there_yet_says_so(rng) -> None:
    # Loud sensors and a short record: line searches along the newest row have not turned far yet.
    loud = recording(rng, 0.15, 0.1).part(0, 500)
    found, together = identify(equation(), loud, "frtls"), identify(equation(), loud, "gtls")
    assert (np.abs(found.theta - together.theta) / found.std).max() > 1.0
    assert any("the recursion has not converged" in each for each in found.cautions)


def test_a_term_that_is_not_there_is_told_from_none(noisy, rng) -> None:
    stranger = Recording(noisy.t, {**noisy.values, "q": rng.standard_normal(ROWS)})
    found = identify(parse_equation("tau", TERMS | {"strange": "q"}, ["r", "q", "tau"]), stranger, level=0.9999)
    assert any("strange: the interval holds 0" in each for each in found.cautions)


def test_an_equation_that_explains_little_says_so(noisy) -> None:
    found = identify(parse_equation("tau", {"mass": "d(r)"}, ["r", "tau"]), noisy)
    assert found.assessment.explained_share < 0.5
    assert any("most of it is something else" in each for each in found.cautions)


def test_a_motion_that_shows_nothing_gives_no_estimate(rng) -> None:
    still = Recording(DT * np.arange(200), {"r": np.zeros(200), "tau": rng.standard_normal(200)})
    found = identify(equation(), still, "ls")
    assert found.status == Status.insufficient_data
    assert np.isnan(found.theta).all()
    assert found.cautions == (f"no estimate: {Status.insufficient_data.sentence}",)


def test_the_interval_widens_with_its_level(noisy) -> None:
    narrow, wide = (identify(equation(), noisy, "weak-iv", level=level).interval for level in (0.5, 0.99))
    assert (wide[0] < narrow[0]).all()
    assert (wide[1] > narrow[1]).all()


def test_every_method_has_a_name_and_recursive_ones_are_among_them() -> None:
    assert set(RECURSIVE) < set(METHODS)
    assert len(METHODS) == 16


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "weakiv"}, "method: 'weakiv' is not known; did you mean 'weak-iv'?"),
        ({"level": 1.0}, "level: expected a probability between 0 and 1, got 1.0"),
        ({"lag": -1}, "lag: expected a whole number of rows of at least 0, got -1"),
        ({"window": 4}, "window: expected an odd number of samples of at least 3, got 4"),
        ({"method": "rls", "forgetting": 0.0}, "forgetting: expected a number above 0 and at most 1, got 0.0"),
    ],
)
def test_options_that_are_none_are_refused(noisy, options, message) -> None:
    with pytest.raises(ConfigError) as caught:
        identify(equation(), noisy, **options)
    assert message in str(caught.value)


def test_methods_that_ask_for_what_is_not_known_are_refused(noisy) -> None:
    alone = Recording(noisy.t, noisy.mean())
    with pytest.raises(ConfigError, match="method: 'gtls' needs the noise of the signals: give it, or a second sensor"):
        identify(equation(), alone, "gtls")
    with pytest.raises(ConfigError, match="method: instrumental variables need a second sensor of the same motion"):
        identify(parse_equation("tau", {"a": "r"}, ["r", "tau"]), alone, "iv")
    with pytest.raises(ConfigError, match="recording: expected all of q, tau, got no 'q'"):
        identify(parse_equation("tau", {"a": "q"}, ["q", "tau"]), alone)
