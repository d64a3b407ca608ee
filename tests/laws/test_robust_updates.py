"""What is known of robust updates beyond their limit: formulas, bounds and invariances."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
import scipy.stats

import gainful as gf
from gainful.estimates import AbstractEstimate, Gaussian, SquareRoot, TwoStage
from gainful.linalg import whitening_root
from gainful.models import Instant, Sample
from gainful.spaces import Euclidean, Product
from gainful.updates import (
    AbstractUpdate,
    HuberReweighted,
    Likelihood,
    MasreliezMartin,
    MaximumCorrentropy,
    StudentT,
    Update,
    WeightedLikelihood,
    huber_fisher_information,
    huber_rho,
    huber_threshold,
)
from gainful.updates.reweighted import AbstractReweighted

N, M = 5, 3
SPACE = Product([Euclidean(("a", "b", "c")), Euclidean(("p", "q"))], added=2)
OUTPUT = Euclidean(("u", "v", "w"))


class Problem:
    """A random linear measurement of a random prior."""

    def __init__(self, seed: int, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
        rng = np.random.default_rng(seed)
        root = rng.normal(size=(N, N))
        self.P = root @ root.T + 0.1 * np.eye(N)
        self.mean = rng.normal(size=N)
        units = np.array(scale)
        self.H = units[:, None] * rng.normal(size=(M, N))
        self.R = np.diag((units * rng.uniform(0.5, 2.0, M)) ** 2)
        self.S = self.H @ self.P @ self.H.T + self.R
        # Two components a few sigmas off, one not.
        self.residual = np.linalg.cholesky(self.S) @ np.array([4.0, -0.3, -2.5])

    def act(
        self,
        update: AbstractUpdate,
        *,
        estimate: type[AbstractEstimate] = Gaussian,
        residual: np.ndarray | None = None,
        R: np.ndarray | None = None,
        seen: tuple[bool, ...] = (True,) * M,
        carry: object = None,
    ) -> Update:
        prior = estimate.start(jnp.asarray(self.mean), jnp.asarray(self.P), SPACE)
        H = jnp.asarray(self.H)
        likelihood = Likelihood(
            lambda x: H @ x,
            OUTPUT,
            jnp.asarray(self.R if R is None else R),
            jnp.array(seen),
            jnp.zeros((N, N)),
            (("all", M),),
            gf.Taylor(),
        )
        y = self.H @ self.mean + (self.residual if residual is None else residual)
        if isinstance(update, AbstractReweighted):
            carry = jnp.ones(N)
        return update(carry, prior, likelihood, jnp.asarray(y))[1]

    def moved(self, found: Update) -> np.ndarray:
        return np.asarray(found.posterior.mean) - self.mean


@pytest.fixture(scope="module")
def problem() -> Problem:
    return Problem(1)


@pytest.mark.parametrize(
    ("contamination", "threshold"),
    # Roots of the defining equation, found independently.
    [
        (0.001, 2.63288),
        (0.01, 1.94511),
        (0.02, 1.71744),
        (0.05, 1.39838),
        (0.1, 1.14017),
        (0.2, 0.86159),
        (0.5, 0.43633),
    ],
)
def test_thresholds_and_informations_are_hubers(contamination: float, threshold: float) -> None:
    k = huber_threshold(contamination)
    assert k == pytest.approx(threshold, abs=1e-5)
    odds = 2 * scipy.stats.norm.pdf(k) / k - 2 * scipy.stats.norm.cdf(-k)
    assert odds == pytest.approx(contamination / (1 - contamination), rel=1e-12)
    inside = (1 - contamination) * (2 * scipy.stats.norm.cdf(k) - 1)
    assert float(huber_fisher_information(k)) == pytest.approx(inside, rel=1e-12)


def test_no_contamination_needs_no_threshold_and_more_needs_a_lower_one() -> None:
    assert huber_threshold(0.0) == np.inf
    assert float(huber_fisher_information(np.inf)) == 1.0
    thresholds = [huber_threshold(each) for each in (1e-12, 1e-6, 0.01, 0.3, 0.9, 0.999)]
    assert thresholds == sorted(thresholds, reverse=True)


def test_the_least_favourable_density_is_one_and_its_information_that_of_the_score() -> None:
    contamination = 0.1
    k = huber_threshold(contamination)

    def density(v: float) -> float:
        return (1 - contamination) * np.exp(-float(huber_rho(jnp.asarray(v), k))) / np.sqrt(2 * np.pi)

    def over(fn) -> float:
        return sum(scipy.integrate.quad(fn, *ends)[0] for ends in ((-np.inf, -k), (-k, k), (k, np.inf)))

    assert over(density) == pytest.approx(1.0, abs=1e-8)
    information = float(huber_fisher_information(k))
    assert over(lambda v: np.clip(v, -k, k) ** 2 * density(v)) == pytest.approx(information, abs=1e-8)


FORMS = [
    *itertools.product([Gaussian], ("indicator", "expectation"), ("zca-cor", "cholesky", "symmetric")),
    *itertools.product([SquareRoot, TwoStage], ("indicator", "expectation"), ("zca-cor",)),
]


@pytest.mark.parametrize(("estimate", "covariance", "whitening"), FORMS)
def test_the_posterior_is_that_of_masreliez_and_martin_in_all_coordinates(
    problem: Problem, estimate: type[AbstractEstimate], covariance: str, whitening: str
) -> None:
    found = problem.act(MasreliezMartin(covariance=covariance, whitening=whitening), estimate=estimate)
    k = huber_threshold(0.1)
    T = np.asarray(whitening_root(jnp.asarray(problem.S), whitening))
    v, K = T @ problem.residual, problem.P @ problem.H.T @ T.T
    inside = (np.abs(v) <= k).astype(float)
    assert 0 < inside.sum() < M, "the problem must have components on both sides of the threshold"
    slope = inside if covariance == "indicator" else np.full(M, 0.671206494546)
    # A few dozen operations of size 10.
    np.testing.assert_allclose(problem.moved(found), K @ np.clip(v, -k, k), atol=1e-11)
    np.testing.assert_allclose(found.posterior.cov, problem.P - K @ np.diag(slope) @ K.T, atol=1e-10)
    np.testing.assert_allclose(found.weight, np.minimum(1, k / np.abs(v)), atol=1e-12)


def test_the_covariance_lies_between_the_prior_and_the_exact_posterior() -> None:
    for seed in range(5):
        problem = Problem(seed)
        exact = np.asarray(problem.act(gf.Exact()).posterior.cov)
        for covariance in ("indicator", "expectation"):
            cov = np.asarray(problem.act(MasreliezMartin(covariance=covariance)).posterior.cov)
            assert np.linalg.eigvalsh(problem.P - cov)[0] > -1e-9
            assert np.linalg.eigvalsh(cov - exact)[0] > -1e-9


def test_an_outlier_pulls_no_further_however_large_it_is(problem: Problem) -> None:
    update, k = MasreliezMartin(), huber_threshold(0.1)
    T = np.asarray(whitening_root(jnp.asarray(problem.S)))
    bound = k * np.sqrt(M) * np.linalg.norm(problem.P @ problem.H.T @ T.T)
    far, farther = (problem.moved(problem.act(update, residual=size * problem.residual)) for size in (1e3, 1e9))
    assert np.linalg.norm(far) <= bound
    # Two components are clipped in both; the third scales with the whole until it is clipped too.
    np.testing.assert_allclose(far, farther, atol=1e-9)


def test_shortening_all_components_together_keeps_their_direction(problem: Problem) -> None:
    found = problem.act(MasreliezMartin(joint=True))
    T = np.asarray(whitening_root(jnp.asarray(problem.S)))
    v = T @ problem.residual
    share = 2 * scipy.stats.norm.cdf(huber_threshold(0.1)) - 1
    weight = np.sqrt(scipy.stats.chi2.ppf(share, M)) / np.linalg.norm(v)
    exact = problem.moved(problem.act(gf.Exact()))
    np.testing.assert_allclose(problem.moved(found), weight * exact, atol=1e-11)
    np.testing.assert_allclose(found.posterior.cov, problem.P, atol=1e-10)


UNITS = (1e-4, 1.0, 1e5)  # metres, metres per second, pascals
ORDER = np.array([2, 0, 1])


@pytest.mark.parametrize("kind", ["zca-cor", "cholesky", "symmetric"])
def test_the_root_of_the_default_depends_neither_on_units_nor_on_order(kind: str) -> None:
    S = Problem(3).S
    T = np.asarray(whitening_root(jnp.asarray(S), kind))
    units = np.diag(UNITS)
    scaled = np.asarray(whitening_root(jnp.asarray(units @ S @ units), kind)) @ units
    shuffled = np.asarray(whitening_root(jnp.asarray(S[np.ix_(ORDER, ORDER)]), kind))[np.argsort(ORDER)][
        :, np.argsort(ORDER)
    ]
    same_units, same_order = np.abs(scaled - T).max() < 1e-8, np.abs(shuffled - T).max() < 1e-8
    assert (same_units, same_order) == (kind != "symmetric", kind != "cholesky")


def test_the_default_root_whitens_where_units_differ_by_many_decades() -> None:
    units = np.diag(UNITS)
    S = units @ Problem(3).S @ units
    T = np.asarray(whitening_root(jnp.asarray(S)))
    np.testing.assert_allclose(T @ S @ T.T, np.eye(M), atol=1e-9)


ROBUST = [
    MasreliezMartin(),
    MasreliezMartin(covariance="expectation"),
    HuberReweighted(),
    StudentT(),
    MaximumCorrentropy(),
    WeightedLikelihood(),
]


@pytest.mark.parametrize("update", ROBUST, ids=lambda each: type(each).__name__)
def test_a_component_of_vast_noise_is_as_good_as_unmeasured(problem: Problem, update: AbstractUpdate) -> None:
    R = problem.R.copy()
    R[1, 1] = 1e15
    vast = problem.act(update, R=R)
    unseen = problem.act(update, seen=(True, False, True))
    np.testing.assert_allclose(vast.posterior.mean, unseen.posterior.mean, atol=1e-6)
    np.testing.assert_allclose(vast.posterior.cov, unseen.posterior.cov, atol=1e-6)


def test_hubers_cost_is_stationary_where_its_reweighting_ends(problem: Problem) -> None:
    found = problem.act(HuberReweighted(iterations=200))
    k, L = huber_threshold(0.1), np.linalg.cholesky(problem.P)
    sigma = np.sqrt(np.diag(problem.R))

    def cost(d: jax.Array) -> jax.Array:
        prediction = jnp.linalg.solve(jnp.asarray(L), d)
        measurement = (problem.residual - problem.H @ d) / sigma
        return jnp.sum(huber_rho(prediction, k)) + jnp.sum(huber_rho(measurement, k))

    assert np.abs(jax.grad(cost)(jnp.asarray(problem.moved(found)))).max() < 1e-6


def test_the_scales_of_students_t_are_a_fixed_point(problem: Problem) -> None:
    found = problem.act(StudentT(dof=4.0, iterations=300))
    off = problem.residual - problem.H @ problem.moved(found)
    spread = np.diag(problem.H @ np.asarray(found.posterior.cov) @ problem.H.T)
    weight = 5.0 / (4.0 + (off**2 + spread) / np.diag(problem.R))
    np.testing.assert_allclose(found.weight, weight, rtol=1e-8)
    exact = problem.act(gf.Exact(), R=np.diag(np.diag(problem.R) / weight))
    np.testing.assert_allclose(found.posterior.mean, exact.posterior.mean, rtol=1e-7)


def test_one_pass_of_correntropy_is_the_published_one(problem: Problem) -> None:
    found = problem.act(MaximumCorrentropy(bandwidth=3.0, iterations=1))
    R_w = problem.R / np.diag(np.exp(-(problem.residual**2) / np.diag(problem.R) / 18.0)).clip(1e-8)
    R_w = np.diag(np.diag(R_w))
    K = problem.P @ problem.H.T @ np.linalg.inv(problem.H @ problem.P @ problem.H.T + R_w)
    keep = np.eye(N) - K @ problem.H
    np.testing.assert_allclose(problem.moved(found), K @ problem.residual, atol=1e-10)
    np.testing.assert_allclose(found.posterior.cov, keep @ problem.P @ keep.T + K @ problem.R @ K.T, atol=1e-10)


@pytest.mark.parametrize("joint", [False, True])
def test_the_weighted_likelihood_has_a_noise_that_grows_with_the_innovation(problem: Problem, joint: bool) -> None:
    found = problem.act(WeightedLikelihood(scale=3.0, joint=joint))
    square = problem.residual**2 / np.diag(problem.R)
    growth = 1.0 + (square.sum() if joint else square) / 9.0
    exact = problem.act(gf.Exact(), R=problem.R * growth)
    np.testing.assert_allclose(found.posterior.mean, exact.posterior.mean, atol=1e-11)
    np.testing.assert_allclose(found.posterior.cov, exact.posterior.cov, atol=1e-11)


def test_correlated_noise_is_weighed_in_uncorrelated_units(problem: Problem) -> None:
    # In the units in which R is the identity the same problem has plain weights.
    R = problem.R + 0.4 * np.sqrt(np.outer(np.diag(problem.R), np.diag(problem.R))) * (1 - np.eye(M))
    plain = Problem(1)
    W = np.linalg.inv(np.linalg.cholesky(R))
    plain.H, plain.R = W @ problem.H, np.eye(M)
    for update in (HuberReweighted(), StudentT(), MaximumCorrentropy(), WeightedLikelihood()):
        one, other = problem.act(update, R=R), plain.act(update, residual=W @ problem.residual)
        np.testing.assert_allclose(one.posterior.mean, other.posterior.mean, atol=1e-10)
        np.testing.assert_allclose(one.posterior.cov, other.posterior.cov, atol=1e-10)


def gain_model(walk: float = 0.0) -> gf.models.AugmentedModel:
    """A gain to be found: what goes in comes out multiplied."""
    model = gf.discrete_model(
        lambda x, u, t, dt, p: 0.0 * x + p["gain"] * u,
        lambda x: x,
        states=["z"],
        outputs=["y"],
        inputs=["u"],
        Q=1e-6,
        R=0.01,
        parameters={"gain": 1.0},
    )
    return gf.augment(model, parameters={"gain": walk})


def follow(
    update: AbstractUpdate, y: np.ndarray, u: np.ndarray, walk: float = 0.0, noise: gf.noise.AbstractNoise | None = None
) -> gf.filters.Info:
    model = gain_model(walk)
    prior = gf.make_prior(model, {"z": 0.0, "gain": 1.0}, {"z": 0.1, "gain": 0.1})
    estimator = gf.KalmanFilter(update=update, noise=noise or gf.Nominal())
    T = len(y)
    when = Instant(jnp.arange(1.0, T + 1), jnp.ones(T), jnp.asarray(u)[:, None])
    samples = Sample(when, jnp.asarray(y)[:, None], jnp.ones((T, 1), bool))
    return jax.jit(lambda prior, samples: gf.scan(estimator, model, prior, samples)[1])(prior, samples)


@pytest.fixture(scope="module")
def excited() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs of either sign, noise with one outlier in ten, and the gain, which jumps in the middle."""
    rng = np.random.default_rng(5)
    u = rng.choice([-1.0, 1.0], 800)
    noise = np.where(rng.random(800) < 0.1, 1.0, 0.1) * rng.normal(size=800)
    gain = np.where(np.arange(800) < 500, 1.0, 0.7)
    return u, noise, gain


