"""On a linear model every filter is the Kalman filter, and its likelihood the joint density of the record."""

import importlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.linearization import Cubature, GaussHermite, Unscented

from .problems import Linear

ESTIMATORS = {
    "kalman": gf.kalman_filter(),
    "kalman-root": gf.kalman_filter(square_root=True),
    "unscented": gf.unscented_kalman_filter(),
    "unscented-small-alpha-root": gf.KalmanFilter(gf.SigmaPoints(Unscented(alpha=0.1)), estimate=gf.SquareRoot),
    "cubature": gf.KalmanFilter(gf.SigmaPoints(Cubature())),
    "hermite": gf.KalmanFilter(gf.SigmaPoints(GaussHermite(3))),
}


@pytest.fixture(scope="module")
def problem(generator: object) -> Linear:
    return Linear(generator("linear"))  # type: ignore[operator]


@pytest.mark.parametrize("name", ESTIMATORS)
def test_on_a_linear_model_every_filter_is_batch_least_squares_so_far(name: str, problem: Linear) -> None:
    result = gf.run(ESTIMATORS[name], problem.model, problem.prior, problem.log)
    # The normal equations have condition numbers below 1e4, and NumPy's own rounding is the larger part.
    for rows in (1, 3, 8, len(problem.t)):
        mean, cov = problem.least_squares(rows)
        np.testing.assert_allclose(result.mean[rows - 1], mean[rows - 1], rtol=0, atol=1e-11)
        np.testing.assert_allclose(result.cov[rows - 1], cov[rows - 1], rtol=0, atol=1e-11)
    assert result.counts() == {"ok": 11, "missing": 1}


@pytest.mark.parametrize("name", ["kalman", "kalman-root", "cubature"])
def test_the_log_likelihood_is_the_joint_density_of_all_that_was_measured(name: str, problem: Linear) -> None:
    result = gf.run(ESTIMATORS[name], problem.model, problem.prior, problem.log)
    for rows in (1, 3, 8, len(problem.t)):
        assert result.log_likelihood[:rows].sum() == pytest.approx(problem.log_density(rows), rel=1e-11)


@pytest.mark.parametrize("name", ["kalman", "kalman-root"])
def test_the_smoother_is_batch_least_squares(name: str, problem: Linear) -> None:
    result = gf.smooth(gf.run(ESTIMATORS[name], problem.model, problem.prior, problem.log))
    mean, cov = problem.least_squares(len(problem.t))
    np.testing.assert_allclose(result.mean, mean, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result.cov, cov, rtol=0, atol=1e-10)
    # Rows at one moment share one state.
    np.testing.assert_allclose(result.mean[1], result.mean[2], rtol=1e-12)


def test_a_run_in_pieces_is_one_run(problem: Linear, monkeypatch: pytest.MonkeyPatch) -> None:
    estimator = gf.kalman_filter(update=gf.Gated(probability=0.5, reacquire=2))
    whole = gf.run(estimator, problem.model, problem.prior, problem.log)
    monkeypatch.setattr(importlib.import_module("gainful.running.run"), "CHUNK", 5)
    done: list[int] = []
    pieces = gf.run(estimator, problem.model, problem.prior, problem.log, progress=done.append)
    assert done[:3] == [5, 10, 12]  # the last piece is padded
    assert (whole.status == gf.errors.Status.rejected).any()  # so that the gate's memory passes from piece to piece
    for name in ("mean", "cov", "residual", "residual_cov", "nis", "log_likelihood", "weight", "status"):
        np.testing.assert_allclose(getattr(pieces, name), getattr(whole, name), rtol=1e-13, atol=1e-14, err_msg=name)


def test_many_runs_at_once_are_each_run_alone(problem: Linear, rng: np.random.Generator) -> None:
    estimator = gf.kalman_filter()
    logs = [gf.make_log(problem.model, problem.t, rng.normal(size=problem.y.shape), problem.u) for _ in range(3)]
    priors = [gf.make_prior(problem.model, rng.normal(size=2), [1.0, 0.5]) for _ in range(3)]
    samples = [gf.samples_of(log, float) for log in logs]
    stacked = (
        jax.tree.map(lambda *leaves: jnp.stack(leaves), *priors),
        jax.tree.map(lambda *leaves: np.stack(leaves), *samples),
    )
    _, infos = gf.run_many(estimator, problem.model, *stacked)
    for i, (log, prior) in enumerate(zip(logs, priors, strict=True)):
        alone = gf.run(estimator, problem.model, prior, log)
        np.testing.assert_allclose(infos.estimate.mean[i], alone.mean, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(infos.log_likelihood[i], alone.log_likelihood, rtol=1e-12)
