"""Messages of control laws: the argument, what was expected, what came."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.control import (
    AdaptiveInverseController,
    ErrorStatistics,
    FollowReference,
    Guardrails,
    IncrementalInversion,
    Inversion,
    LinearPlant,
    QuinticSlews,
    RateCommand,
    Reading,
    SetPoint,
    SlewStates,
    StateFeedback,
    StateSource,
    gain_margin,
    linearised,
    lqi,
    lqr,
    torque_need,
)
from gainful.errors import ConfigError, ModelError, ShapeError
from gainful.identification import OneStepModel
from gainful.networks import AffineMap
from gainful.plants import attitude_kinematics
from gainful.regression import WeightFilter

HOME = SetPoint([0.0, 0.0], [0.0])
PLANT = LinearPlant([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]])
TURN = np.radians([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
SLEWS = QuinticSlews(TURN)
READING = Reading(jnp.zeros(2), jnp.zeros(0), None)


def adaptive(inversion: Any = None, **options: Any) -> AdaptiveInverseController:
    model = OneStepModel(AffineMap(jnp.zeros((2, 3)), jnp.zeros(2)), jnp.ones(2))
    return AdaptiveInverseController(model, FollowReference(0.1, HOME), inversion or Inversion(jnp.ones(2)), **options)


LAWS = [
    (
        lambda: Inversion(jnp.ones(2), "gauss-neuton"),
        ConfigError,
        "method: 'gauss-neuton' is not known; did you mean 'gauss-newton'?",
    ),
    (
        lambda: Inversion(jnp.ones(2), sweeps=0),
        ConfigError,
        "sweeps: expected a whole number of at least 1, got 0",
    ),
    (
        lambda: Inversion(jnp.ones(2), "ekf", effort=jnp.ones(1)),
        ConfigError,
        "effort: expected the method 'gauss-newton', got 'ekf'",
    ),
    (
        lambda: Inversion(jnp.ones((2, 3))),
        ShapeError,
        "weights: expected one per output or a square matrix, got shape (2, 3)",
    ),
    (
        lambda: ErrorStatistics("exponentia"),
        ConfigError,
        "kind: 'exponentia' is not known; did you mean 'exponential'?",
    ),
    (
        lambda: ErrorStatistics(rate=0.0),
        ConfigError,
        "rate: expected a number above 0 and at most 1, got 0.0",
    ),
    (
        lambda: ErrorStatistics("mean", head_start=-1),
        ConfigError,
        "head_start: expected a number of at least 0, got -1",
    ),
    (
        lambda: ErrorStatistics().of(jnp.zeros(3)),
        ShapeError,
        "errors: expected one row per sample, got shape (3,)",
    ),
    (lambda: StateSource("reading"), ConfigError, "feedback: expected one of readings, estimate, got 'reading'"),
    (
        lambda: StateSource("estimate")(READING),
        ConfigError,
        "feedback: expected an estimator in the loop for 'estimate', got none",
    ),
    (
        lambda: LinearPlant(np.ones((2, 3)), np.ones((2, 1))),
        ShapeError,
        "A: expected a square matrix, got shape (2, 3)",
    ),
    (lambda: LinearPlant(np.eye(2), np.ones((3, 1))), ShapeError, "B: expected 2 rows, got shape (3, 1)"),
    (
        lambda: linearised(attitude_kinematics(), np.zeros(3), np.zeros(3), 0.1),
        ShapeError,
        "x: expected 4 numbers, got shape (3,)",
    ),
    (
        lambda: linearised(attitude_kinematics(), np.zeros(4), np.zeros(2), 0.1),
        ShapeError,
        "u: expected 3 numbers, got shape (2,)",
    ),
    (
        lambda: lqr(PLANT, [1.0], [1.0]),
        ShapeError,
        "Q: expected 2 numbers or a matrix of that size, got shape (1,)",
    ),
    (
        lambda: lqr(LinearPlant([[2.0]], [[0.0]]), [1.0], [1.0]),
        ModelError,
        "plant: expected one that an input can stabilise and whose unstable modes the cost sees, got no solution of the "
        "Riccati equation",
    ),
    (
        lambda: lqi(PLANT, [[1.0]], [1.0, 1.0], [1.0], [1.0], 0.1),
        ShapeError,
        "C: expected 2 columns, got shape (1, 1)",
    ),
    (lambda: gain_margin(1.5, 1.0), ConfigError, "alpha: expected a number of at least 0 and at most 1, got 1.5"),
    (lambda: gain_margin(0.5, 0.0), ConfigError, "beta: expected a number above 0 and at most 1, got 0.0"),
    (
        lambda: StateFeedback([1.0, 2.0], HOME),
        ShapeError,
        "gain: expected a matrix, got shape (2,)",
    ),
    (
        lambda: StateFeedback([[1.0, 2.0]], HOME, integral_gain=[[1.0]]),
        ConfigError,
        "integral_gain: expected together with integrated, got one without the other",
    ),
    (
        lambda: StateFeedback([[1.0, 2.0]], HOME, integral_gain=[[1.0]], integrated=[[1.0]]),
        ShapeError,
        "integrated: expected 2 columns, got shape (1, 1)",
    ),
    (
        lambda: StateFeedback([[1.0, 2.0]], HOME, integral_gain=[[1.0, 2.0]], integrated=[[1.0, 0.0]]),
        ShapeError,
        "integral_gain: expected shape (1, 1), got (1, 2)",
    ),
    (
        lambda: IncrementalInversion([[1.0]], FollowReference(0.1, HOME), (0, 1)),
        ShapeError,
        "effectiveness: expected 2 rows, one per tracked state, got shape (1, 1)",
    ),
    (
        lambda: Guardrails(least_sensitivity=0.0),
        ConfigError,
        "least_sensitivity: expected a number above 0, got 0.0",
    ),
    (
        lambda: Guardrails(most_missing=-1),
        ConfigError,
        "most_missing: expected a whole number of at least 0, got -1",
    ),
    (
        lambda: adaptive(moments=ErrorStatistics().init(2)),
        ConfigError,
        "moments: expected together with statistics, got them alone",
    ),
    (
        lambda: adaptive(known=WeightFilter().init(3, 2)),
        ConfigError,
        "known: expected together with learning, got it alone",
    ),
    (
        lambda: adaptive(Inversion(jnp.ones(3))),
        ShapeError,
        "inversion: expected 2 weights, one per state, got shape (3,)",
    ),
    (
        lambda: adaptive(learning=WeightFilter()),
        ConfigError,
        "network: expected one that is linear in its weights, got a AffineMap",
    ),
]

TURNS = [
    (
        lambda: QuinticSlews([[0.0, 0.0, 0.0]]),
        ShapeError,
        "way_points: expected at least two rows of three angles, got shape (1, 3)",
    ),
    (lambda: QuinticSlews(TURN, duration=0.0), ConfigError, "duration: expected a time above 0 s, got 0.0 s"),
    (lambda: QuinticSlews(TURN, hold=-1.0), ConfigError, "hold: expected a time of at least 0 s, got -1.0 s"),
    (
        lambda: QuinticSlews(np.radians([[0.0, 0.0, 0.0], [0.0, -87.0, 0.0]])),
        ConfigError,
        "way_points: expected a pitch within 85 degrees of zero, got 87 degrees; 3-2-1 angles are singular at 90, so turn "
        "the axes they are counted from",
    ),
    (
        lambda: SlewStates(SLEWS, np.eye(3), attitude="euler"),
        ConfigError,
        "attitude: expected one of quaternion, angles, got 'euler'",
    ),
    (lambda: SlewStates(SLEWS, np.eye(2)), ShapeError, "inertia: expected shape (3, 3), got (2, 2)"),
    (
        lambda: SlewStates(SLEWS, np.eye(3), np.ones((2, 2))),
        ShapeError,
        "quasi_static: expected 3 columns, got shape (2, 2)",
    ),
    (lambda: torque_need(SLEWS, np.eye(2), 1.0), ShapeError, "inertia: expected shape (3, 3), got (2, 2)"),
    (
        lambda: torque_need(SLEWS, np.eye(3), [1.0, 2.0]),
        ShapeError,
        "max_torque: expected one number or 3, got shape (2,)",
    ),
    (lambda: torque_need(SLEWS, np.eye(3), 0.0), ConfigError, "max_torque: expected torques above 0, got 0.0"),
    (
        lambda: torque_need(SLEWS, np.eye(3), 1.0, share=0.0),
        ConfigError,
        "share: expected a number above 0 and at most 1, got 0.0",
    ),
    (lambda: RateCommand(0.0, SLEWS), ConfigError, "interval: expected a number above 0, got 0.0"),
    (
        lambda: RateCommand(0.1, SLEWS, contraction=2.0),
        ConfigError,
        "contraction: expected a number above 0 and at most 1, got 2.0",
    ),
]


@pytest.mark.parametrize(("act", "kind", "message"), LAWS + TURNS)
def test_a_message_names_the_argument_what_was_expected_and_what_came(act: Any, kind: Any, message: str) -> None:
    with pytest.raises(kind) as raised:
        act()
    assert str(raised.value) == message


def test_a_reference_that_asks_too_much_is_told_axis_by_axis() -> None:
    need = torque_need(SLEWS, np.diag([3000.0, 1500.0, 2500.0]), [7.0, 7.0, 7.0])
    assert need.cautions == (
        "reference: expected at most 5.6 N m about x, 0.8 of 7 N m available, got 6.718; slews 1.1 times as long would do",
    )
