"""Networks before they fly: one-step samples of the nominal spacecraft, and weights fitted to them."""

from __future__ import annotations

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...control import ErrorMoments
from ...control.euler321 import euler321_to_quaternion, quaternion_to_euler321
from ...identification import OneStepModel
from ...linalg import symmetrize
from ...networks import ProductFeatures, RadialBasisNetwork
from ...plants import FlexibleSpacecraft, FlexibleState, FlexibleStructure
from ...regression import WeightState, ridge_weights
from .scenarios import BOX, NOMINAL, STEP, Box

SAMPLES = 3000
CENTRES = 200
GAIN = 0.3
"""Size of a scaled input at the end of its range: small, so that features are nearly linear in the lifted inputs."""
PRIOR_VARIANCE, NOISE_VARIANCE = 1e4, 1e-4
"""Of the weights before training, and of an output in its unit."""
STATES, CONTROLS = 12, 3
RBF, BILINEAR, AFFINE = "radial basis", "bilinear", "affine"
KINDS = (RBF, BILINEAR, AFFINE)
"""Networks from the largest to the smallest: 200, 121 and 16 weights per output."""

Kind = Literal["radial basis", "bilinear", "affine"]


class OneSteps(eqx.Module):
    """Samples that need not follow each other; states hold 3-2-1 angles.

    Attributes:
        states: (N, 12).
        controls: torques held over the step (N, 3) [N m].
        following: states one step later (N, 12).
    """

    states: Float[Array, "N 12"]
    controls: Float[Array, "N 3"]
    following: Float[Array, "N 12"]


class Learned(eqx.Module):
    """A network with what goes on learning.

    Attributes:
        model: with the fitted weights.
        state: of the weights and their covariance.
        moments: mean and variance of what is left of the training outputs.
    """

    model: OneStepModel
    state: WeightState
    moments: ErrorMoments


def propagated(
    structure: FlexibleStructure, x: Float[Array, "12"], u: Float[Array, "3"], substeps: int = 4
) -> Float[Array, "12"]:
    """The state one sample later, without noise."""
    craft = FlexibleSpacecraft(structure, torque_density=jnp.asarray(0.0), substeps=substeps)
    state = FlexibleState(euler321_to_quaternion(x[:3]), x[3:6], x[6:9], x[9:])
    after = craft.advance(state, u, jnp.zeros(()), STEP, jax.random.key(0))
    return angle_state(after)


def angle_state(state: FlexibleState) -> Float[Array, "12"]:
    """The state with 3-2-1 angles in place of the quaternion."""
    angles = quaternion_to_euler321(state.attitude)
    return jnp.concatenate([angles, state.deflection, state.rate, state.deflection_rate])


def one_steps(key: Array, box: Box = BOX, samples: int = SAMPLES) -> OneSteps:
    """Samples uniform in a box, each propagated on the nominal spacecraft."""
    z = jax.random.uniform(key, (samples, STATES + CONTROLS), minval=-1.0, maxval=1.0) * jnp.asarray(box.scale)
    controls, states = z[:, :CONTROLS], z[:, CONTROLS:]
    following = jax.vmap(lambda x, u: propagated(NOMINAL, x, u))(states, controls)
    return OneSteps(states, controls, following)


def network_of(
    kind: Kind, key: Array, scale: Float[Array, "15"], gain: float | Array = GAIN, centres: int = CENTRES
) -> RadialBasisNetwork:
    """A network that has learned nothing.

    Args:
        kind: of the features: kernels about random centres, or the inputs with or without their products.
        key: of the centres, uniform between -1 and 1 in all lifted coordinates.
        scale: of torques and states.
        gain: on the scaled inputs.
        centres: how many.
    """
    lifting = ProductFeatures(scale, gain)  # type: ignore[arg-type]  # an array
    placed = jax.random.uniform(key, (centres if kind == RBF else 0, lifting.size), minval=-1.0, maxval=1.0)
    tail: Literal["none", "affine", "lift"] = {RBF: "none", BILINEAR: "lift", AFFINE: "affine"}[kind]  # type: ignore[assignment]
    features = len(placed) + {"none": 0, "affine": 1 + lifting.inputs, "lift": 1 + lifting.size}[tail]
    return RadialBasisNetwork(jnp.zeros((features, STATES)), placed, lifting, jnp.asarray(1.0), "thin-plate", tail)


def learn(
    network: RadialBasisNetwork,
    samples: OneSteps,
    *,
    form: Literal["increment", "absolute"] = "increment",
    output_scale: Float[Array, "12"] | None = None,
    used: Float[Array, " N"] | None = None,
) -> Learned:
    """Fit the weights of a network, all at once.

    Args:
        network: whose weights are replaced.
        samples: to fit to.
        form: what is predicted, the change of the state or the state.
        output_scale: units of the outputs; by default the standard deviations of what is predicted.
        used: 1 for samples that count, 0 for others; all by default.
    """
    wanted = samples.following - samples.states if form == "increment" else samples.following
    weights = jnp.ones(len(wanted)) if used is None else used
    if output_scale is None:
        mean = weights @ wanted / jnp.sum(weights)
        output_scale = jnp.sqrt(weights @ (wanted - mean) ** 2 / jnp.sum(weights))
    model = OneStepModel(network, output_scale, form)
    features = jax.vmap(model.features)(samples.states, samples.controls) * weights[:, None]
    targets = jax.vmap(model.targets)(samples.states, samples.following) * weights[:, None]
    fitted = ridge_weights(features, targets, PRIOR_VARIANCE, NOISE_VARIANCE)
    state = WeightState(
        fitted.weights, symmetrize(fitted.cov), fitted.seen, fitted.skipped, fitted.resets, "covariance"
    )
    left = targets - features @ state.weights
    mean = jnp.sum(left, axis=0) / jnp.sum(weights)
    variance = jnp.sum(left**2, axis=0) / jnp.sum(weights) - mean**2
    return Learned(model.with_weights(state.weights), state, ErrorMoments(mean, variance, jnp.zeros(())))


def trained(kind: Kind, key: Array, box: Box = BOX) -> Learned:
    """A network of a run: centres and samples of its own, those of the samples the same for all kinds."""
    own, sampling = jax.random.split(key)
    return learn(network_of(kind, own, jnp.asarray(box.scale)), one_steps(sampling, box))
