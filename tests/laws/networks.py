"""Instances of networks, of how they are trained and of what they are told, for every law."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

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
    ProductFeatures,
    RadialBasisNetwork,
    SummedNetwork,
    make_radial_basis,
)
from gainful.regression import DecoupledKalmanTraining, KalmanTraining
from gainful.updates import AbstractFeatures, Context, InnovationHistory, JoinedFeatures, UpdateFeatures

TRAININGS: dict[type, list[AbstractTraining]] = {
    AffineTraining: [AffineTraining()],
    CMACTraining: [
        CMACTraining(levels=20, layers=4, least_visits=0),
        CMACTraining(levels=20, layers=4, least_visits=0, groups=((0,), (1, 2)), method="ridge", compress="none"),
        CMACTraining(levels=20, layers=4, least_visits=0, table="hashed", cells=64),
    ],
    DecoupledKalmanTraining: [DecoupledKalmanTraining((3, 2), epochs=1), DecoupledKalmanTraining((2,), groups="all")],
    HarmonicTraining: [HarmonicTraining(), HarmonicTraining(1)],
    KalmanTraining: [KalmanTraining((2,), epochs=1)],
    PerceptronTraining: [
        PerceptronTraining((3,), iterations=5),
        PerceptronTraining((3, 2), method="sgd", epochs=1),
    ],
}


def trained(training: AbstractTraining) -> AbstractNetwork:
    """A network of three inputs and two outputs that has learned something of no meaning."""
    inputs = np.random.default_rng(4).normal(size=(150, 3))
    return training(inputs, 0.02 * np.sin(inputs[:, :2]), key=jax.random.key(4))[0]


def one_of(network: AffineMap) -> AffineMap:
    """The first output alone."""
    return AffineMap(network.matrix[:1], network.offset[:1])


def radial(centres: int, **options: Any) -> RadialBasisNetwork:
    """A radial basis network of three inputs and two outputs, with weights of no meaning."""
    network = make_radial_basis(ProductFeatures([1.0, 2.0, 0.5]), 2, centres, rng=4, **options)
    return network.with_weights(jnp.asarray(np.random.default_rng(4).normal(size=network.weights.shape)))


NETWORKS: dict[type, list[AbstractNetwork]] = {
    AffineMap: [trained(each) for each in TRAININGS[AffineTraining]],
    CMAC: [trained(each) for each in TRAININGS[CMACTraining]],
    HarmonicMap: [trained(each) for each in TRAININGS[HarmonicTraining]],
    MultilayerPerceptron: [trained(each) for each in TRAININGS[PerceptronTraining]],
    RadialBasisNetwork: [radial(5), radial(4, kernel="gaussian", tail="affine"), radial(0, tail="lift")],
    SummedNetwork: [SummedNetwork((radial(5), trained(AffineTraining())))],
}

FEATURES: dict[type, list[AbstractFeatures]] = {
    UpdateFeatures: [UpdateFeatures()],
    InnovationHistory: [InnovationHistory(), InnovationHistory(leaks=(0.5,), square_leaks=())],
    Context: [Context(("heading", "speed", "t"))],
    JoinedFeatures: [JoinedFeatures((UpdateFeatures(), Context(("dt",))))],
}
