"""Models of a configuration: from the catalogue, a function or plain functions, or refused with key, file and line."""

import jax.numpy as jnp
import numpy as np
import pytest

from gainful.config import (
    build_model,
)
from gainful.config.parameters import with_parameters
from gainful.config.schema import AugmentSection, ModelSection, ParameterSection, SensorSection
from gainful.errors import ConfigError
from gainful.models import Instant
from gainful.plants import CATALOGUE

GOOD = "import gainful as gf\ndef model(a=1.0):\n    return gf.linear_model([[a]], [[1.0]], Q=0.1, R=1.0)\n"
FUNCTIONS = (
    "def f(x, u, t):\n    return 0.5 * x\ndef h(x, u, t):\n    return x\ndef noise(x, u, t):\n    return [[0.1]]\n"
)
DISCRETE = {"kind": "discrete", "states": ["x"], "outputs": ["y"], "Q": 0.1, "R": 1.0}


@pytest.fixture
def build(tmp_path):
    """The model of a file with this text and a section with these keys."""

    def make(text, **keys):
        (tmp_path / "plant.py").write_text(text)
        return build_model(ModelSection(**{"file": "plant.py"} | keys), tmp_path)

    return make


def moved(model, x):
    """The state after one step of 0.1 s without input, and what is measured there."""
    when = Instant(jnp.asarray(0.1), jnp.asarray(0.1), jnp.zeros(len(model.inputs)))
    after = model.transition(jnp.asarray(x, float), when)
    return np.asarray(after), np.asarray(model.observe(after, when))


@pytest.mark.parametrize("name", CATALOGUE)
def test_models_of_the_catalogue_are_built_and_run_a_step(name, tmp_path):
    model = build_model(ModelSection(catalogue=name), tmp_path)
    turned = name in ("attitude_kinematics", "flexible_spacecraft")  # a quaternion comes first
    x = np.eye(model.space.size)[3] if turned else np.zeros(model.space.size)
    after, measured = moved(model, x)
    assert np.isfinite(after).all()
    assert measured.shape == (model.output.size,)


def test_a_model_is_built_by_a_function_of_a_file(build):
    assert moved(build(GOOD), [2.0])[0] == 2.0
    assert moved(build(GOOD, arguments={"a": 0.25}), [2.0])[0] == 0.5
    assert moved(build(GOOD.replace("def model(", "def plant("), function="plant"), [2.0])[0] == 2.0
    many = GOOD.replace("a=1.0", "**given").replace("[[a]]", "[[given['a']]]")
    assert moved(build(many, arguments={"a": 0.25}), [2.0])[0] == 0.5


def test_a_model_is_built_from_plain_functions(build):
    assert moved(build(FUNCTIONS, **DISCRETE), [2.0]) == (1.0, 1.0)
    # dx/dt = x / 2 for 0.1 s
    continuous = build(FUNCTIONS, **DISCRETE | {"kind": "continuous", "substeps": 2})
    assert moved(continuous, [2.0])[0] == pytest.approx(2.0 * np.exp(0.05), rel=1e-9)


def test_a_model_from_functions_may_have_sensors_parameters_and_biases(build):
    text = FUNCTIONS.replace("0.5 * x", "p['rate'] * x").replace("f(x, u, t)", "f(x, u, t, p)")
    keys = {"kind": "discrete", "states": {"x": [0.0]}, "Q": "noise", "parameters": {"rate": 0.5}}
    sensors = {"near": SensorSection("h", 1.0), "far": SensorSection("h", "noise", {"range": "m"})}
    model = build(text, **keys, sensors=sensors, augment=AugmentSection(biases={"range": 0.1}))
    model = with_parameters(model, {"rate": ParameterSection(0.1, bounds=[0.0, 1.0])})
    assert model.space.names == ("x", "bias_range", "rate")
    assert model.space.tangent_names == ("log(x)", "bias_range", "logit(rate)")
    assert model.output.names == ("near", "range")
    after, measured = moved(model, [2.0, 3.0, 0.25])
    np.testing.assert_allclose(after, [0.5, 3.0, 0.25])
    np.testing.assert_allclose(measured, [0.5, 3.5])


def test_annotations_kept_as_text_are_no_obstacle_in_a_models_file(build):
    text = (
        "from __future__ import annotations\nimport dataclasses\nfrom typing import ClassVar\n"
        "@dataclasses.dataclass\nclass Sizes:\n    a: ClassVar[float] = 1.0\n"
    )
    assert moved(build(text + GOOD), [2.0])[0] == 2.0


