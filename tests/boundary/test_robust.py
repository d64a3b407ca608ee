"""Numbers of robust updates and of noise laws that make no sense."""

import pytest

import gainful as gf
from gainful.errors import ConfigError
from gainful.updates import (
    HuberReweighted,
    MasreliezMartin,
    MaximumCorrentropy,
    StudentT,
    WeightedLikelihood,
    huber_threshold,
)


def biased() -> gf.models.AugmentedModel:
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0, states=["x"], outputs=["y"], parameters={"gain": 1.0})
    return gf.augment(model, parameters={"gain": 0.0})


PRIOR = gf.make_prior(biased(), {"x": 0.0, "gain": 1.0}, {"x": 0.1, "gain": 0.1})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: huber_threshold(1.0), "contamination: expected a share from 0 to less than 1, got 1.0"),
        (lambda: MasreliezMartin(threshold=0.0), "threshold: expected a number of sigmas above 0, got 0.0"),
        (lambda: MasreliezMartin(covariance="mean"), "covariance: 'mean' is not known; "),
        (
            lambda: MasreliezMartin(covariance="expectation", joint=True),
            'joint: expected covariance = "indicator" with it, got "expectation"',
        ),
        (lambda: MasreliezMartin(whitening="pca"), "whitening: 'pca' is not known; "),
        (lambda: HuberReweighted(iterations=0), "iterations: expected a whole number of at least 1, got 0"),
        (lambda: StudentT(dof=0.0), "dof: expected degrees of freedom above 0, got 0.0"),
        (lambda: MaximumCorrentropy(bandwidth=-1.0), "bandwidth: expected a number of sigmas above 0, got -1.0"),
        (lambda: WeightedLikelihood(scale=0.0), "scale: expected a number of sigmas above 0, got 0.0"),
        (lambda: gf.Gated(by="row"), "by: 'row' is not known; "),
        (lambda: gf.ChangeDetection({"p": 0.0}), "jumps: expected a size above 0 for 'p', got 0.0"),
        (lambda: gf.ChangeDetection({}, arm_after=-1), "arm_after: expected a whole number of at least 0, got -1"),
        (lambda: gf.ChangeDetection({}, threshold=-1.0), "threshold: expected a number of at least 0, got -1.0"),
        (lambda: gf.ChangeDetection({}, action="reset"), "action: 'reset' is not known; "),
        (lambda: gf.Capped({"p": 0.0}), "limits: expected a standard deviation above 0 for 'p', got 0.0"),
        (
            lambda: gf.KalmanFilter(update=gf.ChangeDetection({"gian": 0.3})).init(biased(), PRIOR),
            "jumps: 'gian' is not a state of the model; did you mean 'gain'",
        ),
        (
            lambda: gf.KalmanFilter(noise=gf.Capped({"gian": 0.3})).init(biased(), PRIOR),
            "limits: 'gian' is not a state of the model; did you mean 'gain'",
        ),
    ],
)
def test_numbers_that_make_no_sense_are_refused(make, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make()
    assert message in str(caught.value)
