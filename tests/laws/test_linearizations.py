"""Every linearization is exact on affine maps, every rule on the moments it promises."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.linearization import AbstractLinearization, AbstractRule, Cubature, GaussHermite, Unscented
from gainful.spaces import Euclidean
from gainful.testing import check_linearization, check_rule

from .parts import LINEARIZATIONS, RULES, flat, name_of

X, Y = Euclidean(("x",)), Euclidean(("y",))


@pytest.mark.parametrize("linearization", flat(LINEARIZATIONS), ids=name_of)
def test_every_linearization_is_exact_on_affine_maps(linearization: AbstractLinearization) -> None:
    # Points at alpha = 0.1 of the spread cost 1 / alpha^2 = 100 of the 1e-13 that dozens of sums of size 1 to 10 cost.
    check_linearization(linearization, tolerance=1e-11)


@pytest.mark.parametrize(("rule", "degree"), flat(RULES), ids=repr)
def test_every_rule_has_the_moments_of_a_standard_normal_vector(rule: AbstractRule, degree: int) -> None:
    check_rule(rule, degree=degree)


@pytest.mark.parametrize("n", [1, 2])
def test_unscented_points_with_kappa_3_minus_n_match_the_fourth_moment_of_each_state(n: int) -> None:
    # Julier and Uhlmann (2004): n + kappa = 3 gives the kurtosis of a Gaussian.
    points, weights, _ = Unscented(kappa=3.0 - n).points(n)
    np.testing.assert_allclose(points**4 @ weights, np.full(n, 3.0), rtol=1e-14)


def test_unscented_points_with_unit_spread_are_cubature_points() -> None:
    points, weights, _ = Unscented(alpha=1.0, beta=0.0, kappa=0.0).points(3)
    expected, expected_weights, _ = Cubature().points(3)
    assert weights[0] == 0.0
    np.testing.assert_array_equal(points[:, 1:], expected)
    np.testing.assert_allclose(weights[1:], expected_weights, rtol=1e-15)


@pytest.mark.parametrize("alpha", [1.0, 0.5, 0.1, 1e-2])
@pytest.mark.parametrize("kind", [gf.Gaussian, gf.SquareRoot])
def test_unscented_variance_of_a_square_is_exact_for_beta_2(alpha: float, kind: type) -> None:
    # y = x^2 for x ~ N(m, s^2): mean m^2 + s^2, variance 4 m^2 s^2 + 2 s^4, of which A P A is the first term.
    m, s = 1.5, 0.4
    estimate = kind.start(jnp.array([m]), jnp.array([[s**2]]), X)
    affine = gf.SigmaPoints(Unscented(alpha=alpha, beta=2.0))(lambda x: x**2, estimate, Y)
    # Differences over alpha are divided by alpha^2.
    tolerance = 16 * np.finfo(float).eps / alpha**2
    np.testing.assert_allclose(affine.value, [m**2 + s**2], rtol=tolerance)
    np.testing.assert_allclose(affine.matrix, [[2 * m]], rtol=tolerance)
    np.testing.assert_allclose(affine.covariance(), [[2 * s**4]], rtol=100 * tolerance)


def test_gauss_hermite_is_exact_for_polynomials_of_its_degree() -> None:
    # y = x^2 needs E x^4: degree 4 <= 2 * 3 - 1.
    estimate = gf.Gaussian.start(jnp.array([1.5]), jnp.array([[0.16]]), X)
    affine = gf.SigmaPoints(GaussHermite(3))(lambda x: x**2, estimate, Y)
    np.testing.assert_allclose(affine.covariance(), [[2 * 0.16**2]], rtol=1e-13)


def test_every_sigma_point_rule_tends_to_taylor_as_the_spread_vanishes() -> None:
    def curve(x: jax.Array) -> jax.Array:
        return jnp.stack([jnp.sin(x[0]) * x[1], jnp.exp(-x[1])])

    space, out = Euclidean(("a", "b")), Euclidean(("y", "z"))
    sigma = 1e-4
    estimate = gf.Gaussian.start(jnp.array([0.3, 0.7]), sigma**2 * jnp.eye(2), space)
    tangent = gf.Taylor()(curve, estimate, out)
    for rule, _ in (entries[0] for entries in RULES.values()):
        found = gf.SigmaPoints(rule)(curve, estimate, out)
        # Second derivatives are of size 1 and third ones too: the slope is off by sigma^2, plus eps / (alpha sigma).
        np.testing.assert_allclose(found.matrix, tangent.matrix, atol=1e-6)
        np.testing.assert_allclose(found.value, tangent.value, atol=10 * sigma**2)


def test_taylor_differentiates_in_tangent_coordinates() -> None:
    # y = log(mass) by way of exp(log): the slope with respect to log(mass) is 1, with respect to mass it would be 1 / m.
    mass = gf.spaces.Positive("mass", "kg")
    estimate = gf.Gaussian.start(jnp.array([4.0]), jnp.array([[0.01]]), mass)
    affine = gf.Taylor()(jnp.log, estimate, Y)
    np.testing.assert_allclose(affine.matrix, [[1.0]], rtol=1e-15)
