"""Configurations: what is written wrong is said with its key, what was expected and what came."""

import copy
import tomllib

import pytest

import gainful as gf
from gainful.config import (
    FILTERS,
    KINDS,
    build_filter,
    build_model,
    build_prior,
    dump_part,
    load_config,
    make_filter,
    make_part,
    parse_config,
)
from gainful.config.parts import ACRONYMS
from gainful.errors import ConfigError
from gainful.estimates import AbstractEstimate
from gainful.plants import CATALOGUE

TEXT = """
filter = "ekf"
[model]
catalogue = "constant_velocity"
arguments = { axes = 1 }
[data]
file = "log.csv"
outputs.measured_x = "x"
[prior]
mean = { x = 0, vx = 0.5 }
std = [1.0, 2]
"""


def changed(path, value):
    """The configuration with one key set, or taken out if the value is None."""
    table = copy.deepcopy(tomllib.loads(TEXT))
    *folders, last = path.split("/")
    place = table
    for key in folders:
        place = place.setdefault(key, {})
    if value is None:
        del place[last]
    else:
        place[last] = value
    return table


def message(attempt):
    with pytest.raises(ConfigError) as caught:
        attempt()
    return str(caught.value)


# ---------------------------------------------------------------- the file


def test_a_whole_file_is_read(tmp_path):
    (tmp_path / "run.toml").write_text(TEXT)
    config = load_config(tmp_path / "run.toml")
    assert config.data.outputs["measured_x"] == gf.Column("x")
    model = build_model(config.model, tmp_path)
    prior = build_prior(config, model)
    assert prior.mean.tolist() == [0.0, 0.5]
    assert prior.cov.tolist() == [[1.0, 0.0], [0.0, 4.0]]
    assert build_filter(config, model) == gf.extended_kalman_filter()


def test_a_missing_file_is_answered_with_the_nearest(tmp_path):
    (tmp_path / "run.toml").write_text(TEXT)
    assert message(lambda: load_config(tmp_path / "rum.toml")).endswith("rum.toml: not found; did you mean 'run.toml'?")
    assert message(lambda: load_config(tmp_path / "no" / "run.toml")).endswith("run.toml: not found")


def test_a_folder_in_place_of_a_file_says_what_is_in_it(tmp_path):
    (tmp_path / "run.toml").write_text(TEXT)
    assert "expected a file, got a folder; there is run.toml in it" in message(lambda: load_config(tmp_path))


def test_a_mistake_in_the_syntax_is_told_with_its_line(tmp_path):
    (tmp_path / "run.toml").write_text("[model]\nfile = model.py\n")
    told = message(lambda: load_config(tmp_path / "run.toml"))
    assert "run.toml: not valid TOML:" in told
    assert "line 2" in told
    (tmp_path / "run.toml").write_bytes(b"title = '\xff'\n")
    assert "not valid TOML: not UTF-8 text" in message(lambda: load_config(tmp_path / "run.toml"))


def test_a_file_without_permission_is_told(tmp_path, as_nobody):
    (tmp_path / "run.toml").write_text(TEXT)
    (tmp_path / "run.toml").chmod(0)
    with as_nobody():
        assert message(lambda: load_config(tmp_path / "run.toml")).endswith("cannot be read: Permission denied")


def test_a_mistake_in_a_file_is_told_with_the_name_of_the_file(tmp_path):
    (tmp_path / "run.toml").write_text(TEXT.replace("filter", "filtr"))
    assert message(lambda: load_config(tmp_path / "run.toml")) == (
        "configuration run.toml: filtr: unknown key; did you mean 'filter'?"
    )


# ---------------------------------------------------------------- keys and values

KEYS = {
    "modl": ({}, "modl: unknown key; did you mean 'model'?"),
    "model/catalog": ("x", "model.catalog: unknown key; did you mean 'catalogue'?"),
    "model/augment": ({"biass": {}}, "model.augment.biass: unknown key; did you mean 'biases'?"),
    "model/sensors": (
        {"gps": {"h": "h", "R": 1, "output": "x"}},
        "model.sensors.gps.output: unknown key; did you mean 'outputs'?",
    ),
    "data/tme": ("t", "data.tme: unknown key; did you mean 'time'?"),
    "data/outputs/measured_x": (
        {"column": "x", "unt": "m"},
        "data.outputs.measured_x.unt: unknown key; did you mean 'unit'?",
    ),
    "data/inputs": ({"u": {"column": "u", "hld": "next"}}, "data.inputs.u.hld: unknown key; did you mean 'hold'?"),
    "data/truth": ({"x": {"column": "u", "fil": "a"}}, "data.truth.x.fil: unknown key; did you mean 'file'?"),
    "data/local": (
        [{"latitude": "a", "longitude": "b", "hight": "c"}],
        "data.local.0.hight: unknown key; did you mean 'height'?",
    ),
    "prior/men": ({}, "prior.men: unknown key; did you mean 'mean'?"),
    "options/smoth": (True, "options.smoth: unknown key; did you mean 'smooth'?"),
    "options/x": (True, "options.x: unknown key; known: aiding, gate, lag, reacquire, smooth, throw"),
}


