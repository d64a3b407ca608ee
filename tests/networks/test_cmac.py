"""The table learns what the arithmetic says it must, and nothing else."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.networks import (
    CMAC,
    CMAC_PRESETS,
    CMACTraining,
    empty_cmac,
    make_tiling,
    train_by_credit,
    train_by_least_squares,
)


def network_of(inputs: np.ndarray, outputs: int = 1, **options: object) -> CMAC:
    tiling = make_tiling(inputs, **({"compress": "none", "levels": 20, "layers": 5} | options))
    return empty_cmac((tiling,), inputs.shape[1], outputs)


def quanta(levels: int) -> np.ndarray:
    """The middle of each quantum of the box [0, levels]."""
    return np.arange(levels) + 0.5


@pytest.fixture
def inputs(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (200, 2))


TABLES = {
    "dense": {},
    "hashed, some cells shared": {"table": "hashed", "cells": 40},
    "hashed, all in one cell": {"table": "hashed", "cells": 1},
}


@pytest.mark.parametrize("exponent", [0.0, 1.2, 3.0])
@pytest.mark.parametrize("table", TABLES)
def test_one_example_takes_its_share_off_the_error(
    inputs: np.ndarray, rng: np.random.Generator, exponent: float, table: str
) -> None:
    network, step = network_of(inputs, 2, **TABLES[table]), eqx.filter_jit(CMAC.learned)
    for u in jnp.asarray(inputs[:40]):
        target = jnp.asarray(rng.normal(size=2))
        before, network = target - network(u), step(network, u, target, 0.05, exponent)
        np.testing.assert_allclose(target - network(u), 0.95 * before, rtol=0, atol=1e-12)


def test_every_example_visits_every_layer_once(inputs: np.ndarray) -> None:
    trained, _ = train_by_credit(network_of(inputs), inputs, inputs[:, :1], epochs=3, least_visits=0)
    assert float(trained.counts.sum()) == 5 * 3 * len(inputs)


def test_neighbours_share_as_many_cells_as_they_are_close() -> None:
    levels, layers = 23, 5
    network = network_of(np.array([[0.0], [levels]]), levels=levels, layers=layers)
    cells = np.asarray(jax.vmap(network.addresses)(jnp.asarray(quanta(levels))[:, None]))
    shared = (cells[:, None, :] == cells[None, :, :]).sum(axis=-1)
    apart = np.abs(np.subtract.outer(np.arange(levels), np.arange(levels)))
    np.testing.assert_array_equal(shared, np.maximum(0, layers - apart))


def test_inputs_far_apart_in_one_coordinate_share_no_cell() -> None:
    network = network_of(np.array([[0.0, 0.0], [20.0, 20.0]]))
    one, other = (set(np.asarray(network.addresses(jnp.array(u))).tolist()) for u in ([3.5, 7.5], [8.5, 7.5]))
    assert not one & other


def addresses_in_plain_numbers(
    u: np.ndarray, levels: int, layers: int, shift: tuple[int, ...], cells: int
) -> list[int]:
    """The definition, one number after the other, for the box [0, levels]; hashed if there are `cells`."""
    found = []
    blocks = (levels - 1 + layers - 1) // layers + 1
    for layer in range(layers):
        tile = [
            (min(max(int(np.floor(value)), 0), levels - 1) + (layer * p) % layers) // layers
            for value, p in zip(u, shift, strict=True)
        ]
        if cells:
            mixed = 2166136261
            for value in (layer, *tile):
                mixed = ((mixed ^ value) * 16777619) % 2**32
            found.append((mixed ^ (mixed >> 15)) % cells)
        else:
            address = layer
            for value in tile:
                address = address * blocks + value
            found.append(address)
    return found


@pytest.mark.parametrize("cells", [0, 1000])
def test_cells_are_those_of_the_definition(rng: np.random.Generator, cells: int) -> None:
    options = {"table": "hashed", "cells": cells} if cells else {}
    network = network_of(np.array([[0.0, 0.0], [20.0, 20.0]]), displacement=(1, 3), **options)
    for u in rng.uniform(-2.0, 22.0, (30, 2)):
        wanted = addresses_in_plain_numbers(u, 20, 5, (1, 3), cells)
        assert np.asarray(network.addresses(jnp.asarray(u))).tolist() == wanted


def test_without_credit_it_is_albus_rule(inputs: np.ndarray) -> None:
    network = network_of(inputs)
    trained, _ = train_by_credit(network, inputs, inputs[:, 1:] ** 2, rate=0.3, exponent=0.0, least_visits=0)
    weights = np.zeros(len(network.weights))
    for u, target in zip(inputs, inputs[:, 1] ** 2, strict=True):
        cells = np.asarray(network.addresses(jnp.asarray(u)))
        weights[cells] += 0.3 / 5 * (target - weights[cells].sum())
    np.testing.assert_allclose(trained.weights[:, 0], weights, rtol=0, atol=1e-13)


def test_a_hash_without_collisions_is_the_dense_table(inputs: np.ndarray) -> None:
    dense, hashed = network_of(inputs), network_of(inputs, table="hashed")
    pairs = [np.asarray(jax.vmap(each.addresses)(jnp.asarray(inputs))).ravel() for each in (dense, hashed)]
    assert len(set(zip(*pairs, strict=True))) == len(set(pairs[0])) == len(set(pairs[1])), "the hash collides"
    trained = [train_by_credit(each, inputs, inputs[:, :1] ** 3, least_visits=0)[0] for each in (dense, hashed)]
    said = [jax.vmap(each)(jnp.asarray(inputs)) for each in trained]
    np.testing.assert_allclose(said[0], said[1], rtol=0, atol=1e-13)


def test_what_it_can_represent_it_learns_exactly(rng: np.random.Generator) -> None:
    # Twelve inputs of their own quanta: fewer conditions than weights, so that an exact fit exists.
    network = network_of(np.array([[0.0], [20.0]]), levels=20)
    inputs = quanta(20)[rng.choice(20, 12, replace=False)][:, None]
    repeated, targets = np.tile(inputs, (5, 1)), np.tile(rng.normal(size=(12, 1)), (5, 1))
    trained, _ = train_by_credit(network, repeated, targets, rate=0.8, exponent=0.0, epochs=80, least_visits=0)
    np.testing.assert_allclose(jax.vmap(trained)(jnp.asarray(inputs)), targets[:12], rtol=0, atol=1e-9)


def test_of_targets_that_contradict_each_other_it_learns_the_mean(rng: np.random.Generator) -> None:
    inputs, targets = np.zeros((4000, 1)), rng.normal(size=(4000, 1))
    network = network_of(np.array([[-1.0], [1.0]]))
    trained, _ = train_by_credit(network, inputs, targets, rate=0.005, epochs=5, key=jax.random.key(3), least_visits=0)
    # The mean over some 2 / rate examples in random order has a standard error of sqrt(rate / 2) = 0.05 about that of all.
    assert abs(float(trained(jnp.zeros(1))[0]) - targets.mean()) < 3 * 0.05


def test_least_squares_is_the_minimum_of_its_cost(inputs: np.ndarray) -> None:
    network = network_of(inputs, table="hashed", cells=60)
    targets = np.sin(3 * inputs[:, :1])
    trained, _ = train_by_least_squares(network, inputs, targets, ridge=0.7, forgetting=0.99, least_visits=0)

    def cost(weights: jax.Array) -> jax.Array:
        said = jnp.sum(weights[jax.vmap(network.addresses)(jnp.asarray(inputs))], axis=1)
        left = jnp.sum((jnp.asarray(targets) - said) ** 2, axis=1)
        return jnp.sum(0.99 ** jnp.arange(len(inputs) - 1, -1, -1.0) * left) + 0.7 * jnp.sum(weights**2)

    # The sum of some hundred terms of size one: rounding is a few hundred eps.
    np.testing.assert_allclose(jax.grad(cost)(trained.weights), 0.0, rtol=0, atol=1e-11)


def test_tables_of_single_inputs_learn_a_sum_together(inputs: np.ndarray) -> None:
    targets = np.sin(3 * inputs[:, :1]) + inputs[:, 1:] ** 2
    options = {"levels": 40, "layers": 8, "compress": "none", "method": "ridge", "ridge": 1e-3, "least_visits": 0}
    together, report = CMACTraining(groups=((0,), (1,)), **options)(inputs, targets, key=jax.random.key(0))
    assert len(together.tilings) == 2
    # A quantum is 0.05 wide, so steps are up to 0.15 high and 0.15 / sqrt(12) in the root mean square.
    assert report.after[0] < 0.045**2 < 0.1 * report.before[0]
    u, target = jnp.array([0.3, -0.2]), jnp.array([5.0])
    left = target - together.learned(u, target, rate=0.4)(u)
    np.testing.assert_allclose(left, 0.6 * (target - together(u)), rtol=0, atol=1e-12)


def test_compression_gives_small_inputs_more_of_the_levels(rng: np.random.Generator) -> None:
    inputs = np.concatenate([rng.normal(size=(500, 1)), [[-20.0], [20.0]]])

    def levels_within_one(compress: str) -> int:
        network = network_of(inputs, levels=64, layers=1, compress=compress)
        return len(np.unique(jax.vmap(network.addresses)(jnp.linspace(-1.0, 1.0, 401)[:, None])))

    assert levels_within_one("asinh") > 3 * levels_within_one("none")


def test_it_knows_where_it_was_trained(rng: np.random.Generator) -> None:
    inputs = np.concatenate([rng.uniform(0.0, 0.5, (300, 1)), [[1.0]]])
    network, _ = CMACTraining(levels=20, layers=4, compress="none", epochs=1)(inputs, inputs, key=jax.random.key(0))
    assert float(network.visits(jnp.array([0.25]))) > 20
    assert float(network.visits(jnp.array([0.75]))) == 0
    assert bool(network.contains(jnp.array([0.75])))
    assert not bool(network.contains(jnp.array([1.25])))
    # Beyond the box the nearest edge answers.
    np.testing.assert_array_equal(network(jnp.array([-3.0])), network(jnp.array([float(inputs.min())])))


def test_inputs_that_do_not_vary_are_left_out(inputs: np.ndarray) -> None:
    still = np.concatenate([inputs, np.full((len(inputs), 1), 7.0), inputs[:, :1]], axis=1)
    network, report = CMACTraining(least_visits=0)(still, inputs[:, :1], key=jax.random.key(0))
    assert network.tilings[0].columns == (0, 1, 3)
    assert report.dropped == (2,)
    assert report.rank == 2
    assert any("repeat others" in text for text in report.warnings)
    constant, report = CMACTraining(least_visits=0)(still[:, 2:3], inputs[:, :1], key=jax.random.key(0))
    assert any("constant" in text for text in report.warnings)
    assert np.isfinite(constant(jnp.array([7.0]))).all()


def test_the_same_key_gives_the_same_network_to_the_last_bit(inputs: np.ndarray) -> None:
    recipe = CMACTraining(least_visits=0)
    first, again, other = (recipe(inputs, inputs[:, :1], key=jax.random.key(k))[0] for k in (1, 1, 2))
    np.testing.assert_array_equal(first.weights, again.weights)
    assert not np.array_equal(first.weights, other.weights)


def test_presets_are_what_they_say() -> None:
    sizes = {name: (each.levels, each.layers, each.compress) for name, each in CMAC_PRESETS.items()}
    assert sizes == {"recommended": (64, 16, "asinh"), "fine": (100, 10, "none"), "coarse": (10, 4, "none")}
