"""A flexible spacecraft that is heavier and softer than believed slews along its reference, whichever law turns it."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.control import (
    AdaptiveInverseController,
    AngleState,
    ErrorStatistics,
    IncrementalInversion,
    Inversion,
    QuinticSlews,
    RateCommand,
    SlewStates,
    StateFeedback,
    StateSource,
    TrackingController,
    euler321_to_quaternion,
    linearised,
    lqi,
)
from gainful.identification import OneStepFit, fit_one_step
from gainful.networks import ProductFeatures, make_radial_basis
from gainful.plants import DisturbanceTorque, FlexibleSpacecraft, FlexibleState, FlexibleStructure
from gainful.plants.flexible_spacecraft_model import flexible_spacecraft_model
from gainful.regression import WeightFilter
from gainful.running import Observer, Rates, Simulated, simulate

T = 0.1  # s
LIMIT = 30.0  # N m
BELIEVED = FlexibleStructure()
TRUE = FlexibleStructure(
    1.2 * BELIEVED.inertia,
    BELIEVED.modal_mass,
    BELIEVED.modal_damping,
    0.9 * BELIEVED.modal_stiffness,
    1.1 * BELIEVED.coupling,
)
CRAFT = FlexibleSpacecraft(TRUE, None, DisturbanceTorque([0.3, -0.2, 0.25], [0.1, 0.1, 0.1], [0.002, -0.004, 0.002]))
SLEWS = QuinticSlews(np.radians([[0.0, 0.0, 0.0], [20.0, 10.0, -15.0]]), duration=30.0, hold=15.0)
QUASI_STATIC = -BELIEVED.coupling / BELIEVED.modal_stiffness[:, None]
RANGES = np.r_[np.full(3, 20.0), np.full(3, 0.5), 0.04, 5e-4, 5e-3, np.full(3, 0.05), 0.1, 3e-3, 0.03]
COMMAND = RateCommand(T, SLEWS, 1.0, (0.03, 0.25, 0.07), QUASI_STATIC, jnp.array([2e-3, 4e-3, 2.4e-3]), 0.5)


@eqx.filter_jit
def flown(controller: Any, key: jax.Array, duration: float = 45.0, craft: Any = CRAFT, **given: Any) -> Simulated:
    return simulate(craft, controller, key=key, duration=duration, rates=Rates(T, 1, 1, 1), **given)


def errors(flight: Simulated) -> np.ndarray:
    """Turn from the reference about each axis [mrad]."""
    turn = jax.vmap(lambda x, t: SLEWS.tracking_error(x[:4], t)[0])(flight.truth, flight.t)
    return 1e3 * np.asarray(turn)


@pytest.fixture(scope="module")
def fit() -> OneStepFit:
    """An affine regression on single steps of the spacecraft as it is believed to be."""
    z = np.random.default_rng(0).uniform(-1.0, 1.0, (1000, 15)) * RANGES
    still = FlexibleSpacecraft(BELIEVED, torque_density=0.0)

    def step(x: jax.Array, u: jax.Array) -> jax.Array:
        state = FlexibleState(euler321_to_quaternion(x[:3]), x[3:6], x[6:9], x[9:])
        return AngleState()(still.advance(state, u, jnp.zeros(()), T, jax.random.key(0)).coordinates)

    following = jax.jit(jax.vmap(step))(z[:, 3:], z[:, :3])
    network = make_radial_basis(ProductFeatures(RANGES), 12, 0, tail="affine")
    learning = WeightFilter(form="covariance", random_walk=1e-7)
    return fit_one_step(network, z[:, 3:], z[:, :3], np.asarray(following), weight_filter=learning)


def adaptive(fit: OneStepFit, **options: Any) -> AdaptiveInverseController:
    weights = np.r_[np.zeros(6), np.ones(3), np.zeros(3)] * np.asarray(fit.model.output_scale) ** 2
    inversion = Inversion(weights, input_scale=20.0, limit=LIMIT)
    given = {"learning": fit.weight_filter, "known": fit.state, "statistics": ErrorStatistics()}
    given |= {"source": StateSource(convert=AngleState())}
    return AdaptiveInverseController(fit.model, COMMAND, inversion, **(given | options))


def rates_first(y: jax.Array) -> jax.Array:
    return jnp.concatenate([y[7:10], y[:4]])


def computed_torque(**options: Any) -> TrackingController:
    w, zeta = 2.5, 1.4
    return TrackingController(
        BELIEVED.inertia, jnp.eye(3), jnp.asarray(LIMIT), SLEWS, w**2, 2.0 * zeta * w, arrange=rates_first, **options
    )


def optimal() -> StateFeedback:
    model = flexible_spacecraft_model(FlexibleSpacecraft(BELIEVED))
    plant = linearised(model, FlexibleState.at_rest(3).coordinates, np.zeros(3), T)
    C = np.eye(3, 12)
    J = np.diag(np.asarray(BELIEVED.inertia))
    cost = np.r_[np.full(3, 10.0), np.zeros(3), np.full(3, 100.0), np.zeros(3)]
    gain, integral = lqi(plant, C, cost, 0.3 / J**2, np.full(3, 100.0), T)
    reference = SlewStates(SLEWS, BELIEVED.inertia, QUASI_STATIC)
    return StateFeedback(
        gain, reference, space=model.space, limit=LIMIT, integral_gain=integral, integrated=C, interval=T
    )


def incremental() -> IncrementalInversion:
    return IncrementalInversion(
        T * jnp.linalg.inv(BELIEVED.hub_inertia), COMMAND, (6, 7, 8), StateSource(convert=AngleState()), LIMIT
    )


def deviation(flight: Simulated) -> np.ndarray:
    # After 2 s, in which the disturbance that was there from the start has been found out.
    return np.sqrt(np.mean(errors(flight)[20:] ** 2, axis=0))


def test_every_law_that_finds_out_the_disturbance_follows_the_slew(fit: OneStepFit, key: jax.Array) -> None:
    laws = {
        "computed torque": computed_torque(k_i=0.4 * 2.5**3, interval=T),
        "optimal": optimal(),
        "incremental": incremental(),
        "adaptive": adaptive(fit),
    }
    found = {name: deviation(flown(law, key)) for name, law in laws.items()}
    # A star tracker of 0.02 mrad and a slew of 360 mrad.
    assert all((off < 0.03).all() for off in found.values()), found
    plain = deviation(flown(computed_torque(), key))
    assert (plain > 2.0 * found["computed torque"]).all()


def test_many_networks_fly_at_once(fit: OneStepFit, key: jax.Array) -> None:
    law = adaptive(fit)
    shifted = eqx.tree_at(lambda each: each.known.weights, law, fit.state.weights * 1.01)
    both = jax.tree.map(lambda *leaves: jnp.stack(leaves) if eqx.is_array(leaves[0]) else leaves[0], law, shifted)

    @eqx.filter_jit
    def fly(laws: Any) -> jax.Array:
        return eqx.filter_vmap(lambda each: flown(each, key, 5.0).truth, in_axes=(eqx.if_array(0),))(laws)

    together = fly(both)
    # What one order of summation rounds differently from another, in fifty steps of a stable loop.
    np.testing.assert_allclose(together[0], flown(law, key, 5.0).truth, atol=1e-10)
    np.testing.assert_allclose(together[1], flown(shifted, key, 5.0).truth, atol=1e-10)


def test_an_estimate_stands_in_for_gauges_while_a_torque_weakens(fit: OneStepFit, key: jax.Array) -> None:
    blind, believed = (
        FlexibleSpacecraft(structure, None, disturbance, modal_sensors=False)
        for structure, disturbance in ((TRUE, CRAFT.disturbance), (BELIEVED, None))
    )
    model = gf.augment(flexible_spacecraft_model(believed), biases={f"torque_{axis}": 0.05 for axis in "xyz"})
    start = np.r_[FlexibleState.at_rest(3).coordinates, np.zeros(3)]
    prior = gf.make_prior(model, start, np.r_[np.full(12, 1e-4), np.full(3, 0.5)])
    flight = flown(
        adaptive(fit, source=StateSource("estimate", model.space.size - 3, AngleState())),
        key,
        craft=blind,
        observer=Observer(gf.extended_kalman_filter(), model, prior),
        actuator_fault=lambda applied, t: applied * jnp.where(t > 20.0, jnp.array([0.7, 1.0, 1.0]), 1.0),
    )
    # A thousandth of the slew, while a third of the roll torque is missing and the estimator is told the command.
    assert (deviation(flight) < 0.35).all()
    assert flight.info is not None
    bias = np.asarray(flight.info.estimate.mean)[-1, -3:]
    # The missing torque and the disturbance are all that the biases can be; at rest the disturbance alone.
    disturbance = np.asarray(CRAFT.disturbance(flight.t[-1]))
    assert np.sign(-bias).tolist() == np.sign(disturbance).tolist()
