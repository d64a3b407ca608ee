"""Every estimate does the same algebra, and keeps its covariance one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gainful as gf
from gainful.estimates import AbstractEstimate, Affine
from gainful.spaces import Euclidean
from gainful.testing import check_estimate
from gainful.testing.comparisons import assert_covariance

from .parts import ESTIMATES, flat, name_of

STATES, OUTPUTS = Euclidean(("a", "b", "c")), Euclidean(("y", "z"))


@pytest.mark.parametrize("cls", flat(ESTIMATES), ids=name_of)
def test_every_estimate_does_the_textbook_algebra(cls: type[AbstractEstimate]) -> None:
    # Condition numbers of the problems are below 1e4 and sums a dozen terms long.
    check_estimate(cls, tolerance=1e-10)


@pytest.fixture(scope="module")
def operations() -> dict[type, object]:
    """Push, condition, add noise and revise in one program per class."""

    def build(cls: type[AbstractEstimate]) -> object:
        def operate(
            root: jax.Array, matrix: jax.Array, noise: jax.Array, y: jax.Array, seen: jax.Array
        ) -> list[jax.Array]:
            none = jnp.zeros((2, 0))
            affine = Affine(jnp.zeros(2), matrix, jnp.zeros(3), noise @ noise.T, none, none, STATES, OUTPUTS)
            estimate = cls.start(jnp.zeros(3), root @ root.T, STATES)
            posterior, _ = estimate.condition(affine.masked(seen), y, seen)
            pushed = estimate.push(affine)
            revised = estimate.revise(affine, pushed.condition(watched(pushed), y, seen)[0])
            return [each.cov for each in (estimate, pushed, posterior, revised, estimate.plus_noise(root.T @ root))]

        return jax.jit(operate)

    def watched(pushed: AbstractEstimate) -> Affine:
        none = jnp.zeros((2, 0))
        return Affine(pushed.mean, jnp.eye(2), pushed.mean, 0.1 * jnp.eye(2), none, none, OUTPUTS, OUTPUTS)

    return {cls: build(cls) for cls in flat(ESTIMATES)}


entries = st.floats(-1.0, 1.0, width=32)
exponents = st.integers(-4, 4)


@pytest.mark.parametrize("cls", flat(ESTIMATES), ids=name_of)
@given(data=st.data())
def test_covariances_stay_symmetric_and_positive_semidefinite(
    cls: type[AbstractEstimate], operations: dict[type, object], data: st.DataObject
) -> None:
    """For covariances of any rank whose units differ by up to eight orders of magnitude."""

    def draw(rows: int, columns: int) -> np.ndarray:
        values = data.draw(st.lists(entries, min_size=rows * columns, max_size=rows * columns))
        scales = data.draw(st.lists(exponents, min_size=rows, max_size=rows))
        return np.array(values).reshape(rows, columns) * 10.0 ** np.array(scales, dtype=float)[:, None]

    root, matrix = draw(3, 3), draw(2, 3)
    # Noise may be as small as 1e-8 of what is seen through the map, but not absent: S must have an inverse.
    noise = np.diag(10.0 ** np.array(data.draw(st.lists(exponents, min_size=2, max_size=2)), dtype=float))
    seen = np.array(data.draw(st.lists(st.booleans(), min_size=2, max_size=2)))
    covs = operations[cls](*map(jnp.asarray, (root, matrix, noise, np.ones(2), seen)))  # type: ignore[operator]
    for name, cov in zip(("start", "push", "condition", "revise", "plus_noise"), covs, strict=True):
        # Joseph's form adds squares that are exact to eps of the prior, which a good measurement can shrink: judged
        # against the posterior's own deviations that is eps times the ratio of the two, at most 1e4^2 here.
        assert_covariance(cov, f"{cls.__name__}: {name}", tolerance=1e-6 if cls is gf.Gaussian else 1e-12)
    if not seen.any():
        np.testing.assert_allclose(covs[2], covs[0], rtol=1e-12, atol=1e-12 * np.abs(covs[0]).max())


@pytest.mark.parametrize("cls", flat(ESTIMATES), ids=name_of)
def test_a_measurement_never_makes_an_estimate_less_certain(
    cls: type[AbstractEstimate], operations: dict[type, object]
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        root, matrix, noise = rng.normal(size=(3, 3)), rng.normal(size=(2, 3)), np.diag(rng.uniform(0.1, 1, 2))
        prior, _, posterior, revised, more = operations[cls](
            *map(jnp.asarray, (root, matrix, noise, np.ones(2), [True] * 2))
        )  # type: ignore[operator]
        for smaller, larger in ((posterior, prior), (revised, prior), (prior, more)):
            assert np.linalg.eigvalsh(np.asarray(larger - smaller)).min() >= -1e-12 * np.trace(larger)