def test_a_jump_is_found_among_outliers_and_widens_only_its_parameter(excited) -> None:
    u, noise, gain = excited
    info = follow(gf.ChangeDetection({"gain": 0.3}), gain * u + noise, u)
    alarm = np.asarray(info.memory[0].alarm[:, 0])
    rows = np.flatnonzero(alarm)
    # Three sigmas of R per sample: two pushes of 1.39 each time, less the allowance, reach 8 in ten samples or so.
    assert rows.size >= 1
    assert 500 <= rows[0] <= 530
    assert alarm[rows[0]] == -1.0
    cov = jax.vmap(lambda each: each.cov)(info.estimate)
    assert cov[rows[0], 1, 1] > 0.09
    assert cov[rows[0], 0, 0] < 0.011
    assert abs(float(info.estimate.mean[-1, 1]) - 0.7) < 0.05


def test_reporting_alone_changes_no_estimate(excited) -> None:
    u, noise, gain = excited
    plain = follow(MasreliezMartin(), gain * u + noise, u)
    watched = follow(gf.ChangeDetection({"gain": 0.3}, action="report"), gain * u + noise, u)
    assert np.any(watched.memory[0].alarm)
    np.testing.assert_allclose(watched.estimate.mean, plain.estimate.mean, atol=1e-13)


