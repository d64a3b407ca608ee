"""The small linear algebra keeps its laws, for singular matrices and whatever the units."""

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gainful.linalg import downdate, inverse_lower, root, root_and_inverse, triangularize

EPS = np.finfo(float).eps
N, LARGE = 4, 30  # LARGE is beyond the unrolled path


@pytest.fixture(scope="module")
def compiled() -> dict[str, object]:
    return {fn.__name__: jax.jit(fn) for fn in (root, root_and_inverse, inverse_lower, triangularize, downdate)}


def matrices(rows: int, columns: int) -> st.SearchStrategy[np.ndarray]:
    """Small whole numbers, so that exact dependence between rows occurs, in units up to eight orders apart."""
    entries = st.lists(st.integers(-3, 3), min_size=rows * columns, max_size=rows * columns)
    units = st.lists(st.integers(-4, 4), min_size=rows, max_size=rows)
    return st.builds(
        lambda values, powers: (
            np.array(values, float).reshape(rows, columns) * 10.0 ** np.array(powers, float)[:, None]
        ),
        entries,
        units,
    )


@given(factor=matrices(N, N))
def test_a_root_squares_to_its_matrix_whatever_the_rank(compiled: dict, factor: np.ndarray) -> None:
    matrix = factor @ factor.T
    lower, valid = compiled["root"](matrix)
    assert valid
    assert not np.any(np.triu(lower, 1))
    assert np.diagonal(lower).min() >= 0
    # Dropping a pivot below 8 n eps of its diagonal entry costs that much, in that entry's unit.
    unit = np.sqrt(np.diagonal(matrix))
    assert np.all(np.abs(np.asarray(lower @ lower.T) - matrix) <= 16 * N * EPS * np.outer(unit, unit))


@given(factor=matrices(N, N))
def test_a_root_and_its_inverse_undo_each_other_where_there_is_something_to_undo(
    compiled: dict, factor: np.ndarray
) -> None:
    matrix = factor @ factor.T
    lower, inverse, valid = (np.asarray(part) for part in compiled["root_and_inverse"](matrix))
    np.testing.assert_array_equal(lower, compiled["root"](matrix)[0])
    present = np.diagonal(lower) > 0
    assert valid
    assert not np.any(inverse[~present])
    # Pivots reach down to 3e-7 of a unit before they count as zero: the correlations' condition is below 1e13, but the
    # triangular inverse is accurate to the condition of the rows it meets, here of whole numbers: below 1e4.
    identity = (inverse @ lower)[np.ix_(present, present)]
    np.testing.assert_allclose(identity, np.eye(present.sum()), atol=1e-9)
    # Column j of the inverse is in units of one over those of row j.
    again = np.asarray(compiled["inverse_lower"](lower))
    unit = np.sqrt(np.diagonal(matrix))
    np.testing.assert_allclose(((again - inverse) * unit)[np.ix_(present, present)], 0.0, atol=1e-9)


@given(columns=matrices(N, 6))
def test_triangularizing_keeps_the_product(compiled: dict, columns: np.ndarray) -> None:
    lower = np.asarray(compiled["triangularize"](columns))
    assert not np.any(np.triu(lower, 1))
    assert np.diagonal(lower).min() >= 0
    unit = np.linalg.norm(columns, axis=1)
    # Householder's backward error is row-wise: a few eps times the row's own length per reflection.
    assert np.all(np.abs(lower @ lower.T - columns @ columns.T) <= 40 * N * EPS * np.outer(unit, unit))


def test_triangularizing_does_not_square_what_is_small() -> None:
    # 1 and 1e-12 side by side: in the product the small one is below eps of the large one.
    lower = np.asarray(triangularize(np.array([[1.0, 0.0], [1.0, 1e-12]])))
    np.testing.assert_allclose(lower, [[1.0, 0.0], [1.0, 1e-12]], rtol=1e-15)


@given(factor=matrices(N, N), share=st.floats(0.0, 0.99), direction=st.lists(st.floats(-1, 1), min_size=N, max_size=N))
def test_a_downdate_takes_away_what_it_was_told(
    compiled: dict, factor: np.ndarray, share: float, direction: list[float]
) -> None:
    # A column inside the range, of less than unit length in whitened coordinates, leaves a covariance.
    d = np.array(direction)
    d = d / max(np.linalg.norm(d), 1e-3) * np.sqrt(share)
    lower, _ = (
        np.asarray(part) for part in compiled["root"](factor @ factor.T + np.diag(np.diagonal(factor @ factor.T)))
    )
    column = lower @ d
    new, valid = compiled["downdate"](lower, column)
    assert valid
    unit = np.linalg.norm(lower, axis=1)
    expected = lower @ lower.T - np.outer(column, column)
    # Hyperbolic rotations lose 1 / (1 - share) in accuracy.
    assert np.all(np.abs(np.asarray(new @ new.T) - expected) <= 1e3 * EPS / (1 - share) * np.outer(unit, unit))


def test_a_downdate_that_takes_too_much_is_refused_and_changes_nothing() -> None:
    lower = np.array([[1.0, 0.0], [0.5, 0.2]])
    new, valid = downdate(lower, np.array([1.1, 0.0]))
    assert not valid
    np.testing.assert_array_equal(new, lower)


def test_an_indefinite_matrix_has_no_root() -> None:
    for matrix in ([[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]]):
        assert not root(np.array(matrix))[1]


@pytest.mark.parametrize("rank", [LARGE, LARGE // 2])
def test_large_matrices_obey_the_same_laws(rank: int, rng: np.random.Generator, compiled: dict) -> None:
    factor = rng.normal(size=(LARGE, rank))
    matrix = factor @ factor.T
    lower, inverse, valid = (np.asarray(part) for part in compiled["root_and_inverse"](matrix))
    scale = np.abs(matrix).max()
    assert valid
    assert not np.any(np.triu(lower, 1))
    np.testing.assert_allclose(lower @ lower.T, matrix, atol=1e-12 * scale)
    if rank == LARGE:
        np.testing.assert_allclose(inverse @ lower, np.eye(LARGE), atol=1e-9)
    np.testing.assert_allclose(
        np.asarray(compiled["triangularize"](factor)) @ np.asarray(compiled["triangularize"](factor)).T,
        matrix,
        atol=1e-12 * scale,
    )