@pytest.mark.parametrize("path", KEYS)
def test_a_typo_in_a_key_is_answered_with_the_nearest_key(path):
    value, expected = KEYS[path]
    assert message(lambda: parse_config(changed(path, value))) == expected


@pytest.mark.parametrize("path", ["model", "data", "prior", "data/outputs", "prior/mean"])
def test_a_missing_key_is_named(path):
    assert message(lambda: parse_config(changed(path, None))) == f"{path.replace('/', '.')}: missing"


def test_several_mistakes_are_told_at_once():
    table = changed("data/outputs/measured_x", {"colum": "x"})
    assert message(lambda: parse_config(table)) == (
        "data.outputs.measured_x.column: missing; data.outputs.measured_x.colum: unknown key; did you mean 'column'?"
    )


VALUES = [
    ("model", 3, "model: expected a table, got 3"),
    ("model/kind", "continous", "model.kind: expected 'continuous' or 'discrete', got 'continous'; did you mean"),
    ("model/states", 3.5, "model.states: expected a whole number, a list of texts or a table, got 3.5"),
    ("model/states", {"x": 3}, "model.states.x: expected text or a list of numbers, got 3"),
    ("model/substeps", 1.5, "model.substeps: expected a whole number, got 1.5"),
    ("model/substeps", True, "model.substeps: expected a whole number, got true"),
    (
        "model/R",
        {"a": 1},
        "model.R: expected a number, a list of numbers, a list of lists of numbers or text, got {'a'",
    ),
    ("model/augment", {"biases": {"y": "a"}}, "model.augment.biases.y: expected a number, got 'a'"),
    ("data/late", "sorted", "data.late: expected 'refuse' or 'sort', got 'sorted'; did you mean 'sort'?"),
    ("data/duplicates", "drop", "data.duplicates: expected 'refuse', 'keep', 'first' or 'last', got 'drop'"),
    ("data/time", 3, "data.time: expected text, got 3"),
    ("data/max_step", "a", "data.max_step: expected a number, got 'a'"),
    ("data/outputs", [], "data.outputs: expected a table, got []"),
    ("data/outputs/measured_x", 3, "data.outputs.measured_x: expected a column's name or a table, got 3"),
    (
        "data/outputs/measured_x",
        {"column": "x", "missing": -9},
        "measured_x.missing: expected a list of numbers, got -9",
    ),
    (
        "data/inputs",
        {"u": {"column": "x", "hold": "prev"}},
        "data.inputs.u.hold: expected 'previous', 'next' or 'linear'",
    ),
    ("data/local", {"latitude": "a"}, "data.local: expected a list of tables, got {'latitude': 'a'}"),
    ("prior/mean", "a", "prior.mean: expected a table or a list of numbers, got 'a'"),
    ("prior/mean", {"x": "a", "vx": 0}, "prior.mean.x: expected a number or a list of numbers, got 'a'"),
    ("prior/std", [1, "a"], "prior.std.1: expected a number, got 'a'"),
    ("prior/cov", [[1, 2], 3], "prior.cov.1: expected a list of numbers, got 3"),
    ("options/smooth", "perhaps", "options.smooth: expected true or false, got 'perhaps'"),
    ("options/gate", True, "options.gate: expected a number, got true"),
    ("filter", 3, "filter: expected text or a table, got 3"),
    ("title", "a" * 500 + "b", None),
    ("title", ["a" * 500], "title: expected text, got ['" + "a" * 75 + "..."),
]


@pytest.mark.parametrize(("path", "value", "expected"), VALUES)
def test_a_value_of_the_wrong_kind_is_told_with_what_was_expected(path, value, expected):
    if expected is None:
        assert parse_config(changed(path, value)).title == value
    else:
        assert expected in message(lambda: parse_config(changed(path, value)))


# ---------------------------------------------------------------- parts

TABLES = [
    *({"kind": kind} for kind in FILTERS),
    {"kind": "ukf", "alpha": 0.5, "beta": 1.0, "kappa": 1, "square_root": True},
    {"kind": "iekf", "iterations": 3, "square_root": True},
    {"kind": "ekf", "update": {"kind": "gated", "probability": 0.9, "reacquire": 3, "inner": {"kind": "iterated"}}},
    {"kind": "assembled", "linearization": {"kind": "sigma_points", "rule": {"kind": "gauss_hermite", "order": 4}}},
    {"kind": "assembled", "noise": "nominal", "estimate": "square_root", "update": "exact"},
]


@pytest.mark.parametrize("table", TABLES, ids=lambda table: "-".join(map(str, table)))
def test_a_filter_written_down_is_the_same_filter(table):
    part = make_filter(table)
    assert make_filter(dump_part(part)) == part
    assert dump_part(make_filter(dump_part(part))) == dump_part(part)


