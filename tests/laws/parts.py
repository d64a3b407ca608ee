"""Every part of the library, with the instances its laws are tried on.

A new part must be entered here: `test_every_part_is_tried` walks the subclasses of the abstract classes and names those
without an entry.
"""

import importlib
import inspect
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import gainful as gf
from gainful.aiding import SensorMap, SensorMappedModel, with_sensor_maps
from gainful.estimates import AbstractEstimate, Friedland, TwoStage
from gainful.faults import Fault, FaultModel, with_faults
from gainful.filters import AbstractEstimator, GeneralizedLikelihoodRatio, InteractingMultipleModel
from gainful.linearization import (
    AbstractLinearization,
    AbstractRule,
    Cubature,
    GaussHermite,
    MarginalSigmaPoints,
    Unscented,
)
from gainful.models import AbstractModel
from gainful.models.dynamics import AbstractDynamics, ContinuousDynamics, DiscreteDynamics, LinearDynamics
from gainful.models.model import Model
from gainful.networks import (
    CMAC,
    AbstractNetwork,
    AbstractTraining,
    AffineMap,
    AffineTraining,
    CMACTraining,
    HarmonicMap,
    HarmonicTraining,
    MultilayerPerceptron,
    PerceptronTraining,
    zero_map,
)
from gainful.noise import AbstractNoise, Capped, InnovationMatching, SageHusa, Scaled
from gainful.regression import (
    AbstractRowNoise,
    ConstantRowNoise,
    RateRowNoise,
    RayleighTotalLeastSquares,
    RecursiveLeastSquares,
    RecursiveTotalLeastSquares,
    RegressionModel,
    regression_model,
)
from gainful.spaces import (
    AbstractSpace,
    Circle,
    Euclidean,
    Interval,
    Positive,
    Product,
    Quaternion,
    quaternion_conjugate,
    rotate,
)
from gainful.testing.cart import cart_model
from gainful.updates import (
    AbstractFeatures,
    AbstractUpdate,
    ChangeDetection,
    Considered,
    Context,
    Corrected,
    HuberReweighted,
    InnovationHistory,
    InnovationScaling,
    JoinedFeatures,
    MasreliezMartin,
    MaximumCorrentropy,
    StrongTracking,
    StudentT,
    UpdateFeatures,
    VariationalCovariances,
    VariationalNoise,
    WeightedLikelihood,
)

SPACES: dict[type, list[AbstractSpace]] = {
    Euclidean: [Euclidean(("a", "b"), ("m", "m/s"))],
    Circle: [Circle("heading")],
    Positive: [Positive("mass", "kg")],
    Interval: [Interval("efficiency", 0.0, 1.0), Interval("trim", -0.1, 0.2), Interval("gain", -5.0, 1000.0)],
    Quaternion: [Quaternion("attitude")],
    Product: [Product([Euclidean(("a",)), Circle("heading"), Quaternion("attitude"), Interval("share", 0.0, 1.0)])],
}

RULES: dict[type, list[tuple[AbstractRule, int]]] = {
    # With each the degree up to which it is exact.
    Unscented: [
        (Unscented(), 3),
        (Unscented(alpha=0.1), 3),
        (Unscented(alpha=1e-3), 3),
        (Unscented(alpha=0.5, beta=0.0, kappa=1.0), 3),
    ],
    Cubature: [(Cubature(), 3)],
    GaussHermite: [(GaussHermite(2), 3), (GaussHermite(3), 5), (GaussHermite(5), 9)],
}

LINEARIZATIONS: dict[type, list[AbstractLinearization]] = {
    gf.Taylor: [gf.Taylor()],
    gf.SigmaPoints: [
        gf.SigmaPoints(Unscented(alpha=0.1)),
        gf.SigmaPoints(Cubature()),
        gf.SigmaPoints(GaussHermite()),
    ],
    MarginalSigmaPoints: [
        MarginalSigmaPoints(Unscented(alpha=0.1)),
        MarginalSigmaPoints(GaussHermite(), "rao_blackwell"),
    ],
}

