"""Equations run by themselves."""

import numpy as np
import pytest

from gainful.identification import free_run_of, parse_equation

from .problems import DT, THETA, equation, motion


def test_a_vehicle_run_by_itself_moves_as_it_did() -> None:
    rate, torque = motion()
    run = free_run_of(equation())
    assert run is not None
    assert (run.signal, run.order) == ("r", 1)
    # The torque is interpolated between samples: an error of its curvature, about (2 pi / 1.6 s)^2 dt^2 / 8 of it.
    np.testing.assert_allclose(run(THETA, {"r": rate, "tau": torque}, DT), rate, atol=5e-3 * np.abs(rate).max())


def test_a_difference_equation_runs_as_a_loop_does(rng) -> None:
    relation = parse_equation(
        "y", {"a": "lag(y)", "b": "lag(y, 2)*abs(lag(y))", "c": "lag(u)", "d": "u**2"}, ["y", "u"]
    )
    run = free_run_of(relation)
    assert run is not None
    u, y = rng.standard_normal(80), np.zeros(80)
    y[:2] = 0.3, -0.2
    for k in range(2, 80):
        y[k] = 0.5 * y[k - 1] - 0.2 * y[k - 2] * abs(y[k - 1]) + 0.4 * u[k - 1] + 0.1 * u[k] ** 2
    found = run([0.5, -0.2, 0.4, 0.1], {"y": y, "u": u}, 1.0)
    # The first row has no input before it.
    assert np.isnan(found[0])
    np.testing.assert_allclose(found[1:], y[1:], atol=1e-12)


def test_an_oscillator_of_second_order_runs_as_its_solution_does() -> None:
    relation = parse_equation("force", {"mass": "d(q, 2)", "damping": "d(q)", "stiffness": "q"}, ["q", "force"])
    run = free_run_of(relation)
    assert run is not None
    assert (run.signal, run.order) == ("q", 2)
    t = 0.02 * np.arange(300)
    decay, frequency = 0.1, np.sqrt(4.0 - 0.01)
    q = np.exp(-decay * t) * np.cos(frequency * t)
    found = run([1.0, 0.2, 4.0], {"q": q, "force": np.zeros(300)}, 0.02)
    # Its start is a parabola through five samples: the third derivative, up to 8, times the step squared.
    np.testing.assert_allclose(found, q, atol=8 * 0.02**2)


def test_the_longest_stretch_without_gaps_is_run() -> None:
    rate, torque = (each.copy() for each in motion())
    torque[300] = np.nan
    found = free_run_of(equation())(THETA, {"r": rate, "tau": torque}, DT)  # type: ignore[misc]
    assert np.isnan(found[:301]).all()
    assert np.isfinite(found[301:]).all()


def test_a_run_that_grows_beyond_all_numbers_ends_in_infinity() -> None:
    run = free_run_of(parse_equation("y", {"a": "lag(y)"}, ["y"]))
    assert run is not None
    assert np.isinf(run([1e9], {"y": np.ones(60)}, 1.0)[-1])


@pytest.mark.parametrize(
    ("of", "terms"),
    [
        ("tau", {"a": "r", "b": "r*abs(r)"}),  # says nothing of what comes next
        ("tau", {"a": "d(r)*abs(d(r))"}),  # not solved for its highest derivative
        ("tau", {"a": "d(r)", "b": "abs(d(r))"}),
        ("tau", {"a": "d(r)", "b": "lag(r)"}),
        ("r", {"a": "lag(tau)"}),  # an output of others alone: nothing to run
    ],
)
def test_what_cannot_be_solved_for_a_signal_is_not_run(of, terms) -> None:
    found = free_run_of(parse_equation(of, terms, ["r", "tau"]))
    assert found is None
