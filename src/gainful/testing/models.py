"""The laws of a model."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..models import AbstractModel, Instant
from .cart import instant
from .comparisons import assert_close, assert_covariance, assert_identical, assert_true
from .spaces import point_of


def check_model(model: AbstractModel, *, point: Any = None, t: float = 0.5, dt: float = 0.1, u: Any = None) -> None:
    """Raise unless a model keeps its laws at a point.

    Nothing moves and nothing is added over an interval of 0; every function returns a finite point or covariance of the
    declared size and of the state's number type; the sensors account for the whole output; giving the model its own
    parameters changes nothing.

    Args:
        model: the model.
        point: a state; searched for if not given.
        t: time [s].
        dt: time since the previous moment [s].
        u: inputs; one half each by default.

    Raises:
        AssertionError: a law is broken.

    Example:
        >>> from gainful.models import linear_model
        >>> check_model(linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0))
    """
    name = type(model).__name__
    space, output = model.space, model.output
    x = point_of(space) if point is None else jnp.asarray(point, dtype=float)
    assert_true(not np.any(np.asarray(space.defect(x))), f"{name}: expected a point of its space, got {x}")
    when = instant(model, t, dt)
    if u is not None:
        when = Instant(when.t, when.dt, jnp.asarray(u, dtype=float))
    assert_true(
        len(model.input_units) == len(model.inputs),
        f"{name}: expected {len(model.inputs)} input units, got {model.input_units}",
    )
    counted = sum(count for _, count in model.sensors)
    assert_true(counted == output.dof, f"{name}: expected sensors with {output.dof} outputs together, got {counted}")

    evaluate = eqx.filter_jit(_evaluate)
    here, still = evaluate(model, x, when), evaluate(model, x, Instant(when.t, jnp.zeros_like(when.dt), when.u))
    assert_identical(still["transition"], x, f"{name}: dt = 0 leaves the state alone")
    assert_identical(still["Q"], jnp.zeros((space.dof, space.dof)), f"{name}: dt = 0 adds no noise")
    assert_close(still["observe"], here["observe"], f"{name}: what is read does not depend on dt", tolerance=1e-12)
    for role, where in (("transition", space), ("observe", output)):
        value = np.asarray(here[role])
        assert_true(value.shape == (where.size,), f"{name}: {role}: expected {where.size} numbers, got {value.shape}")
        inside = np.all(np.isfinite(value)) and not np.any(np.asarray(where.defect(here[role])))
        assert_true(inside, f"{name}: {role}: expected a point of {where.names}, got {value}")
    for role, size in (("Q", space.dof), ("R", output.dof)):
        assert_true(
            here[role].shape == (size, size), f"{name}: {role}: expected ({size}, {size}), got {here[role].shape}"
        )
        assert_covariance(here[role], f"{name}: {role}")
    own = model.with_parameters(model.parameters)
    assert_identical(evaluate(own, x, when), here, f"{name}: its own parameters change nothing")
    _check_single_precision(model, x, when, name)


def _evaluate(model: AbstractModel, x: Any, when: Instant) -> dict[str, Any]:
    return {
        "transition": model.transition(x, when),
        "observe": model.observe(x, when),
        "Q": model.process_noise(x, when),
        "R": model.measurement_noise(x, when),
    }


def _check_single_precision(model: AbstractModel, x: Any, when: Instant, name: str) -> None:
    """A float32 state stays one, or a filter in single precision would not compile."""
    half, then = jax.tree.map(lambda leaf: leaf.astype(jnp.float32), (x, when))
    for role, value in jax.eval_shape(lambda x, when: _evaluate(model, x, when), half, then).items():
        assert_true(
            value.dtype == jnp.float32, f"{name}: {role}: expected float32 from a float32 state, got {value.dtype}"
        )