TRAININGS: dict[type, list[AbstractTraining]] = {
    AffineTraining: [AffineTraining()],
    CMACTraining: [
        CMACTraining(levels=20, layers=4, least_visits=0),
        CMACTraining(levels=20, layers=4, least_visits=0, groups=((0,), (1, 2)), method="ridge", compress="none"),
        CMACTraining(levels=20, layers=4, least_visits=0, table="hashed", cells=64),
    ],
    HarmonicTraining: [HarmonicTraining(), HarmonicTraining(1)],
    PerceptronTraining: [
        PerceptronTraining((3,), iterations=5),
        PerceptronTraining((3, 2), method="sgd", epochs=1),
    ],
}


def _trained(training: AbstractTraining) -> AbstractNetwork:
    """A network of three inputs and two outputs that has learned something of no meaning."""
    inputs = np.random.default_rng(4).normal(size=(150, 3))
    return training(inputs, 0.02 * np.sin(inputs[:, :2]), key=jax.random.key(4))[0]


def _one_of(network: AffineMap) -> AffineMap:
    """The first output alone."""
    return AffineMap(network.matrix[:1], network.offset[:1])


NETWORKS: dict[type, list[AbstractNetwork]] = {
    AffineMap: [_trained(each) for each in TRAININGS[AffineTraining]],
    CMAC: [_trained(each) for each in TRAININGS[CMACTraining]],
    HarmonicMap: [_trained(each) for each in TRAININGS[HarmonicTraining]],
    MultilayerPerceptron: [_trained(each) for each in TRAININGS[PerceptronTraining]],
}

FEATURES: dict[type, list[AbstractFeatures]] = {
    UpdateFeatures: [UpdateFeatures()],
    InnovationHistory: [InnovationHistory(), InnovationHistory(leaks=(0.5,), square_leaks=())],
    Context: [Context(("heading", "speed", "t"))],
    JoinedFeatures: [JoinedFeatures((UpdateFeatures(), Context(("dt",))))],
}

_PLACE = Context(("x", "heading", "speed"))
"""Features of any cart, with one sensor more or less."""

UPDATES: dict[type, list[tuple[AbstractUpdate, AbstractUpdate]]] = {
    # With each the same update in the limit where it equals `Exact`.
    gf.Exact: [(gf.Exact(), gf.Exact())],
    gf.Gated: [
        (gf.Gated(probability=0.9, reacquire=2), gf.Gated(probability=1.0)),
        (gf.Gated(probability=0.9, by="component"), gf.Gated(probability=1.0, by="component")),
    ],
    gf.Iterated: [(gf.Iterated(iterations=3), gf.Iterated(iterations=1))],
    Considered: [(Considered(("heading",)), Considered())],
    InnovationScaling: [
        (InnovationScaling(order=("state", "measurement"), window=3, gate=0.5), InnovationScaling(gate=0.0)),
    ],
    StrongTracking: [(StrongTracking(memory=0.5, softening=1.0), StrongTracking(cap=1.0))],
    MasreliezMartin: [
        (MasreliezMartin(), MasreliezMartin(contamination=0.0)),
        (
            MasreliezMartin(threshold=1.0, covariance="expectation", whitening="cholesky"),
            MasreliezMartin(threshold=1e9, covariance="expectation", whitening="cholesky"),
        ),
        (
            MasreliezMartin(joint=True, whitening="symmetric"),
            MasreliezMartin(0.0, joint=True, whitening="symmetric"),
        ),
    ],
    # Readings are up to some thousand sigmas off, so that limits must be as large to be limits.
    HuberReweighted: [(HuberReweighted(iterations=3), HuberReweighted(contamination=0.0))],
    StudentT: [(StudentT(dof=4.0), StudentT(dof=1e16)), (StudentT(joint=True), StudentT(dof=1e16, joint=True))],
    MaximumCorrentropy: [(MaximumCorrentropy(), MaximumCorrentropy(bandwidth=1e9))],
    WeightedLikelihood: [
        (WeightedLikelihood(), WeightedLikelihood(scale=1e9)),
        (WeightedLikelihood(scale=4.0, joint=True), WeightedLikelihood(scale=1e9, joint=True)),
    ],
    VariationalNoise: [(VariationalNoise(memory=0.9), VariationalNoise(memory=1.0, start=1e16))],
    VariationalCovariances: [
        (
            VariationalCovariances(memory=0.9),
            VariationalCovariances(prediction=1e16, memory=1.0, start=1e16),
        )
    ],
    ChangeDetection: [
        (
            ChangeDetection({"heading": 0.3}, threshold=2.0, arm_after=2, dead_time=2),
            ChangeDetection({"heading": 0.3}, MasreliezMartin(contamination=0.0), threshold=1e9),
        )
    ],
}

