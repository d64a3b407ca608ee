"""The two-stage estimate is the joint one in other coordinates: identities of the algebra, with tolerances from rounding."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.estimates import Affine, Friedland, Gaussian, TwoStage
from gainful.filters import (
    GeneralizedLikelihoodRatio,
    InteractingMultipleModel,
    two_stage_extended_kalman_filter,
    two_stage_unscented_kalman_filter,
)
from gainful.linearization import GaussHermite, MarginalSigmaPoints, SigmaPoints, Unscented
from gainful.spaces import Euclidean, Product
from gainful.updates import InnovationScaling, StrongTracking

ROUNDING = 1e-11  # a few hundred products of numbers of order one


def joint_space(n, p):
    names = [f"x{i}" for i in range(n)], [f"b{i}" for i in range(p)]
    return Product([Euclidean(tuple(names[0])), Euclidean(tuple(names[1]))], added=p)


def random_covariance(rng, size):
    root = rng.normal(size=(size, size))
    return root @ root.T / size


def affine_map(rng, matrix, noise, inner, outer):
    size = outer.dof
    value, none = jnp.asarray(rng.normal(size=size)), jnp.zeros((size, 0))
    at = jnp.asarray(rng.normal(size=inner.dof))
    return Affine(value, jnp.asarray(matrix), at, jnp.asarray(noise), none, none, inner, outer)


def steps_of(kinds, n, p, m, *, coupled, walking=True, rows=30, seed=0):
    """Joint means, covariances, innovations and their covariances along a random time-varying system, per kind."""
    rng, space, output = np.random.default_rng(seed), joint_space(n, p), Euclidean(tuple(f"y{i}" for i in range(m)))
    start = random_covariance(rng, n + p)
    estimates = [kind.start(jnp.zeros(n + p), jnp.asarray(start), space) for kind in kinds]
    out = [[] for _ in kinds]
    for _ in range(rows):
        matrix = rng.normal(size=(n + p, n + p)) / np.sqrt(n + p)
        matrix[n:, n:] = np.eye(p) + 0.2 * rng.normal(size=(p, p)) / p
        if not coupled:
            matrix[n:, :n] = 0.0
        noise = random_covariance(rng, n + p)  # states and biases correlated
        if not walking:
            noise[n:], noise[:, n:] = 0.0, 0.0
        push = affine_map(rng, matrix, noise, space, space)
        sense = affine_map(rng, rng.normal(size=(m, n + p)), random_covariance(rng, m) + 0.1 * np.eye(m), space, output)
        y = jnp.asarray(rng.normal(size=m))
        for i, estimate in enumerate(estimates):
            estimates[i], innovation = estimate.push(push).condition(sense, y, jnp.ones(m, bool))
            out[i].append((estimates[i].mean, estimates[i].cov, innovation.residual, innovation.cov))
    return [[np.stack(values) for values in zip(*rows, strict=True)] for rows in out]


def furthest(one, other):
    return max(np.abs(a - b).max() / max(np.abs(b).max(), 1.0) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("coupled", [False, True], ids=["biases of their own", "biases driven by the state"])
@pytest.mark.parametrize(("n", "p", "m"), [(3, 2, 2), (2, 4, 1), (4, 1, 3)])
def test_the_two_stage_estimate_equals_the_joint_one_on_any_linear_system(n, p, m, coupled):
    two, joint = steps_of([TwoStage, Gaussian], n, p, m, coupled=coupled)
    assert furthest(two, joint) < ROUNDING


def test_friedlands_form_is_the_joint_filter_for_constant_biases_only():
    two, joint = steps_of([Friedland, Gaussian], 3, 2, 2, coupled=False, walking=False)
    assert furthest(two, joint) < ROUNDING
    two, joint = steps_of([Friedland, Gaussian], 3, 2, 2, coupled=False)
    assert furthest(two, joint) > 0.1


def test_the_separate_covariances_add_up_and_survive_inflation_by_twelve_decades():
    rng, space = np.random.default_rng(3), joint_space(3, 2)
    estimate = TwoStage.start(jnp.zeros(5), jnp.asarray(random_covariance(rng, 5)), space)
    n = 3
    assert np.linalg.eigvalsh(estimate.cov[:n, :n] - estimate.base_cov)[0] > -1e-14
    grown = estimate.plus_noise(jnp.diag(jnp.array([0.0, 0.0, 0.0, 1e12, 1e12])))
    assert np.linalg.eigvalsh(grown.base_cov)[0] > 0


# A spacecraft-like toy: coupled rates, an angle, a torque offset and a loss of effectiveness.
def rates(x, u, t):
    w1, w2, angle = x
    return jnp.array([-0.5 * w1 * w2 + u[0], 0.3 * w1**2 - 0.2 * w2 + u[1], w1 + 0.1 * jnp.sin(angle)])


@pytest.fixture(scope="module")
def problem():
    base = gf.continuous_model(
        rates,
        lambda x, u, t: jnp.array([x[0], x[1] + 0.1 * x[2] ** 2]),
        states=["w1", "w2", "angle"],
        outputs=["gyro1", "gyro2"],
        inputs=["torque1", "torque2"],
        Q=[1e-4, 1e-4, 1e-6],
        R=[1e-3, 1e-3],
    )
    model = gf.augment(base, biases={"torque1": 0.02, "gyro2": 0.01})
    prior = gf.make_prior(model, [0.1, -0.2, 0.3, 0.0, 0.0], [0.1, 0.1, 0.1, 0.05, 0.05])
    t = np.arange(0.0, 6.0, 0.1)
    u = np.stack([0.3 * np.sin(t), 0.2 * np.cos(0.7 * t)], axis=1)
    log = gf.draw_log(model, prior, t, u, key=jax.random.key(1))
    return model, prior, log


def of(problem, estimator):
    model, prior, log = problem
    return gf.run(estimator, model, prior, log)


def assert_equal_runs(one, other, tolerance):
    assert np.abs(one.mean - other.mean).max() < tolerance
    assert np.abs(one.cov - other.cov).max() < tolerance
    assert np.abs(one.residual_cov - other.residual_cov).max() < tolerance


def test_the_two_stage_extended_filter_equals_the_augmented_one(problem):
    assert_equal_runs(of(problem, two_stage_extended_kalman_filter()), of(problem, gf.extended_kalman_filter()), 1e-12)


def test_with_points_over_the_joint_state_the_two_stage_unscented_filter_equals_the_augmented_one(problem):
    two = of(problem, two_stage_unscented_kalman_filter(form="augmented"))
    assert_equal_runs(two, of(problem, gf.unscented_kalman_filter()), 1e-12)


def test_points_over_the_states_alone_come_close_to_points_over_the_joint_state(problem):
    joint = of(problem, gf.unscented_kalman_filter())
    for form in ("rao_blackwell", "bias_free"):
        two = of(problem, two_stage_unscented_kalman_filter(form=form))
        # They differ in fourth moments: far below a standard deviation.
        assert (np.abs(two.mean - joint.mean) / joint.std).max() < 0.02


def test_smoothing_in_two_stages_equals_smoothing_the_joint_state(problem):
    two, joint = (gf.smooth(of(problem, f)) for f in (two_stage_extended_kalman_filter(), gf.extended_kalman_filter()))
    assert_equal_runs(two, joint, 1e-11)


@pytest.mark.parametrize("form", ["augmented", "bias_free", "rao_blackwell"])
@pytest.mark.parametrize("alpha", [1.0, 0.1])
def test_on_a_linear_model_all_forms_are_the_kalman_filter(form, alpha):
    base = gf.linear_model(
        [[1.0, 0.1], [-0.1, 0.9]], [[1.0, 0.0]], B=[[0.0], [0.1]], Q=[1e-3, 1e-3], R=0.01, inputs=["u"], outputs=["y"]
    )
    model = gf.augment(base, biases={"u": 0.1})
    prior = gf.make_prior(model, [0.0, 0.0, 0.0], [1.0, 1.0, 0.5])
    t = np.arange(0.0, 3.0, 0.1)
    log = gf.draw_log(model, prior, t, np.sin(t)[:, None], key=jax.random.key(2))
    two = gf.run(two_stage_unscented_kalman_filter(form=form, alpha=alpha), model, prior, log)
    # A small alpha cancels 1 / alpha^2 of the digits.
    assert_equal_runs(two, gf.run(gf.kalman_filter(), model, prior, log), ROUNDING / alpha**2)


def quadratic(z):
    """A quadratic in the state, affine in the bias with a gain that depends on the state."""
    x, y, b = z
    return jnp.array([x + 0.1 * x * y, 0.95 * y + 0.1 * x**2]) + jnp.array([0.1 + 0.05 * x, 0.2]) * b


def test_rao_blackwell_points_lose_nothing_and_bias_free_points_the_curvature_along_the_bias():
    space, out = joint_space(2, 1), Euclidean(("x", "y"))
    base_cov, coupling = jnp.array([[0.04, 0.01], [0.01, 0.09]]), jnp.array([[0.3], [-0.2]])
    estimate = TwoStage(jnp.array([0.5, -0.3, 0.4]), base_cov, jnp.array([[0.25]]), coupling, space)
    exact = SigmaPoints(GaussHermite(5))(quadratic, estimate, out)
    marginal = MarginalSigmaPoints(Unscented(), "rao_blackwell")(quadratic, estimate, out)
    assert np.abs(marginal.value - exact.value).max() < 1e-15
    assert np.abs((marginal.matrix - exact.matrix) @ estimate.cov).max() < 1e-15
    # 0.1 V1 V2 Pb and 0.1 V1^2 Pb, by hand; the former also moves with B, 0.05 V1 Pb.
    bias_free = MarginalSigmaPoints(Unscented())(quadratic, estimate, out)
    by_hand = np.array([0.1 * 0.3 * -0.2 * 0.25 + 0.05 * 0.3 * 0.25, 0.1 * 0.3**2 * 0.25])
    assert np.abs(exact.value - bias_free.value - by_hand).max() < 1e-15


def test_a_missing_sample_leaves_biases_and_coupling(problem):
    model, prior, log = problem
    y = log.y.copy()
    y[20] = np.nan
    u = log.u
    bare = gf.run(two_stage_extended_kalman_filter(), model, prior, gf.make_log(model, log.t, y, u))
    estimates = bare.estimates
    assert np.array_equal(np.asarray(estimates.mean)[20, 3:], np.asarray(estimates.mean)[19, 3:])
    walk = np.diag([0.02**2, 0.01**2]) * 0.1  # densities times the step [s]
    assert np.allclose(estimates.bias_cov[20], estimates.bias_cov[19] + walk, rtol=1e-12)


@pytest.mark.parametrize(
    "update", [InnovationScaling(gate=0.0), InnovationScaling(cap=1.0, gate=1.0), StrongTracking(cap=1.0)]
)
def test_adaptation_that_never_acts_changes_no_bit(problem, update, as_users_compile):
    adaptive = of(problem, two_stage_unscented_kalman_filter(update=update))
    plain = of(problem, two_stage_unscented_kalman_filter())
    assert np.array_equal(adaptive.mean, plain.mean)
    assert np.array_equal(adaptive.cov, plain.cov)


@pytest.mark.parametrize("update", [InnovationScaling(gate=1.0, window=3), StrongTracking(softening=1.0)])
def test_smoothing_knows_what_an_update_within_an_iterated_one_added(problem, update):
    """With one iteration it is the same update, so the smoother must be told the same."""
    once, plain = (
        gf.smooth(of(problem, two_stage_extended_kalman_filter(update=each)))
        for each in (gf.Iterated(update, iterations=1), update)
    )
    assert np.abs(once.mean - plain.mean).max() < 1e-12
    assert np.abs(plain.mean - gf.smooth(of(problem, two_stage_extended_kalman_filter())).mean).max() > 1e-4


def test_process_noise_of_an_actuator_bias_does_not_reach_the_innovation_of_its_own_step():
    """The bias acts on the next state, so scaling its noise changes the coupling and the state's own share alike."""
    rng = np.random.default_rng(5)
    space, out = joint_space(2, 1), Euclidean(("y",))
    start = TwoStage.start(jnp.zeros(3), jnp.asarray(random_covariance(rng, 3)), space)
    matrix = np.block([[rng.normal(size=(2, 2)), rng.normal(size=(2, 1))], [np.zeros((1, 2)), np.eye(1)]])
    spreads = []
    for scale in (1.0, 1e6):
        noise = np.diag([0.1, 0.1, 0.01 * scale])
        prior = start.push(affine_map(np.random.default_rng(6), matrix, noise, space, space))
        sense = affine_map(np.random.default_rng(7), np.array([[1.0, 0.5, 0.0]]), np.eye(1), space, out)
        spreads.append(float(prior.condition(sense, jnp.zeros(1), jnp.ones(1, bool))[1].cov[0, 0]))
    assert spreads[1] == pytest.approx(spreads[0], rel=1e-9)  # 1e6 of rounding


def test_a_bank_of_equal_filters_is_the_filter(problem):
    one = two_stage_extended_kalman_filter()
    bank = InteractingMultipleModel((one, one), ((0.9, 0.1), (0.3, 0.7)))
    banked, single = of(problem, bank), of(problem, one)
    assert_equal_runs(banked, single, 1e-10)
    assert np.abs(banked.log_likelihood - single.log_likelihood).max() < 1e-9


def test_without_an_alarm_the_jump_bank_is_its_quiet_filter(problem):
    quiet = two_stage_extended_kalman_filter()
    jumps = of(problem, GeneralizedLikelihoodRatio(quiet, threshold=np.inf))
    assert np.array_equal(jumps.mean, of(problem, quiet).mean)
