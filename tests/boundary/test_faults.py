"""Messages of faults: the argument, what was expected, what came."""

import jax
import numpy as np
import pytest

import gainful as gf
from gainful import faults
from gainful.errors import ConfigError, DataError, ModelError, ShapeError

from .problems import stay, walk

KEY = jax.random.key(0)


def plant():
    return walk(B=[[1.0]], inputs=["u"])


def rotating():
    return gf.discrete_model(stay, stay, states={"q": "quaternion"}, outputs={"z": "quaternion"}, Q=0.1, R=1.0)


def turned():
    return gf.make_log(rotating(), [0.0, 1.0], [[0.0, 0.0, 0.0, 1.0]] * 2)


def record():
    return gf.make_log(plant(), [0.0, 1.0, 2.0], np.ones(3), np.ones(3))


def weak(**options):
    return faults.with_faults(plant(), [faults.loss_of_effectiveness("u", **options)])


def prior(model=None):
    model = plant() if model is None else model
    return gf.make_prior(model, np.zeros(model.space.size), np.ones(model.space.size))


def isolability(**options):
    return faults.isolability(weak(), prior(weak()), record(), **options)


def fault_free(t, u=None, runs=1):
    return faults.fault_free_statistics(
        lambda info: info.nis, gf.kalman_filter(), plant(), prior(), t, u, runs=runs, key=KEY
    )


MODELLING = [
    (lambda: faults.Fault("los", "u"), ModelError, "fault kind: 'los' is not one; did you mean 'loss'?"),
    (
        lambda: faults.Fault("loss", "u", -1.0),
        ModelError,
        "walk of 'loss_u': expected a number of at least 0, got -1.0",
    ),
    (
        lambda: faults.Fault("loss", "u", sigma=np.inf),
        ModelError,
        "sigma of 'loss_u': expected a number of at least 0, got inf",
    ),
    (
        lambda: faults.Fault("loss", "u", rate_walk=0.1),
        ModelError,
        "rate_walk of 'loss_u': expected with rate_sigma, which makes the fault drift",
    ),
    (
        lambda: faults.Fault("loss", "u", rate_sigma=0.1, time_constant=2.0),
        ModelError,
        "time_constant of 'loss_u': expected a fault that fades out or one that drifts, not both",
    ),
    (
        lambda: faults.with_faults(plant(), [faults.Fault("loss", "u", rate_sigma=1.0), faults.Fault("loss", "u")]),
        ModelError,
        "faults: 'loss_u' is already a state of the model",
    ),
    (lambda: faults.Fault("loss", "u", bound=0), ModelError, "bound of 'loss_u': expected a number above 0, got 0"),
    (lambda: faults.with_faults(plant(), []), ModelError, "faults: expected at least one, got none"),
    (lambda: faults.with_faults(plant(), ["u"]), ModelError, "faults: expected Fault, got str"),
    (
        lambda: faults.with_faults(weak(), [faults.Fault("loss", "u")]),
        ModelError,
        "faults: 'loss_u' is already a state of the model",
    ),
    (
        lambda: faults.with_faults(plant(), [faults.Fault("bias", "yy")]),
        ModelError,
        "bias: output 'yy' is not one of the model's; did you mean 'y'?",
    ),
    (
        lambda: faults.with_faults(plant(), [faults.Fault("offset", "y")]),
        ModelError,
        "offset: input 'y' is not one of the model's; known: u",
    ),
    (
        lambda: faults.with_faults(rotating(), [faults.sensor_scale_error(rotating().output.tangent_names[0])]),
        ModelError,
        "expected a plain number or an angle, got a Quaternion",
    ),
    (
        lambda: faults.extend_prior(weak(sigma=1.0), prior(weak())),
        ShapeError,
        "prior: expected the states x, got x, loss_u",
    ),
    (
        lambda: faults.extend_prior(weak(), prior()),
        ModelError,
        "sigma of 'loss_u': missing; state it in the fault, or make the prior with make_prior",
    ),
]