UPDATES[Corrected] = [
    (
        Corrected(NETWORKS[CMAC][0], _PLACE, gate=None, covariance=jnp.diag(jnp.array([0.01, 0.02])), least_visits=0.0),
        Corrected(zero_map(3, 2), _PLACE, gate=None),
    ),
    (
        Corrected(NETWORKS[AffineMap][0], _PLACE, feedback=True, covariance=jnp.eye(2)),
        Corrected(zero_map(3, 2), _PLACE, feedback=True, gate=None),
    ),
]

LIKE_HUBERS = (StudentT, MaximumCorrentropy, WeightedLikelihood)
"""Updates that share their steps with `HuberReweighted`."""

NOISES: dict[type, list[AbstractNoise]] = {
    gf.Nominal: [gf.Nominal()],
    Scaled: [Scaled({"heading": 3.0}, {"compass": 0.5})],
    SageHusa: [SageHusa(memory=0.9, inner=Scaled({"heading": 3.0}, {"compass": 0.5}))],
    InnovationMatching: [InnovationMatching(window=3, settle=1, ceiling=10.0, patience=2)],
    Capped: [Capped({"heading": 0.05}, Scaled({"heading": 3.0}))],
}

LIKE_SAGE_HUSAS = (InnovationMatching, Scaled)
"""Noise laws that share the steps of `SageHusa`, or are within it."""

ESTIMATES: dict[type, list[type[AbstractEstimate]]] = {
    gf.Gaussian: [gf.Gaussian],
    gf.SquareRoot: [gf.SquareRoot],
    TwoStage: [TwoStage],
    Friedland: [],  # keeps the laws for constant biases only, see tests/equivalence/test_two_stage.py
}


def _spin(x: Any, u: Any) -> Any:
    return jnp.concatenate([u[:3], -0.1 * x[4:]])


def _star(x: Any) -> Any:
    return rotate(quaternion_conjugate(x[:4]), jnp.array([0.0, 0.6, 0.8], x.dtype)) * x[4]


def _spring(x: Any, u: Any, t: Any, p: dict[str, Any]) -> Any:
    return jnp.stack([x[1], -p["stiffness"] * x[0] - 0.1 * x[1] + u[0] * jnp.cos(t)])


def _first(x: Any) -> Any:
    return x[:1]


def spring_model() -> Model:
    return gf.continuous_model(
        _spring,
        _first,
        states={"x": "m", "v": "m/s"},
        outputs={"y": "m"},
        inputs={"force": "N"},
        Q=[0.01, 0.1],
        R=0.04,
        parameters={"stiffness": 2.0},
        substeps=2,
    )


def _fall(x: Any, u: Any, t: Any, dt: Any) -> Any:
    return jnp.stack([x[0] + dt * x[1], x[1] - dt * (9.81 - 0.01 * x[1] ** 2)])  # m/s^2, 1/m


def falling_model() -> Model:
    gain = [[0.0], [1.0]]
    return gf.discrete_model(_fall, _first, states={"height": "m", "v": "m/s"}, outputs=1, Q=[[0.1]], G=gain, R=0.5)


