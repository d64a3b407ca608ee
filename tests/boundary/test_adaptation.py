"""Messages of adaptive updates, banks and two-stage parts: the argument, what was expected, what came."""

import re

import pytest

import gainful as gf
from gainful.config import make_filter, parse_config
from gainful.config.build import build_faults, build_filter
from gainful.errors import ConfigError
from gainful.filters import GeneralizedLikelihoodRatio, InteractingMultipleModel
from gainful.linearization import MarginalSigmaPoints
from gainful.noise import Scaled
from gainful.updates import Considered, InnovationScaling, StrongTracking

from .problems import walk

PLAIN = gf.KalmanFilter()


def with_bias():
    return gf.augment(walk(), biases={"y": 0.1})


def prior(model):
    return gf.make_prior(model, [0.0] * model.space.size, [1.0] * model.space.size)


def config(**changes):
    table = {
        "model": {"catalogue": "planar_vehicle"},
        "data": {"file": "a.csv", "time": "t", "outputs": {"y": "y"}},
        "prior": {"mean": [0.0]},
    }
    return parse_config(table | changes)


MESSAGES = [
    (lambda: InnovationScaling(order=("bais",)), "order: 'bais' is not a channel; did you mean 'bias'?"),
    (lambda: InnovationScaling(order=()), "order: expected one or more channels, each once, got []"),
    (
        lambda: InnovationScaling(order=("bias", "bias")),
        "order: expected one or more channels, each once, got ['bias', 'bias']",
    ),
    (lambda: InnovationScaling(window=0), "window: expected a whole number of at least 1, got 0"),
    (lambda: InnovationScaling(gate=1.5), "gate: expected a number from 0 to 1, got 1.5"),
    (lambda: InnovationScaling(cap=0.5), "cap: expected a number of at least 1, got 0.5"),
    (lambda: InnovationScaling(bounds={"b": 0.0}), "bounds: expected a size above 0 for 'b', got 0.0"),
    (
        lambda: InnovationScaling(bounds={"bias_x": 1.0}).init(with_bias()),
        "bounds: 'bias_x' is not an added state; did you mean 'bias_y'?",
    ),
    (
        lambda: InnovationScaling(bounds={"bias_x": 1.0}).init(walk()),
        "bounds: 'bias_x' is not an added state; nothing was added to the model",
    ),
    (lambda: StrongTracking(memory=2.0), "memory: expected a number from 0 to 1, got 2.0"),
    (lambda: StrongTracking(softening=0.0), "softening: expected a number of at least 1, got 0.0"),
    (lambda: StrongTracking(cap=0.0), "cap: expected a number of at least 1, got 0.0"),
    (lambda: Considered(("z",)).init(walk()), "states: 'z' is not a state of the model; known: x"),
    (lambda: Scaled({"x": -1.0}), "states: expected a factor of at least 0 for 'x', got -1.0"),
    (lambda: Scaled(outputs={"z": 1.0}).init(walk()), "outputs: 'z' is not one of the model's; known: y"),
    (lambda: MarginalSigmaPoints(form="bias free"), "form: 'bias free' is not known; did you mean 'bias_free'?"),
    (lambda: InteractingMultipleModel(()), "members: expected at least one filter, got none"),
    (
        lambda: InteractingMultipleModel((PLAIN, gf.KalmanFilter(estimate=gf.SquareRoot)), ((1.0, 0.0), (0.0, 1.0))),
        "members: expected filters with the same coordinates of the estimate",
    ),
    (
        lambda: InteractingMultipleModel((PLAIN, PLAIN), ((0.9, 0.2), (0.0, 1.0))),
        "transition: expected 2 rows of 2 probabilities that sum to 1, got ((0.9, 0.2), (0.0, 1.0))",
    ),
    (
        lambda: InteractingMultipleModel((PLAIN,), ((1.0,),), (0.5,)),
        "start: expected 1 probabilities that sum to 1, got (0.5,)",
    ),
    (lambda: GeneralizedLikelihoodRatio(window=0), "window: expected a whole number of at least 1, got 0"),
    (lambda: GeneralizedLikelihoodRatio(threshold=0.0), "threshold: expected a number above 0, got 0.0"),
    (
        lambda: GeneralizedLikelihoodRatio(bounds={"b": -1.0}),
        "bounds: expected a size above 0 for 'b', got -1.0",
    ),
    (
        lambda: GeneralizedLikelihoodRatio().init(walk(), prior(walk())),
        "model: expected added states (biases, faults) that can jump, got none; see augment",
    ),
    (
        lambda: GeneralizedLikelihoodRatio(bounds={"x": 1.0}).init(with_bias(), prior(with_bias())),
        "bounds: 'x' is not an added state; known: bias_y",
    ),
    (
        lambda: make_filter({"kind": "glr", "quiet": "imm"}),
        "filter.quiet: expected a single filter, got a InteractingMultipleModel",
    ),
    (lambda: make_filter({"kind": "imm", "members": "ekf"}), "filter.members: expected a list of filters, got 'ekf'"),
    (
        lambda: build_filter(config(filter="glr", options={"gate": 0.999}), walk()),
        "options.gate: expected a single filter to gate, got a GeneralizedLikelihoodRatio",
    ),
    (
        lambda: build_faults(config(faults={"states": [], "threshold": 0.0}), walk()),
        "faults.threshold: expected a number above 0, got 0.0",
    ),
    (
        lambda: build_faults(config(faults={"states": [], "false_alarms": -1.0}), walk()),
        "faults.false_alarms: expected a number above 0, got -1.0",
    ),
    (
        lambda: build_faults(config(faults={"states": [{"kind": "bias", "signal": "z", "sigma": 1.0}]}), walk()),
        "faults: bias: output 'z' is not one of the model's; known: y",
    ),
]


@pytest.mark.parametrize(("act", "message"), MESSAGES, ids=[message[:50] for _, message in MESSAGES])
def test_what_is_wrong_is_named(act, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        act()
