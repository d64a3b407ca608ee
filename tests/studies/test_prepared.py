"""Contenders that are prepared are made once, when they are wanted, and not to be counted or asked for by name."""

import pytest

from gainful.errors import ConfigError
from gainful.studies import Experiment, Prepared, Quantity


def counting():
    made = []

    def maker(name):
        def make():
            made.append(name)
            return lambda record: (name, record)

        return make

    return Prepared({name: maker(name) for name in ("a", "b")}), made


def experiment(contenders, baseline=""):
    return Experiment(
        "e", "E", lambda key: key, contenders, lambda record, reading: {}, (Quantity("q", "q"),), None, baseline
    )


def test_a_contender_is_made_when_it_is_first_wanted_and_then_kept():
    prepared, made = counting()
    assert list(prepared) == ["a", "b"]
    assert len(prepared) == 2
    assert "b" in prepared
    assert not made
    assert prepared["b"](1) == ("b", 1)
    assert prepared["b"] is prepared["b"]
    assert made == ["b"]
    assert [contender(0)[0] for contender in prepared.values()] == ["a", "b"]
    assert made == ["b", "a"]


def test_an_experiment_is_checked_without_making_its_contenders():
    prepared, made = counting()
    experiment(prepared, "a")
    with pytest.raises(ConfigError, match="baseline 'c' is not a contender"):
        experiment(prepared, "c")
    assert not made
    with pytest.raises(KeyError):
        prepared["c"]
