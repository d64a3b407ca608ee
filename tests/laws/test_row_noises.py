"""Every row noise is a covariance on average over rows, and the same compiled."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from gainful.regression import AbstractRowNoise
from gainful.testing.comparisons import assert_covariance

from .parts import ROW_NOISES, flat, name_of


@pytest.mark.parametrize("noise", flat(ROW_NOISES), ids=name_of)
def test_every_row_noise_is_a_covariance_on_average(noise: AbstractRowNoise, key: jax.Array) -> None:
    rows = jax.random.normal(key, (50, 4))
    covariances = jax.jit(jax.vmap(noise))(rows)
    assert covariances.shape == (50, 4, 4)
    assert_covariance(covariances.mean(axis=0), name_of(noise))
    np.testing.assert_allclose(noise(rows[0]), covariances[0], rtol=1e-12)
    single = jax.eval_shape(noise, jax.ShapeDtypeStruct((4,), jnp.float32))
    assert single.dtype == jnp.float32
