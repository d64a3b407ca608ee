"""What to do without an extended filter: states for given parameters, or parameters with the readings as regressors."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...estimates import AbstractEstimate, Gaussian
from ...filters import Info, kalman_filter
from ...linalg import congruence
from ...models import AbstractModel, Instant, Sample, discrete_model, linear_model
from ...models.base import block_diagonal
from ...plants import ReducedHydraulicServo
from ...plants.hydraulic_servo_parameters import STEP
from ...plants.hydraulic_servo_reduced import MEASUREMENT_SIGMAS, PROCESS_SIGMAS, SENSORS
from ...running import make_prior
from ...running.run import scan
from ..experiment import Record
from .contenders import START, START_VARIANCES


class _Next(eqx.Module):
    """The next reading, as the last one and the voltage have it."""

    servo: ReducedHydraulicServo

    def __call__(self, x: Float[Array, "2"], u: Float[Array, "4"]) -> Float[Array, "3"]:
        return self.servo.step(u[1:], u[0], x[0], x[1], STEP)


class _Spread(eqx.Module):
    """Its covariance, `R + A R A^T + Q`: both readings are noisy, and so is the motion between them."""

    following: _Next

    def __call__(self, x: Array, u: Array) -> Float[Array, "3 3"]:
        A = jax.jacfwd(lambda last: self.following(x, jnp.concatenate([u[:1], last])))(u[1:])
        R, Q = (jnp.diag(jnp.asarray(sigmas) ** 2) for sigmas in (MEASUREMENT_SIGMAS, PROCESS_SIGMAS))
        return R + congruence(A, R) + Q


class _Still(eqx.Module):
    def __call__(self, x: Array) -> Array:
        return x


def regression_model(walk: float) -> AbstractModel:
    """Parameters that walk, seen through one step of the axis from the last reading.

    Args:
        walk: standard deviation of a parameter's change per sample.
    """
    following = _Next(ReducedHydraulicServo())
    return discrete_model(
        _Still(),
        states={"p1": "1", "p2": "1"},
        inputs={"voltage": "V"} | {f"last_{name}": "1" for name in SENSORS},
        outputs={f"measured_{name}": "1" for name in SENSORS},
        Q=jnp.full(2, walk**2),
        h=following,
        R=_Spread(following),
    )


class Regression(eqx.Module):
    """A contender: parameters by regression, states as they were read.

    Attributes:
        model: of the parameters.
        prior: of the parameters.
    """

    model: AbstractModel
    prior: Gaussian

    def __call__(self, record: Record) -> Info:
        samples = record.samples
        last = jnp.concatenate([jnp.asarray([START[:3]]), samples.y[:-1]])
        when = Instant(samples.when.t, samples.when.dt, jnp.concatenate([samples.when.u, last], axis=1))
        info = scan(kalman_filter(), self.model, self.prior, Sample(when, samples.y, samples.seen))[1]
        spread = jnp.diag(jnp.asarray(MEASUREMENT_SIGMAS) ** 2)

        def joined(y: Array, found: AbstractEstimate) -> Gaussian:
            return _joint(y, spread, found.mean, found.cov, found)

        return _with(info, jax.vmap(joined)(samples.y, info.estimate))


def regression(walk: float = 0.003) -> Regression:
    """The contender.

    Args:
        walk: standard deviation of a parameter's change per sample.
    """
    model = regression_model(walk)
    return Regression(model, make_prior(model, START[3:], np.sqrt(START_VARIANCES[3:])))


class Frozen(eqx.Module):
    """A contender: states alone, by a linear model at rest with parameters that stay what they are.

    Attributes:
        model: of the states.
        prior: of the states.
        parameters: assumed, `p1` and `p2`.
    """

    model: AbstractModel
    prior: Gaussian
    parameters: Float[Array, "2"]

    def __call__(self, record: Record) -> Info:
        info = scan(kalman_filter(), self.model, self.prior, record.samples)[1]

        def joined(found: AbstractEstimate) -> Gaussian:
            return _joint(found.mean, found.cov, self.parameters, jnp.zeros((2, 2)), found)

        return _with(info, jax.vmap(joined)(info.estimate))


def frozen(p1: float, p2: float) -> Frozen:
    """The contender.

    Args:
        p1: viscous friction over nominal.
        p2: bulk modulus over nominal.
    """
    servo, parameters, rest = ReducedHydraulicServo(), jnp.asarray([p1, p2]), jnp.zeros(4)

    def following(x: Float[Array, "4"]) -> Float[Array, "3"]:
        return servo.step(x[:3], x[3], parameters[0], parameters[1], STEP)

    motion = jax.jacfwd(following)(rest)
    model = linear_model(
        motion[:, :3],
        jnp.eye(3),
        B=motion[:, 3:],
        Q=jnp.asarray(PROCESS_SIGMAS) ** 2,
        R=jnp.asarray(MEASUREMENT_SIGMAS) ** 2,
        states=dict.fromkeys(SENSORS, "1"),
        outputs={f"measured_{name}": "1" for name in SENSORS},
        inputs={"voltage": "V"},
    )
    return Frozen(model, make_prior(model, START[:3], np.sqrt(START_VARIANCES[:3])), parameters)


def _joint(x: Array, spread: Array, p: Array, doubt: Array, like: AbstractEstimate) -> Gaussian:
    """An estimate of states and parameters that know nothing of each other."""
    return Gaussian.start(jnp.concatenate([x, p]), block_diagonal([spread, doubt]), like.space)


def _with(info: Info, estimates: Gaussian) -> Info:
    return eqx.tree_at(lambda each: each.estimate, info, estimates)
