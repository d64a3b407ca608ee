"""The figure of weights, and marks where the filter found a change by itself."""

import dataclasses

import numpy as np
import pytest

from gainful.report import figures_of
from gainful.report.innovations import innovations_of
from gainful.report.marks import marks_of
from gainful.report.weights import weight_sections
from gainful.running import Result


def weighed(result: Result, weight: np.ndarray) -> Result:
    return dataclasses.replace(result, weight=weight)


def sections_of(result: Result):
    return weight_sections(innovations_of(result), 1000)


def points(section, name):
    return {trace.yaxis: trace for trace in section.figure.data if trace.name == name}


@pytest.fixture
def spread(walk, rng):
    """Weights of 0.05 to 1, as a robust update would have."""
    result = walk(200)
    return weighed(result, rng.uniform(0.05, 1.0, size=result.weight.shape))


@pytest.mark.parametrize("weights", [(1.0,), (0.0, 1.0)])
def test_where_all_count_in_full_or_not_at_all_there_is_no_figure(walk, weights):
    result = walk(200)
    some = np.resize(np.array(weights), result.weight.shape)
    assert sections_of(weighed(result, some)) == []
    assert "Weights" not in [section.title for section in figures_of(weighed(result, some))]


def test_every_measurement_is_drawn_at_its_weight(spread):
    (section,) = sections_of(spread)
    high, low = (points(section, name)["y"] for name in ("weight", "less than half"))
    weight = spread.weight[:, 0]
    np.testing.assert_allclose(high.y, weight[weight >= 0.5], rtol=1e-6)
    np.testing.assert_allclose(low.y, weight[weight < 0.5], rtol=1e-6)
    np.testing.assert_allclose(high.x, spread.t[weight >= 0.5], rtol=1e-6)
    assert f"{100 * np.mean(weight < 0.5):.1f} % below half" in section.figure.layout.annotations[0].text


def test_the_running_mean_is_the_mean_of_its_window(spread):
    (section,) = sections_of(spread)
    mean, weight, window = np.asarray(points(section, "running mean")["y"].y), spread.weight[:, 0], 200 // 20
    assert f"of {window} measurements" in section.caption
    assert mean[100] == pytest.approx(weight[95:105].mean(), rel=1e-6)
    assert mean[0] == pytest.approx(weight[:5].mean(), rel=1e-6)


def test_weights_above_one_are_inside_the_panel(walk):
    result = walk(200)
    section = sections_of(weighed(result, np.where(np.arange(200)[:, None] % 2, 1.15, 0.4)))[0]
    assert section.figure.layout.yaxis.range[1] > 1.15


def test_the_figure_follows_the_innovations(spread):
    titles = [section.title for section in figures_of(spread)]
    assert titles.index("Weights") == titles.index("Innovations") + 1


def test_measurements_that_counted_less_than_half_do_not_set_the_innovations_scale(walk):
    result = walk(200)
    residual, weight = result.residual.copy(), np.ones_like(result.weight)
    residual[::10], weight[::10] = 50.0, 0.1  # m, far beyond the others
    shown = dataclasses.replace(result, residual=residual, weight=weight)
    section = next(each for each in figures_of(shown) if each.title == "Innovations")
    assert section.figure.layout.yaxis.range[1] < 5.0
    beyond = points(section, "less than half, beyond")["y"]
    np.testing.assert_allclose(beyond.customdata, 50.0)
    assert "Diamonds counted less than half." in section.caption


def test_alarms_given_are_kept_and_a_filter_without_detection_adds_none(walk):
    assert marks_of(walk(200), {"level": (1.0, 1.5)}) == {"level": [1.0, 1.5]}
    assert marks_of(walk(200), None) == {}