def attitude_model() -> Model:
    states = {"q": "quaternion", "size": (0.0, None)}
    inputs = {"wx": "rad/s", "wy": "rad/s", "wz": "rad/s"}
    outputs = ["sx", "sy", "sz"]
    noise = [1e-3, 1e-3, 1e-3, 1e-2]
    return gf.continuous_model(_spin, _star, states=states, outputs=outputs, inputs=inputs, Q=noise, R=0.01)


MODELS: dict[type, list[AbstractModel]] = {
    Model: [cart_model(), attitude_model()],
    gf.models.AugmentedModel: [
        gf.augment(spring_model(), parameters={"stiffness": 0.1}, biases={"y": 0.0}, bounds={"stiffness": (0, None)}),
        gf.augment(cart_model(), biases={"speed": 0.2, "compass": 0.1}),
    ],
    FaultModel: [
        with_faults(
            cart_model(),
            [Fault("loss", "speed", 0.1, time_constant=3.0), Fault("bias", "compass", 0.1), Fault("scale", "along")],
        ),
        with_faults(cart_model(), [Fault("offset", "speed", 0.1, rate_sigma=0.1, rate_walk=0.2)]),
    ],
}

MODELS[RegressionModel] = [
    regression_model({"mass": "kg", "drag": "N s/m"}, ("a", "b"), unit="N", Q=[0.1, 0.0], R=0.04)
]

MODELS[SensorMappedModel] = [
    with_sensor_maps(
        cart_model(),
        [SensorMap("compass", ("x", "speed", "heading"), _one_of(NETWORKS[AffineMap][0]), jnp.asarray(0.05))],
    )
]

ROW_NOISES: dict[type, list[AbstractRowNoise]] = {
    ConstantRowNoise: [ConstantRowNoise(0.1), ConstantRowNoise((0.1, 0.0, 0.2, 0.3))],
    RateRowNoise: [RateRowNoise(0.1, 2.0, 0.05)],
}

DYNAMICS: dict[type, list[AbstractModel]] = {
    DiscreteDynamics: [falling_model()],
    ContinuousDynamics: [spring_model()],
    LinearDynamics: [
        gf.linear_model([[1.0, 0.1], [0.0, 0.9]], [[1.0, 0.0]], Q=[[0.2]], G=[[0.5], [1.0]], R=0.1, B=[[0.0], [1.0]])
    ],
}

ESTIMATORS: dict[type, list[tuple[AbstractEstimator, AbstractModel | None]]] = {
    # With each the model it needs; the cart if None. Filters are tried in combinations too, see `combinations`.
    gf.KalmanFilter: [(gf.kalman_filter(), DYNAMICS[LinearDynamics][0])],
    RecursiveLeastSquares: [(RecursiveLeastSquares(forgetting=0.9), MODELS[RegressionModel][0])],
    RecursiveTotalLeastSquares: [
        (RecursiveTotalLeastSquares(forgetting=0.9), MODELS[RegressionModel][0]),
        (RecursiveTotalLeastSquares(form="covariance", gap_gate=False), MODELS[RegressionModel][0]),
    ],
    RayleighTotalLeastSquares: [(RayleighTotalLeastSquares(warm_start=4), MODELS[RegressionModel][0])],
    GeneralizedLikelihoodRatio: [
        (GeneralizedLikelihoodRatio(gf.KalmanFilter(), window=5, threshold=3.0), MODELS[gf.models.AugmentedModel][1])
    ],
    InteractingMultipleModel: [
        (
            InteractingMultipleModel(
                (gf.KalmanFilter(), gf.KalmanFilter(noise=Scaled({"heading": 5.0}))), ((0.9, 0.1), (0.2, 0.8))
            ),
            None,
        )
    ],
}

