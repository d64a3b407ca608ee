"""Contenders that are prepared are made once, when they are wanted, and not to be counted or asked for by name."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from gainful.errors import ConfigError
from gainful.studies import Experiment, Prepared, Quantity
from gainful.studies.prepared import once


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


def test_two_contenders_are_made_side_by_side_and_what_both_need_only_once():
    both, found = threading.Barrier(2, timeout=20.0), []

    @once
    def lessons(*, of):
        found.append(of)
        return object()

    def make():
        both.wait()  # which a single thread would never pass
        shared = lessons(of="x")
        return lambda record: shared

    prepared = Prepared({"a": make, "b": make})
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(prepared.__getitem__, ("a", "b"))
    assert first(None) is second(None)
    assert found == ["x"]
    assert lessons.__name__ == "lessons"


def test_what_failed_is_tried_again():
    tries = []

    @once
    def sometimes(x):
        tries.append(x)
        if len(tries) == 1:
            raise ZeroDivisionError
        return x

    with pytest.raises(ZeroDivisionError):
        sometimes(1)
    assert sometimes(1) == sometimes(1) == 1
    assert tries == [1, 1]
