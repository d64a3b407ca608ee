"""Radial basis networks: what their features are, and their slopes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.networks import ProductFeatures, make_radial_basis, product_features_of, thin_plate
from gainful.networks.radial_basis import typical_thin_plate

GAIN, CENTRES, CONTROLS = 0.3, 200, 3
SCALE = np.array([20.0] * 3 + [0.5] * 3 + [0.04, 5e-4, 5e-3] + [0.05] * 3 + [0.1, 3e-3, 0.03])


def closed_form(network, z: np.ndarray, printed: bool = False) -> np.ndarray:
    """Slopes of the outputs with the scaled controls, written out, with the centre of a product or as Eq. 19 prints it."""
    weights, centres = np.asarray(network.weights), np.asarray(network.centres)
    scaled, d = GAIN * z / SCALE, len(SCALE)
    place = {pair: d + k for k, pair in enumerate((i, j) for i in range(d) for j in range(i + 1, d))}
    lifted = np.concatenate([scaled, [scaled[i] * scaled[j] for i, j in place]])
    squares = np.sum((lifted - centres) ** 2, axis=1)
    slopes = np.zeros((weights.shape[1], CONTROLS))
    for i in range(CONTROLS):
        bracket = scaled[i] - centres[:, i]
        for r in range(d):
            if r == i:
                continue
            if printed:
                bracket = bracket + scaled[r] * (scaled[r] * scaled[r] - centres[:, r])
            else:
                bracket = bracket + scaled[r] * (scaled[i] * scaled[r] - centres[:, place[min(i, r), max(i, r)]])
        mu = 20.0 * np.log(40.0)
        slopes[:, i] = GAIN / mu * weights.T @ ((np.log(squares) + 1.0) * bracket)
    return slopes


def test_products_are_in_lexicographic_order_and_there_are_no_squares(rng: np.random.Generator) -> None:
    z = rng.normal(size=15)
    lifting = ProductFeatures(SCALE, GAIN)
    scaled = GAIN * z / SCALE
    pairs = [scaled[i] * scaled[j] for i in range(15) for j in range(i + 1, 15)]
    assert lifting.size == 120
    np.testing.assert_allclose(lifting.lift(jnp.asarray(z)), [*scaled, *pairs], rtol=1e-15)
    plain = ProductFeatures(SCALE, GAIN, products=False)
    np.testing.assert_allclose(plain.lift(jnp.asarray(z)), scaled, rtol=1e-15)


def test_the_slope_is_the_published_one_with_the_centre_of_the_product(rng: np.random.Generator) -> None:
    network = make_radial_basis(ProductFeatures(SCALE, GAIN), 12, CENTRES, rng=rng)
    network = network.with_weights(jnp.asarray(rng.normal(size=(CENTRES, 12))))
    slope = jax.jit(jax.jacfwd(network))
    for z in rng.uniform(-1.0, 1.0, (3, 15)) * SCALE:
        found = np.asarray(slope(jnp.asarray(z)))[:, :CONTROLS] * SCALE[:CONTROLS]
        right, printed = closed_form(network, z), closed_form(network, z, printed=True)
        size = np.abs(right).max()
        # 200 products of weights near 1, summed: some hundreds of roundings of what the sum is of the size of.
        np.testing.assert_allclose(found, right, rtol=0, atol=1e-12 * size)
        assert np.abs(printed - right).max() > 0.1 * size


def test_a_thin_plate_is_flat_and_zero_at_its_centre(rng: np.random.Generator) -> None:
    network = make_radial_basis(ProductFeatures(np.ones(4), 1.0), 1, 3, rng=rng)
    # An input of which the lifted coordinates are a centre.
    at = jnp.asarray(rng.normal(size=4))
    network = network.with_weights(jnp.array([[1.0], [0.0], [0.0]]))
    network = type(network)(
        network.weights,
        network.centres.at[0].set(network.lifting.lift(at)),
        network.lifting,
        network.width,
    )
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(lambda u: network(u)[0])))(at[None])
    assert value[0] == 0.0
    np.testing.assert_array_equal(slope, np.zeros((1, 4)))
    assert thin_plate(jnp.array(0.0)) == 0.0


def test_a_thin_plate_is_near_one_at_a_typical_distance() -> None:
    assert typical_thin_plate(120) == pytest.approx(20 * np.log(40), rel=1e-15)
    for size in (2, 9, 120):
        near = float(thin_plate(jnp.array(size / 3.0))) / typical_thin_plate(size)
        assert -1.0 < near <= 1.0 + 1e-15
    assert float(thin_plate(jnp.array(40.0))) / typical_thin_plate(120) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(("tail", "size"), [("affine", 16), ("lift", 121)])
def test_without_centres_it_is_an_affine_or_a_bilinear_regression(
    tail: str, size: int, rng: np.random.Generator
) -> None:
    lifting = ProductFeatures(SCALE, GAIN)
    network = make_radial_basis(lifting, 12, 0, tail=tail)
    u = jnp.asarray(rng.normal(size=15) * SCALE)
    assert network.weights.shape == (size, 12)
    np.testing.assert_array_equal(network.features(u), jnp.concatenate([jnp.ones(1), lifting.lift(u)[: size - 1]]))


def test_a_gaussian_is_one_at_its_centre_and_falls_with_its_width() -> None:
    lifting = ProductFeatures([1.0], 1.0, products=False)
    network = make_radial_basis(lifting, 1, 1, kernel="gaussian", width=2.0, placement="examples", examples=[[0.5]])
    assert network.features(jnp.array([0.5]))[0] == 1.0
    assert float(network.features(jnp.array([2.5]))[0]) == pytest.approx(np.exp(-0.5), rel=1e-15)


@pytest.mark.parametrize("placement", ["box", "examples", "clusters"])
def test_centres_are_where_they_were_asked_for_and_repeat_themselves(placement: str, rng: np.random.Generator) -> None:
    examples = rng.uniform(-1.0, 1.0, (80, 3)) + np.array([10.0, 0.0, 0.0])
    lifting = product_features_of(examples, gain=1.0)
    first, again = (
        make_radial_basis(lifting, 1, 7, placement=placement, examples=examples, rng=3).centres for _ in range(2)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first).max() <= 1.0
    lifted = np.asarray(jax.vmap(lifting.lift)(jnp.asarray(examples)))
    distance = np.linalg.norm(lifted[:, None] - np.asarray(first)[None], axis=2).min(axis=0)
    assert (distance == 0).all() == (placement == "examples")
    if placement == "clusters":
        # The mean of a cluster is nearer to its members than some centre anywhere in the box.
        box = make_radial_basis(lifting, 1, 7, rng=3).centres
        spread = [np.linalg.norm(lifted[:, None] - np.asarray(c)[None], axis=2).min(axis=1).sum() for c in (first, box)]
        assert spread[0] < spread[1]


def test_the_scales_of_examples_put_them_between_minus_one_and_one(rng: np.random.Generator) -> None:
    examples = np.concatenate([rng.normal(size=(30, 2)) * [1.0, 50.0] + [5.0, -1e3], np.full((30, 1), 7.0)], axis=1)
    scaled = np.asarray(jax.vmap(product_features_of(examples, gain=1.0).scaled)(jnp.asarray(examples)))
    np.testing.assert_allclose(scaled.max(axis=0), [1.0, 1.0, 0.0], rtol=1e-12)
    np.testing.assert_allclose(scaled.min(axis=0), [-1.0, -1.0, 0.0], rtol=1e-12)


def test_inputs_far_out_of_their_range_are_known_for_it() -> None:
    network = make_radial_basis(ProductFeatures([1.0, 10.0]), 1, 9)
    assert bool(network.contains(jnp.array([1.4, -14.0])))
    assert not bool(network.contains(jnp.array([0.0, -16.0])))
    assert network.cautions() == ()
    assert "at least 5" in make_radial_basis(ProductFeatures([1.0, 10.0]), 1, 4).cautions()[0]
    assert make_radial_basis(ProductFeatures([1.0, 10.0]), 1, 4, tail="affine").cautions() == ()


def test_units_and_the_order_of_inputs_do_not_matter(rng: np.random.Generator) -> None:
    """A channel in other units with its scale gives the same; so do signals relabelled, with centres to match."""
    z, weights = rng.normal(size=4), rng.normal(size=(6, 2))
    scale = np.array([1.0, 2.0, 3.0, 4.0])
    network = make_radial_basis(ProductFeatures(scale), 2, 6, rng=1).with_weights(jnp.asarray(weights))
    units = np.array([1e3, 1e-6, 57.3, 1.0])
    other = make_radial_basis(ProductFeatures(scale * units), 2, 6, rng=1).with_weights(jnp.asarray(weights))
    np.testing.assert_allclose(other(jnp.asarray(z * units)), network(jnp.asarray(z)), rtol=1e-12)
    order = np.array([2, 0, 3, 1])
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    places = [4 + pairs.index((min(order[i], order[j]), max(order[i], order[j]))) for i, j in pairs]
    relabelled = type(network)(
        network.weights[:, ::-1],
        network.centres[:, np.concatenate([order, places])],
        ProductFeatures(scale[order]),
        network.width,
    )
    np.testing.assert_allclose(relabelled(jnp.asarray(z[order]))[::-1], network(jnp.asarray(z)), rtol=1e-12)