@pytest.mark.parametrize(("slot", "kind"), [(slot, kind) for slot, kinds in KINDS.items() for kind in kinds])
def test_a_part_written_down_is_the_same_part(slot, kind):
    if slot is AbstractEstimate:
        chosen = make_filter({"kind": "assembled", "estimate": kind})
        assert chosen.estimate is KINDS[slot][kind]
        assert dump_part(chosen)["estimate"] == kind
        return
    needed = {"context": {"signals": ["t"]}}  # of parts that cannot be without
    part = make_part(slot, {"kind": kind} | needed.get(kind, {}), "here")
    assert type(part) is KINDS[slot][kind]
    assert make_part(slot, dump_part(part), "here") == part


@pytest.mark.parametrize(("short", "name"), ACRONYMS.items())
def test_an_acronym_is_the_filter_it_stands_for(short, name):
    assert make_filter(short) == make_filter(name) == FILTERS[name]()


PARTS = [
    ("ukff", "filter.kind: 'ukff' is not a filter; did you mean 'ukf'?"),
    ({"kind": "ukf", "alpa": 1}, "filter.alpa: unknown key; did you mean 'alpha'?"),
    ({"kind": "ukf", "alpha": "a"}, "filter.alpha: expected a number, got 'a'"),
    ({"kind": "ukf", "alpha": True}, "filter.alpha: expected a number, got true"),
    ({"kind": "ukf", "alpha": 0}, "filter: alpha: expected a number above 0, got 0.0"),
    ({"kind": "ukf", "square_root": 1}, "filter.square_root: expected true or false, got 1"),
    ({"kind": "iekf", "iterations": 2.0}, "filter.iterations: expected a whole number, got 2.0"),
    ({"kind": "iekf", "iterations": 0}, "filter: iterations: expected a whole number of at least 1, got 0"),
    ({"alpha": 1}, "filter: expected a name or a table with a kind, got {'alpha': 1}"),
    ({"kind": "ekf", "update": 3}, "filter.update: expected a name or a table with a kind, got 3"),
    ({"kind": "ekf", "update": "gatd"}, "filter.update.kind: 'gatd' is not known here; did you mean 'gated'?"),
    (
        {"kind": "assembled", "estimate": "square"},
        "filter.estimate: 'square' is not known here; did you mean 'square_root'?",
    ),
    (
        {"kind": "ekf", "update": {"kind": "gated", "inner": {"kind": "iterated", "inner": "exct"}}},
        "filter.update.inner.inner.kind: 'exct' is not known here; did you mean 'exact'?",
    ),
    (
        {"kind": "assembled", "linearization": {"kind": "sigma_points", "rule": {"kind": "gauss_hermite", "order": 1}}},
        "filter.linearization.rule: order: expected a whole number of at least 2, got 1",
    ),
]


@pytest.mark.parametrize(("table", "expected"), PARTS)
def test_a_mistake_in_a_part_is_told_with_its_place(table, expected):
    assert message(lambda: make_filter(table)) == expected


def test_a_part_without_a_name_cannot_be_written_down():
    assert message(lambda: dump_part(gf.Log)) == "type has no name in configuration files"


BARE = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)


def test_a_gate_wraps_the_update_of_the_filter():
    table = changed("options/gate", 0.99)
    table["options"]["reacquire"] = 4
    assert build_filter(parse_config(table), BARE).update == gf.Gated(gf.Exact(), 0.99, 4)


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("gate", 1.5, "options: gate: expected a number above 0 and at most 1, got 1.5"),
        ("reacquire", -1, "options: reacquire: expected a whole number of at least 0, got -1"),
    ],
)
def test_a_gate_that_cannot_be_is_told_by_its_key(key, value, expected):
    table = changed("options/gate", 0.99)
    table["options"][key] = value
    assert message(lambda: build_filter(parse_config(table), BARE)) == expected


PRIORS = [
    ("prior/mean", {"x": 0, "v": 0}, "prior mean: 'v' is not a state of the model; did you mean 'vx'?"),
    ("prior/mean", {"x": 0}, "prior mean: expected a value for 'vx', got only 'x'"),
    ("prior/mean", [1.0], "prior mean: expected shape (2,) (x, vx), got (1,)"),
    ("prior/std", {"x": [1.0, 2.0], "vx": 1}, "prior std of 'x': expected 1 number, got [1.0, 2.0]"),
    ("prior/std", [1, -1], "prior std of 'vx': expected at least 0, got -1"),
    ("prior/cov", [[1, 0], [0, 1]], "prior: expected either std or cov, got both"),
    ("prior/std", None, "prior: expected either std or cov, got neither"),
]


@pytest.mark.parametrize(("path", "value", "expected"), PRIORS)
def test_a_prior_that_does_not_fit_the_model_is_the_configurations_fault(path, value, expected):
    config = parse_config(changed(path, value))
    model = CATALOGUE["constant_velocity"](axes=1)
    assert message(lambda: build_prior(config, model)) == expected
