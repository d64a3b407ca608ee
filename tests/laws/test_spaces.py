"""Every space keeps its laws, at random points and at points hypothesis looks for."""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gainful as gf
from gainful.spaces import AbstractSpace, Interval, Positive, make_space
from gainful.testing import check_space, point_of

from .parts import SPACES, flat, name_of

ROUNDING = 64 * np.finfo(float).eps


@pytest.mark.parametrize("space", flat(SPACES), ids=name_of)
def test_every_space_keeps_its_laws(space: AbstractSpace, key: jax.Array) -> None:
    check_space(space, key)


@functools.cache
def compiled(space: AbstractSpace) -> Any:
    """Round trips from the space's own point: there and back, and from one point to another."""

    origin = point_of(space)

    def trips(a: jax.Array, b: jax.Array, d: jax.Array) -> dict[str, jax.Array]:
        x, y = space.plus(origin, a), space.plus(origin, b)
        there = space.plus(x, space.minus(y, x))
        moved = space.plus(x, d)
        return {
            "stay": space.minus(space.plus(x, jnp.zeros(space.dof)), x),
            "back": space.minus(moved, x) - d,
            "reach": space.minus(there, y),
            "defect": jnp.abs(jnp.concatenate([space.defect(p) for p in (x, y, there, moved)])),
        }

    return jax.jit(trips)


@pytest.mark.parametrize("space", [entries[0] for entries in SPACES.values()], ids=name_of)
@given(data=st.data())
def test_there_and_back_is_no_move(space: AbstractSpace, data: st.DataObject) -> None:
    # Moves up to 3 stay inside a half turn of a rotation vector and off the flat ends of a logit; those from x are
    # shorter than pi / 2 so that an angle is not told from its complement.
    wide, short = (
        st.lists(st.floats(-bound, bound, width=32), min_size=space.dof, max_size=space.dof) for bound in (3.0, 0.875)
    )
    a, b, d = (np.array(data.draw(strategy)) for strategy in (wide, wide, short))
    found = {name: np.asarray(value) for name, value in compiled(space)(a, b, d).items()}
    # At the ends of those moves a logit has the slope cosh(3 / 2)^2 * 4 < 25 and coordinates are below 1e2 of its steps.
    bound = 100 * ROUNDING
    for law in ("stay", "back", "reach"):
        assert np.abs(found[law]).max() <= bound, law
    assert not np.any(found["defect"])


@pytest.mark.parametrize("space", [*SPACES[Positive], *SPACES[Interval]], ids=lambda space: space.names[0])
@given(moves=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=8))
def test_no_sequence_of_moves_leaves_the_bounds(space: AbstractSpace, moves: list[float]) -> None:
    lower, upper = (space.lower, space.upper) if isinstance(space, Interval) else (0.0, np.inf)
    x = point_of(space)
    step = stepper(space)
    for move in moves:
        x, defect = step(x, np.array([move]))
        assert lower < float(x[0]) < upper
        assert float(defect[0]) == 0.0


@functools.cache
def stepper(space: AbstractSpace) -> Any:
    """A move and the defect of where it leads."""

    def step(x: jax.Array, d: jax.Array) -> tuple[jax.Array, jax.Array]:
        moved = space.plus(x, d)
        return moved, space.defect(moved)

    return jax.jit(step)


@pytest.mark.parametrize("space", flat(SPACES), ids=name_of)
def test_single_precision_points_stay_single(space: AbstractSpace) -> None:
    x, d = point_of(space).astype(jnp.float32), jnp.full(space.dof, 0.1, jnp.float32)
    moved = jax.eval_shape(space.plus, x, d)
    assert moved.dtype == jnp.float32
    assert jax.eval_shape(space.minus, x, x).dtype == jnp.float32


def test_a_mapping_of_signals_makes_the_spaces_it_names() -> None:
    space = make_space({"x": "m", "v": "m/s", "h": "angle", "q": "quaternion", "m": (0, None), "e": (0, 1), "z": "1"})
    assert [type(part).__name__ for part in space.parts] == [
        "Euclidean",
        "Circle",
        "Quaternion",
        "Positive",
        "Interval",
        "Euclidean",
    ]
    assert (space.size, space.dof) == (10, 9)
    assert isinstance(space, gf.spaces.Product)
