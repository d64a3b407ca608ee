"""A sensitivity is believed where it is like the nominal one."""

import jax.numpy as jnp
import numpy as np

from gainful.control import weak_inputs

W = jnp.diag(jnp.array([1.0, 2.0, 0.5, 0.0]))


def weak(change: np.ndarray, nominal: jnp.ndarray, least: float = 0.1) -> list[bool]:
    return weak_inputs(nominal @ jnp.asarray(change, float), nominal, W, least).tolist()


def test_inputs_are_named_whose_effect_is_reversed_lost_or_not_a_number(rng: np.random.Generator) -> None:
    nominal = jnp.asarray(np.eye(4, 3) + 0.2 * rng.normal(size=(4, 3)))
    sound = np.eye(3) + 0.1 * rng.normal(size=(3, 3))
    assert weak(sound, nominal) == [False] * 3
    assert weak(np.diag([0.5, 3.0, 0.11]), nominal) == [False] * 3
    assert weak(np.diag([0.5, 3.0, 0.09]), nominal) == [False, False, True]
    assert weak(np.diag([1.0, -1.0, 1.0]), nominal) == [False, True, False]
    # Two inputs that have come to do the same.
    assert weak(np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]), nominal) == [True, True, False]
    assert weak(np.diag([1.0, np.nan, 1.0]), nominal)[1]


def test_units_of_outputs_play_no_part_where_there_are_as_many_as_inputs(rng: np.random.Generator) -> None:
    nominal = jnp.asarray(np.eye(3) + 0.2 * rng.normal(size=(3, 3)))
    units = jnp.asarray([1e-4, 1.0, 1e3])[:, None]
    for factor in (0.09, 0.11):
        H = nominal @ jnp.diag(jnp.array([1.0, factor, 1.0]))
        plain = weak_inputs(H, nominal, jnp.eye(3), 0.1)
        scaled = weak_inputs(units * H, units * nominal, jnp.diag(1.0 / units[:, 0] ** 2), 0.1)
        assert plain.tolist() == scaled.tolist() == [False, factor < 0.1, False]