def test_a_models_file_may_import_its_neighbours(build, tmp_path):
    (tmp_path / "gains_of_this_test.py").write_text("GAIN = 0.25\n")
    assert moved(build("from gains_of_this_test import GAIN\n" + GOOD.replace("[[a]]", "[[GAIN]]")), [2.0])[0] == 0.5


FAILING = [
    ("x = 1\ny = 1 / 0\n", {}, "model.file: plant.py failed at plant.py line 2: ZeroDivisionError: division by zero"),
    ("def model(:\n", {}, "model.file: plant.py failed: SyntaxError: invalid syntax (plant.py, line 1)"),
    ("raise SystemExit(3)\n", {}, "model.file: plant.py failed at plant.py line 1: SystemExit: 3"),
    ("import no_such_thing\n", {}, "plant.py line 1: ModuleNotFoundError: No module named 'no_such_thing'"),
    (
        "def model():\n    return open('gone')\n",
        {},
        "model.function 'model' failed at plant.py line 2: FileNotFoundError",
    ),
    ("def model():\n    return 3\n", {}, "model: expected the function to return a model, got int"),
    (GOOD, {"function": "modle"}, "model.function: plant.py has no function 'modle'; did you mean 'model'?"),
    (
        GOOD,
        {"arguments": {"aa": 1}},
        "model.arguments.aa: model.function 'model' has no such argument; did you mean 'a'?",
    ),
    (
        GOOD,
        {"arguments": {"a": "x"}},
        "model.function 'model' failed at plant.py line 3: ValueError: could not convert",
    ),
    (GOOD, {"catalogue": "x"}, "model: expected either a catalogue name or a file, got both"),
    (GOOD, {"file": ""}, "model: expected either a catalogue name or a file, got neither"),
    (GOOD, {"file": "plan.py"}, "plan.py not found; did you mean 'plant.py'?"),
    (GOOD, {"file": "gone/plant.py"}, "not found; there is no folder"),
    (GOOD, {"file": "plant.txt"}, "model.file: expected a Python file (.py), got"),
    (GOOD, {"Q": 1.0}, 'model.Q: needs kind = "continuous" or "discrete"'),
    (GOOD, {"f": "rate"}, 'model.f: needs kind = "continuous" or "discrete"'),
    (
        "",
        {"file": "", "catalogue": "constant_velocty"},
        "'constant_velocty' is not known; did you mean 'constant_velocity'?",
    ),
    (
        "",
        {"file": "", "catalogue": "constant_velocity", "Q": 1.0},
        "model.Q: has no effect on a model of the catalogue",
    ),
    (
        "",
        {"file": "", "catalogue": "constant_velocity", "arguments": {"axis": 2}},
        "model.arguments.axis: model.catalogue 'constant_velocity' has no such argument; did you mean 'axes'?",
    ),
    (FUNCTIONS, DISCRETE | {"function": "g"}, 'model.function: has no effect with kind = "discrete"'),
    (FUNCTIONS, DISCRETE | {"substeps": 3}, 'model.substeps: has no effect with kind = "discrete"'),
    (FUNCTIONS, DISCRETE | {"states": None}, "model.states: missing"),
    (FUNCTIONS, DISCRETE | {"Q": None}, "model.Q: missing"),
    (FUNCTIONS, DISCRETE | {"R": None}, "model: R: missing; a model needs h, outputs and R, or sensors"),
    (FUNCTIONS, DISCRETE | {"R": -1.0}, "model: R: expected variances of at least 0, got -1 for 'y'"),
    (FUNCTIONS, DISCRETE | {"f": "ff"}, "model.f: plant.py has no function 'ff'; did you mean 'f'?"),
    (FUNCTIONS, DISCRETE | {"Q": "nois"}, "model.Q: plant.py has no function 'nois'; did you mean 'noise'?"),
    (
        FUNCTIONS,
        DISCRETE | {"states": {"x": [1.0, 0.0]}},
        "model: bounds of 'x': expected lower < upper, got 1.0 and 0.0",
    ),
    (FUNCTIONS, DISCRETE | {"states": {"x": []}}, "model.states.x: expected one or two numbers, got []"),
    (
        FUNCTIONS,
        DISCRETE | {"augment": AugmentSection()},
        "model: augment: expected at least one parameter or bias, got none",
    ),
    (
        FUNCTIONS,
        DISCRETE | {"augment": AugmentSection(biases={"yy": 0.0})},
        "model: bias: signal 'yy' is not one of the model's; did you mean 'y'?",
    ),
]


@pytest.mark.parametrize(("text", "keys", "expected"), FAILING)
def test_a_model_that_cannot_be_built_is_told_with_key_file_and_line(build, text, keys, expected):
    with pytest.raises(ConfigError) as caught:
        build(text, **keys)
    assert expected in str(caught.value)