KINDS: dict[type, dict[type, list[Any]]] = {
    AbstractSpace: SPACES,
    AbstractRule: RULES,
    AbstractLinearization: LINEARIZATIONS,
    AbstractUpdate: UPDATES,
    AbstractNoise: NOISES,
    AbstractEstimate: ESTIMATES,
    AbstractEstimator: ESTIMATORS,
    AbstractModel: MODELS,
    AbstractDynamics: DYNAMICS,
    AbstractRowNoise: ROW_NOISES,
    AbstractTraining: TRAININGS,
    AbstractNetwork: NETWORKS,
    AbstractFeatures: FEATURES,
}

_WITHOUT_PARTS = {"cli", "config", "io", "jobs", "live", "report", "testing"}
"""Rooms that need optional packages and define no parts."""


def import_all() -> None:
    """Import every module in which a part can be defined."""
    root = Path(gf.__file__).parent
    for path in sorted(root.rglob("*.py")):
        names = path.relative_to(root).with_suffix("").parts
        package = all((root.joinpath(*names[:k]) / "__init__.py").exists() for k in range(len(names)))
        if package and names[0] not in _WITHOUT_PARTS and names[-1] not in ("__init__", "__main__"):
            importlib.import_module(".".join(("gainful", *names)))


def final_subclasses(base: type) -> Iterator[type]:
    """All classes of the library below `base` that can be made."""
    for cls in base.__subclasses__():
        yield from final_subclasses(cls)
        if cls.__module__.startswith("gainful.") and not (
            inspect.isabstract(cls) or cls.__name__.startswith("Abstract")
        ):
            yield cls


def flat(table: dict[type, list[Any]]) -> list[Any]:
    return [entry for entries in table.values() for entry in entries]


def combinations(full: bool) -> list[gf.KalmanFilter]:
    """Filters in which every pair of parts occurs; or all of them.

    Sigma-point rules differ in numbers only, so the one with the most to go wrong, a negative weight, stands for all; one
    instance stands for its class, the reweighted update that doubts measurement and prediction for those that share
    its steps, and one law of learned noise for the others.
    """
    one_each = [entries[0][0] for kind, entries in UPDATES.items() if kind not in LIKE_HUBERS]
    axes = [
        flat(LINEARIZATIONS) if full else [gf.Taylor(), gf.SigmaPoints(Unscented(alpha=0.1))],
        [update for update, _ in flat(UPDATES)] if full else one_each,
        flat(NOISES) if full else [laws[0] for kind, laws in NOISES.items() if kind not in LIKE_SAGE_HUSAS],
        flat(ESTIMATES),
    ]
    chosen = itertools.product(*axes) if full else covering(axes)
    return [gf.KalmanFilter(lin, update, noise, estimate) for lin, update, noise, estimate in chosen]


def covering(axes: Sequence[Sequence[Any]]) -> list[tuple[Any, ...]]:
    """A small set of combinations in which every pair of values of two axes occurs: greedy, the best one first."""
    sizes = [range(len(axis)) for axis in axes]

    def pairs(row: tuple[int, ...]) -> set[tuple[int, int, int, int]]:
        return {(a, row[a], b, row[b]) for a, b in itertools.combinations(range(len(row)), 2)}

    rows = list(itertools.product(*sizes))
    left = set().union(*(pairs(row) for row in rows)) if rows else set()
    chosen = []
    while left:
        best = max(rows, key=lambda row: len(pairs(row) & left))
        chosen.append(tuple(axis[i] for axis, i in zip(axes, best, strict=True)))
        left -= pairs(best)
    assert len(chosen) <= math.prod(len(axis) for axis in axes)
    return chosen


def name_of(part: Any) -> str:
    """A short name for test ids."""
    if isinstance(part, gf.KalmanFilter):
        return "-".join(
            [name_of(part.linearization), type(part.update).__name__, type(part.noise).__name__, part.estimate.__name__]
        )
    if isinstance(part, gf.SigmaPoints):
        return repr(part.rule).replace(" ", "")
    return part.__name__ if inspect.isclass(part) else type(part).__name__
