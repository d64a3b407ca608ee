"""Recursive regressors: what they carry, what they converge to, and what they refuse."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.errors import Status
from gainful.models import Instant, Sample
from gainful.regression import (
    ConstantRowNoise,
    RateRowNoise,
    RayleighTotalLeastSquares,
    RecursiveLeastSquares,
    RecursiveTotalLeastSquares,
    accumulated_noise,
    generalized_total_least_squares,
    information,
    least_squares,
    rate_rows,
    regression_model,
    total_least_squares,
)
from gainful.regression.rayleigh import line_search

from .problems import DT, SCAN, YAW, clean_rows, followed, log_of, model_of, motion, noisy_rows, vague

EYE = np.eye(4)


@pytest.fixture(scope="module")
def rows(generator: Callable[[str], np.random.Generator]) -> np.ndarray:
    """400 moments of two sensors."""
    return noisy_rows(generator("recursive regression"), 400, 0.1)


@pytest.fixture(scope="module")
def quick(rows: np.ndarray) -> tuple[object, object]:
    """The square-root form along the record, forgetting."""
    return followed(RecursiveTotalLeastSquares(forgetting=0.995, gap_gate=False), rows)


def discounted(rows: np.ndarray, forgetting: float) -> np.ndarray:
    """Information of rows forgotten step by step."""
    shares = forgetting ** np.arange(len(rows) - 1, -1, -1.0)
    return np.einsum("t,tsi,tsj->ij", shares, rows, rows)


def exact(**given: Any) -> RecursiveTotalLeastSquares:
    """Converged at every step and never refused: the same program for all tests."""
    return RecursiveTotalLeastSquares(form="exact", gap_gate=False, **given)


# Least squares --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("square_root", [False, True])
def test_recursive_least_squares_is_a_kalman_filter_of_constants(rows: np.ndarray, square_root: bool) -> None:
    holed = rows.copy()
    holed[20:40, 1, 0] = np.nan
    holed[30:35, 0, 3] = np.nan
    estimator = RecursiveLeastSquares(estimate=gf.SquareRoot if square_root else gf.Gaussian)
    _, ours = followed(estimator, holed, R=0.1)
    _, theirs = followed(gf.kalman_filter(square_root=square_root), holed, R=0.1)
    # A vague prior of 1e6 against information of 1 per row: ten digits of sixteen are left at the first steps.
    for name in ("residual", "nis", "log_likelihood"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(ours.estimate.mean, theirs.estimate.mean, rtol=1e-6, atol=1e-6)
    covs = [jax.vmap(lambda each: each.cov)(infos.estimate) for infos in (ours, theirs)]
    np.testing.assert_allclose(covs[0][-1], covs[1][-1], rtol=1e-8)
    np.testing.assert_array_equal(ours.status, theirs.status)


def test_without_forgetting_it_is_least_squares_of_all_rows(rows: np.ndarray) -> None:
    _, infos = followed(RecursiveLeastSquares(weights=(10.0, 10.0)), rows)
    expected = least_squares(information(rows)).theta
    # A prior of standard deviation 1e3 is 1e-6 of information against 12000.
    np.testing.assert_allclose(infos.estimate.mean[-1], expected, rtol=1e-6)


def test_its_covariance_is_the_inverse_of_the_information_it_remembers(rows: np.ndarray) -> None:
    forgetting = 0.98
    last, _ = followed(RecursiveLeastSquares((2.0, 2.0), forgetting), rows)
    regressors = rows[..., :3] * np.sqrt(2.0)
    known = forgetting ** len(rows) * 1e-6 * np.eye(3) + discounted(regressors, forgetting)
    np.testing.assert_allclose(last.cov @ known, np.eye(3), atol=1e-6)


def test_rows_of_one_moment_may_come_one_after_the_other(rows: np.ndarray) -> None:
    split = np.full_like(rows, np.nan)
    split[0::2, 0], split[1::2, 1] = rows[:200, 0], rows[:200, 1]
    for estimator in (RecursiveLeastSquares(), exact()):
        apart, together = followed(estimator, split)[1], followed(estimator, rows)[1]
        # Past the first rows, at which the vague prior costs ten digits.
        np.testing.assert_allclose(apart.estimate.mean[101::2], together.estimate.mean[50:200], rtol=1e-8)
        np.testing.assert_allclose(apart.estimate.cov[399], together.estimate.cov[199], rtol=1e-8)


# Total least squares --------------------------------------------------------------------------------------------------


def test_the_root_carried_is_that_of_the_information(rows: np.ndarray, quick: tuple) -> None:
    last, infos = quick
    known = discounted(rows, 0.995) + 0.995 ** len(rows) * 1e-3 * EYE
    np.testing.assert_allclose(last.square @ last.square.T, known, rtol=1e-9, atol=1e-9 * np.abs(known).max())
    weights = 2 * 0.995 ** np.arange(len(rows))
    np.testing.assert_allclose(last.noise, weights.sum() * EYE, rtol=1e-9)
    np.testing.assert_allclose(infos.memory.rows[-1], weights.sum() ** 2 / (weights @ weights) * 2, rtol=1e-9)


def test_the_covariance_form_carries_its_inverse_and_finds_the_same(rows: np.ndarray, quick: tuple) -> None:
    last, infos = followed(RecursiveTotalLeastSquares(forgetting=0.995, form="covariance", gap_gate=False), rows)
    known = discounted(rows, 0.995) + 0.995 ** len(rows) * 1e-3 * EYE
    np.testing.assert_allclose(last.square @ known, EYE, atol=1e-6)
    ours, theirs = infos.estimate.mean, quick[1].estimate.mean
    accepted = np.asarray(infos.status) == Status.ok
    assert accepted.sum() > 380
    np.testing.assert_allclose(ours[accepted], theirs[accepted], rtol=1e-5)


@pytest.mark.parametrize("loading", [1e2, 1.0, 1e-6])
def test_converged_it_is_total_least_squares_of_all_rows_wherever_it_starts(rows: np.ndarray, loading: float) -> None:
    expected = np.linalg.svd(rows.reshape(-1, 4), full_matrices=False)[2][-1]
    _, infos = followed(exact(loading=loading), rows)
    np.testing.assert_allclose(infos.estimate.mean[-1], -expected[:3] / expected[3], rtol=1e-7)
    last, _ = followed(RecursiveTotalLeastSquares(loading=loading, gap_gate=False), rows)
    v = last.direction
    for _ in range(300):
        v = np.linalg.solve(last.square @ last.square.T, v)
        v /= np.linalg.norm(v)
    np.testing.assert_allclose(-v[:3] / v[3], -expected[:3] / expected[3], rtol=1e-7)


def test_the_published_recursion_in_numpy_is_the_same(rows: np.ndarray) -> None:
    P, v, found = 1e3 * EYE, np.array([0.0, 0.0, 0.0, -1.0]), []
    for D in rows:
        G = np.diag([0.5, 0.25]) * 0.99 + D @ P @ D.T
        P = (P - P @ D.T @ np.linalg.solve(G, D @ P)) / 0.99
        P = 0.5 * (P + P.T)
        v = P @ v
        v /= np.linalg.norm(v)
        found.append(-v[:3] / v[3])
    estimator = RecursiveTotalLeastSquares((2.0, 4.0), 0.99, form="covariance", gap_gate=False)
    last, infos = followed(estimator, rows)
    np.testing.assert_allclose(last.square, P, rtol=1e-9, atol=1e-9 * np.abs(P).max())
    accepted = np.asarray(infos.status) == Status.ok
    np.testing.assert_allclose(infos.estimate.mean[accepted], np.array(found)[accepted], rtol=1e-9)
    assert accepted.sum() > 380


def test_any_row_covariance_singular_too_is_generalised_total_least_squares(rows: np.ndarray) -> None:
    shape = ((0.3, 0.1, 0.0, 0.0), (0.1, 0.2, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 2.0))
    estimator = exact(weights=(1.0, 3.0), noise=ConstantRowNoise(shape), loading=1e-9)
    _, infos = followed(estimator, rows)
    fit = generalized_total_least_squares(information(rows, [1.0, 3.0]), np.array(shape) * 800, 800)
    np.testing.assert_allclose(infos.estimate.mean[-1], fit.theta, rtol=1e-7)
    np.testing.assert_allclose(infos.estimate.cov[-1], fit.cov, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(infos.memory.gap[-1], fit.gap, rtol=1e-7)
    np.testing.assert_allclose(infos.memory.noise_scale[-1], fit.noise_scale, rtol=1e-7)


def test_noise_in_the_regressand_alone_is_least_squares_in_one_step(rows: np.ndarray) -> None:
    noise = ConstantRowNoise((0.0, 0.0, 0.0, 1.0))
    _, infos = followed(RecursiveTotalLeastSquares(noise=noise, gap_gate=False), rows)
    np.testing.assert_allclose(infos.estimate.mean[-1], least_squares(information(rows)).theta, rtol=1e-9)
    fit = least_squares(information(rows), 800)
    np.testing.assert_allclose(infos.estimate.cov[-1], fit.cov, rtol=1e-6)
    assert (infos.status[2:] == Status.ok).all()


def test_noise_that_follows_from_the_rate_is_summed_row_by_row(rng: np.random.Generator) -> None:
    rate, _ = motion(400)
    noisy = rate + 0.05 * rng.standard_normal(400)
    wrench = clean_rows(400)[:, 3] + rng.standard_normal(400)
    table = np.asarray(rate_rows(noisy, wrench, DT, std=0.05))[:, None]
    noise = RateRowNoise(0.05, 1.0, DT)
    _, infos = followed(exact(noise=noise, loading=1e-9), table)
    fit = generalized_total_least_squares(information(table), accumulated_noise(table, noise), 396)
    assert int(fit.status) == Status.ok
    np.testing.assert_allclose(infos.estimate.mean[-1], fit.theta, rtol=1e-6)


def test_clean_data_are_solved_exactly_and_stay_so_though_forgotten() -> None:
    table = np.repeat(clean_rows(400)[:, None], 2, axis=1)
    for estimator in (
        RecursiveTotalLeastSquares(forgetting=0.9, gap_gate=False),
        exact(forgetting=0.95),
        RecursiveLeastSquares(estimate=gf.SquareRoot, forgetting=0.9),
    ):
        _, infos = followed(estimator, table)
        assert not np.any(np.asarray(infos.status) >= Status.not_positive)
        np.testing.assert_allclose(infos.estimate.mean[-1], YAW, rtol=1e-8)


def test_swapping_sensors_and_scaling_all_weights_change_nothing(rows: np.ndarray) -> None:
    shape = tuple(map(tuple, EYE))  # the same program as above
    one = followed(exact(weights=(1.0, 2.0), noise=ConstantRowNoise(shape)), rows)[1]
    heavy = exact(weights=(14.0, 7.0), noise=ConstantRowNoise(shape), loading=7e-3)
    other = followed(heavy, rows[:, ::-1])[1]
    np.testing.assert_allclose(one.estimate.mean[-1], other.estimate.mean[-1], rtol=1e-7)
    np.testing.assert_allclose(one.estimate.cov[-1], other.estimate.cov[-1], rtol=1e-5)
    np.testing.assert_allclose(7 * one.memory.noise_scale[-1], other.memory.noise_scale[-1], rtol=1e-7)


def test_a_missing_row_is_left_out_and_a_missing_moment_forgets_nothing(rows: np.ndarray) -> None:
    holed = rows.copy()
    holed[50:60, 0, 2] = np.nan
    holed[70:90] = np.nan
    last, infos = followed(exact(forgetting=0.98), holed)
    np.testing.assert_array_equal(infos.status[70:90], np.full(20, Status.missing))
    np.testing.assert_array_equal(infos.estimate.mean[70:90], np.tile(infos.estimate.mean[69], (20, 1)))
    kept = np.delete(holed, np.s_[70:90], axis=0)
    known = discounted(np.nan_to_num(np.where(np.isnan(kept).any(-1, keepdims=True), 0.0, kept)), 0.98)
    known += 0.98**380 * 1e-3 * EYE
    np.testing.assert_allclose(last.square @ last.square.T, known, rtol=1e-9, atol=1e-9 * known.max())


def test_a_regressor_that_is_not_finite_is_a_missing_row(rows: np.ndarray) -> None:
    model = model_of(2)
    holed = rows.copy()
    holed[200, 1], holed[300] = np.nan, np.nan
    samples = gf.samples_of(log_of(model, rows), float)
    samples.when.u[200, 4], samples.when.u[300, [0, 5]] = np.nan, np.inf
    for estimator in (RecursiveLeastSquares(), exact()):
        _, theirs = followed(estimator, holed)
        _, ours = SCAN(estimator, model, vague(model), samples)
        assert int(ours.status[300]) == Status.missing
        np.testing.assert_array_equal(ours.estimate.mean, theirs.estimate.mean)
        np.testing.assert_array_equal(ours.estimate.cov, theirs.estimate.cov)


# Gate and status ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def outage(generator: Callable[[str], np.random.Generator]) -> np.ndarray:
    """A record whose motion stops between rows 120 and 220, while the sensors go on being noisy."""
    noise = noisy_rows(generator("outage"), 400, 0.01) - clean_rows(400)[:, None]
    clean = clean_rows(400)[:, None].copy()
    clean[120:220] = 0.0
    return clean + noise


def test_noise_alone_does_not_move_a_gated_estimate(outage: np.ndarray) -> None:
    worst = {}
    for gate in (True, False):
        estimator = RecursiveTotalLeastSquares(forgetting=0.93, gap_gate=gate)
        _, infos = followed(estimator, outage)
        worst[gate] = np.abs(np.asarray(infos.estimate.mean)[90:] / YAW - 1).max()
        if gate:
            status = np.asarray(infos.status)
    assert worst[True] < 1 < worst[False]
    # Once the motion is forgotten (0.93^80 = 0.003 of its rows) noise is taken for nothing but noise.
    assert (status[200:220] == Status.ill_separated).all()
    assert (status[220:] == Status.ok).any()


def test_before_there_are_rows_enough_the_estimate_is_the_prior(rows: np.ndarray) -> None:
    _, infos = followed(RecursiveTotalLeastSquares(), rows)
    early = np.asarray(infos.status) != Status.ok
    assert infos.status[0] == Status.insufficient_data
    assert early[:20].all()
    first = int(np.flatnonzero(~early)[0])
    np.testing.assert_array_equal(infos.estimate.mean[:first], np.zeros((first, 3)))
    np.testing.assert_array_equal(infos.estimate.cov[0], 1e6 * np.eye(3))
    assert not any(Status(int(code)).failed for code in np.unique(infos.status))


def test_parameters_at_infinity_are_not_taken() -> None:
    # The regressand does not matter: the second column is 0 but for its noise.
    rng = np.random.default_rng(5)
    h = rng.standard_normal((50, 1, 1))
    table = np.concatenate([np.zeros_like(h), h], axis=2)
    model = regression_model(["x"])
    log = gf.make_log(model, np.arange(50.0), table[..., 1], table[..., 0])
    prior = gf.make_prior(model, [0.5], [1.0])
    result = gf.run(exact(loading=1e-12), model, prior, log)
    assert set(result.counts()) <= {"insufficient_data", "nongeneric", "ill_separated"}
    np.testing.assert_array_equal(result.mean[-1], [0.5])


def test_bands_of_the_estimate_hold_the_truth(generator: Callable[[str], np.random.Generator]) -> None:
    table = noisy_rows(generator("bands"), 400, 0.05, runs=60)
    model = model_of(2)
    samples = [gf.samples_of(log_of(model, each), float) for each in table]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *samples)
    priors = jax.tree.map(lambda leaf: jnp.stack([leaf] * len(table)), vague(model))
    _, infos = gf.run_many(exact(), model, priors, stacked)
    last = jax.tree.map(lambda leaf: np.asarray(leaf[:, -1]), infos.estimate)
    scaled = np.linalg.solve(np.linalg.cholesky(last.cov), (last.mean - YAW)[..., None])[..., 0]
    # Sums of 180 squares: chi-square with a standard deviation of sqrt(360).
    assert abs((scaled**2).sum() - 180) < 4 * np.sqrt(360)


# Rayleigh -------------------------------------------------------------------------------------------------------------


def quotient(theta: np.ndarray, S: np.ndarray) -> float:
    a = np.append(theta, -1.0)
    return float(a @ S @ a / (a @ a))


def test_a_line_search_finds_the_least_quotient_along_its_line(rows: np.ndarray, rng: np.random.Generator) -> None:
    S = np.asarray(information(rows))
    search = jax.jit(line_search)
    for _ in range(20):
        theta, along = YAW * rng.uniform(0.5, 1.5, 3), rng.standard_normal(3) * [1.0, 10.0, 1.0]
        alpha = float(search(theta, along, S, EYE))
        reached = quotient(theta + alpha * along, S)
        steps = np.concatenate([np.linspace(-300, 300, 2001), alpha + np.linspace(-1e-3, 1e-3, 21)])
        assert reached <= min(quotient(theta + step * along, S) for step in steps) * (1 + 1e-12)
        assert reached <= quotient(theta, S) * (1 + 1e-12)
        loaded = float(search(theta, along, S + 30.0 * EYE, EYE))
        # The quotient is flat to second order: alpha keeps half the digits that B^2 - 4 A C has.
        assert loaded == pytest.approx(alpha, rel=1e-9, abs=1e-9)


def test_line_searches_lead_to_total_least_squares(rows: np.ndarray) -> None:
    expected = np.asarray(total_least_squares(information(rows)).theta)
    errors = {}
    for direction in ("input", "gain"):
        _, infos = followed(RayleighTotalLeastSquares(direction=direction), rows)
        errors[direction] = np.abs(np.asarray(infos.estimate.mean[-1]) / expected - 1).max()
        lead = np.asarray(infos.status)[:50]
        assert (lead != Status.missing).all()
    assert errors["gain"] < 0.02
    assert errors["input"] < 0.1


def test_the_search_starts_from_least_squares(rows: np.ndarray) -> None:
    last, _ = followed(RayleighTotalLeastSquares(warm_start=800), rows)
    np.testing.assert_allclose(last.direction[:3], least_squares(information(rows)).theta, rtol=1e-9)


# The model ------------------------------------------------------------------------------------------------------------


def test_parameters_that_wander_are_followed(rows: np.ndarray) -> None:
    model = regression_model({"mass": "kg", "linear": "N s/m", "quadratic": "1"}, ("a", "b"), Q=[4.0, 0.0, 1.0], R=0.1)
    log = log_of(model, rows[:50])
    results = [gf.run(each, model, vague(model), log) for each in (gf.kalman_filter(), RecursiveLeastSquares())]
    np.testing.assert_allclose(results[1].mean[-1], results[0].mean[-1], rtol=1e-8)
    np.testing.assert_allclose(results[1].cov[-1], results[0].cov[-1], rtol=1e-8)
    constant = dataclasses.replace(model, walk=jnp.zeros((3, 3)))
    assert (gf.run(RecursiveLeastSquares(), constant, vague(model), log).std[-1] < results[1].std[-1]).all()


def test_a_live_stream_gives_what_the_record_gives(rows: np.ndarray) -> None:
    model = model_of(2)
    log = log_of(model, rows[:60])
    result = gf.run(exact(), model, vague(model), log)
    live = gf.OnlineFilter(exact(), model, vague(model))
    for k in range(len(log)):
        last = live.push(log.t[k], log.y[k], log.u[k])
    np.testing.assert_allclose(last.mean, result.mean[-1], rtol=1e-9)


@pytest.mark.parametrize("kind", [RecursiveLeastSquares, RecursiveTotalLeastSquares, RayleighTotalLeastSquares])
def test_single_precision_stays_single(kind: Any) -> None:
    model = model_of(2)
    prior, sample = jax.tree.map(
        lambda leaf: jnp.asarray(leaf, jnp.float32),
        (vague(model), Instant(jnp.zeros(()), jnp.ones(()), jnp.ones(6))),
    )
    carry = kind().init(model, prior)
    moment = Sample(sample, jnp.ones(2, jnp.float32), jnp.array([True, True]))
    after, info = jax.eval_shape(lambda held, now: kind().step(model, held, now), carry, moment)
    assert {leaf.dtype for leaf in jax.tree.leaves(after)} == {jnp.dtype("float32")}
    assert info.residual.dtype == jnp.float32
