"""Messages of noise laws, of fitting the noise and of diagnosing it: the argument, what was expected, what came."""

import pytest

import gainful as gf
from gainful.errors import ConfigError

LAWS = [
    (lambda: gf.SageHusa(memory=0.0), "memory: expected a number above 0 and at most 1, got 0.0"),
    (lambda: gf.SageHusa(floor=2.0), "floor: expected a factor above 0 and at most 1, got 2.0"),
    (lambda: gf.SageHusa(ceiling=0.5), "ceiling: expected a factor of at least 1, got 0.5"),
    (lambda: gf.SageHusa(patience=0), "patience: expected a whole number of at least 1, got 0"),
    (lambda: gf.InnovationMatching(window=0), "window: expected a whole number of at least 1, got 0"),
    (lambda: gf.InnovationMatching(settle=-1), "settle: expected a whole number of at least 0, got -1"),
    (lambda: gf.InnovationMatching(ceiling=float("nan")), "ceiling: expected a factor of at least 1, got nan"),
    (lambda: gf.VariationalNoise(start=0.0), "start: expected a number above 0, got 0.0"),
    (lambda: gf.VariationalNoise(iterations=0), "iterations: expected a whole number of at least 1, got 0"),
    (lambda: gf.VariationalCovariances(prediction=0.0), "prediction: expected a number above 0, got 0.0"),
    (lambda: gf.VariationalCovariances(memory=1.5), "memory: expected a number above 0 and at most 1, got 1.5"),
]


@pytest.mark.parametrize(("attempt", "message"), LAWS)
def test_a_noise_law_names_the_argument_what_was_expected_and_what_came(attempt, message):
    with pytest.raises(ConfigError) as caught:
        attempt()
    assert message in str(caught.value)