INJECTION = [
    (
        lambda: faults.inject(record(), plant(), ["u"], KEY),
        ConfigError,
        "faults: expected Bias, Drift, Stuck, Loss, ..., got str",
    ),
    (
        lambda: faults.inject(record(), plant(), [faults.Bias("v", 1.0)], KEY),
        ConfigError,
        "faults: 'v' is not a signal; known: u, y",
    ),
    (
        lambda: faults.inject(record(), plant(), [faults.Stuck("u", 1.0)], KEY),
        ConfigError,
        "faults: expected a fault of input 'u' that some command explains, got stuck; the plant has answered",
    ),
    (
        lambda: faults.inject(record(), plant(), [faults.Loss("u", 1.0)], KEY),
        ConfigError,
        "faults: expected a fault of input 'u' that some command explains, got loss; the plant has answered",
    ),
    (
        lambda: faults.inject(turned(), rotating(), [faults.Loss(rotating().output.tangent_names[0], 0.5)], KEY),
        ConfigError,
        "a Quaternion, got loss",
    ),
]

DETECTION = [
    (lambda: faults.windowed_mean(np.ones(3), 0), ConfigError, "window: expected a whole number of at least 1, got 0"),
    (
        lambda: faults.chi_square_threshold(1, 1.0),
        ConfigError,
        "probability: expected a number between 0 and 1, got 1.0",
    ),
    (
        lambda: faults.calibrate_threshold(np.ones((2, 3)), np.arange(4.0), 0.1),
        ConfigError,
        "statistics: expected shape (runs, 4), got (2, 3)",
    ),
    (
        lambda: faults.calibrate_threshold(np.ones(4), np.arange(4.0), 0.0),
        ConfigError,
        "rate: expected false alarms per second above 0, got 0.0",
    ),
    (
        lambda: faults.calibrate_threshold(np.ones(4), np.arange(4.0), 0.1),
        DataError,
        "statistics: expected runs of 10 s together at least, got 3 s",
    ),
    (
        lambda: faults.calibrate_threshold(np.ones(4), np.arange(4.0), 1.0, merge=5.0),
        DataError,
        "statistics: expected 3 separate exceedances of some level, found fewer; is merge too long?",
    ),
    (lambda: fault_free([0.0], runs=0), ConfigError, "runs: expected at least 1, got 0"),
    (lambda: fault_free([[0.0]]), ShapeError, "t: expected a vector of times, got shape (1, 1)"),
    (lambda: fault_free([0.0], np.ones((1, 2))), ShapeError, "u: expected shape (1, 1), got (1, 2)"),
]

ISOLATION = [
    (
        lambda: faults.isolability(plant(), prior(), record()),  # type: ignore[arg-type]
        ShapeError,
        "model: expected FaultModel, got Model; make one with with_faults",
    ),
    (lambda: isolability(level=1.0), ConfigError, "level: expected a correlation between 0 and 1, got 1.0"),
    (lambda: isolability(onset=5.0), ConfigError, "onset: expected a time within 0 to 2 s, got 5.0"),
    (lambda: faults.explain(["a"], np.ones(2)), ShapeError, "scores: expected shape (1,), got (2,)"),
    (lambda: faults.explain(["a"], np.ones(1), -1.0), ConfigError, "margin: expected at least 0, got -1.0"),
    (lambda: faults.explain(["a"], [np.nan]), ShapeError, "scores: expected at least one number, got only NaN"),
]

METRICS = [
    (
        lambda: faults.receiver_operating_characteristic([np.nan], [1.0]),
        ConfigError,
        "healthy and faulty: expected values that are not NaN, got none",
    ),
    (
        lambda: faults.window_rmse(np.arange(3.0), np.ones(3), 2.0, 5.0),
        ConfigError,
        "window: expected two rows at least from 2 s to before 5 s",
    ),
    (lambda: faults.missed_alarm_rate([]), ConfigError, "delays: expected at least one value, got none"),
]


@pytest.mark.parametrize(("attempt", "error", "message"), [*MODELLING, *INJECTION, *DETECTION, *ISOLATION, *METRICS])
def test_a_message_of_faults_names_what_was_expected_and_what_came(attempt, error, message):
    with pytest.raises(error) as caught:
        attempt()
    assert message in str(caught.value)