def test_outliers_without_a_jump_raise_no_alarm_and_push_either_way(excited) -> None:
    u, noise, _ = excited
    memory = follow(gf.ChangeDetection({"gain": 0.3}, arm_after=0), u + noise, u, walk=0.003).memory[0]
    assert not np.any(memory.alarm)
    score = np.asarray(memory.score[200:, 0])
    # 600 nearly independent scores: five standard deviations of a mean.
    assert abs(score.mean()) < 5 / np.sqrt(600)
    assert 0.7 < score.var() < 1.3


def test_one_outlier_of_any_size_adds_no_more_than_its_bound(excited) -> None:
    u, _, _ = excited
    y = u.copy()
    y[300] += 1e9
    memory = follow(gf.ChangeDetection({"gain": 0.3}), y, u).memory[0]
    bound = huber_threshold(0.1) / np.sqrt(0.671206494546)
    assert abs(float(memory.score[300, 0])) == pytest.approx(bound, rel=1e-6)
    assert not np.any(memory.alarm)


def test_without_excitation_a_capped_walk_stops_and_with_it_nothing_changes(excited) -> None:
    u, noise, _ = excited
    off = np.zeros(800)
    capped = gf.Capped({"gain": 0.2})
    idle, free = (follow(gf.Exact(), noise, off, 0.02, law).estimate for law in (capped, gf.Nominal()))
    variance = [float(each.cov[1, 1]) for each in (_last(idle), _last(free))]
    assert variance[0] == pytest.approx(0.04, rel=1e-9)
    assert variance[1] == pytest.approx(0.01 + 800 * 0.0004, rel=1e-6)
    busy, nominal = (follow(gf.Exact(), u + noise, u, 0.02, law).estimate for law in (capped, gf.Nominal()))
    np.testing.assert_array_equal(busy.mean, nominal.mean)


def _last(estimates: AbstractEstimate) -> AbstractEstimate:
    return jax.tree.map(lambda leaf: leaf[-1], estimates)


def test_a_gate_may_judge_components_one_by_one_or_all_together(problem: Problem) -> None:
    residual = np.array([30.0 * np.sqrt(problem.S[0, 0]), 0.0, 0.0])
    weights = {
        by: problem.act(gf.Gated(by=by), residual=residual, carry=(jnp.zeros(groups, jnp.int32), None)).weight.tolist()
        for by, groups in (("component", 3), ("all", 1), ("sensor", 1))
    }
    assert weights == {"component": [0.0, 1.0, 1.0], "all": [0.0] * 3, "sensor": [0.0] * 3}
