"""How far measurements counted: told from the weights, and a filter that has shut itself off is found out."""

import numpy as np
import pytest

import gainful as gf
from gainful.diagnostics import verdict, weighing

WINDOW = 20
JUMP = 60  # row at which the level moves by a hundred sigmas


def level_model():
    return gf.linear_model(
        [[1.0]], [[1.0], [1.0]], Q=1e-6, R=[0.01, 0.01], states={"level": "m"}, outputs={"upper": "m", "lower": "m"}
    )


def ran(y, update, gain=1.0):
    model = level_model()
    prior = gf.make_prior(model, [0.0], [0.1])
    log = gf.make_log(model, gain * np.arange(len(y)), y)
    return gf.run(gf.kalman_filter(update=update), model, prior, log)


@pytest.fixture
def noisy(rng):
    return 0.1 * rng.normal(size=(150, 2))


@pytest.fixture
def spiked(noisy, rng):
    """One reading of the upper sensor in five is off by thirty sigmas, some are missing."""
    noisy[:, 0] += np.where(rng.random(len(noisy)) < 0.2, 3.0, 0.0)
    noisy[::7] = np.nan
    return ran(noisy, gf.MasreliezMartin())


def test_shares_and_means_are_those_of_the_weights(spiked):
    for j, each in enumerate(weighing(spiked)):
        weight = spiked.weight[spiked.seen[:, j], j]
        assert len(weight) == 150 - 22
        assert each.signal == ("upper", "lower")[j]
        assert each.mean == pytest.approx(weight.mean())
        assert each.clipped == pytest.approx(np.mean(weight < 1))
        assert each.outliers == pytest.approx(np.mean(weight < 0.5))


def test_the_sensor_with_outliers_is_the_one_that_counts_less(spiked):
    upper, lower = weighing(spiked)
    assert 0.1 < upper.outliers < 0.35  # one in five, within three sigmas of a share of 128
    assert lower.outliers < 0.1
    assert upper.locked is None
    assert upper.warning == ""


def test_with_an_exact_update_everything_counts_in_full(noisy):
    for each in weighing(ran(noisy, gf.Exact())):
        assert (each.mean, each.clipped, each.outliers, each.locked) == (1.0, 0.0, 0.0, None)


def test_a_signal_that_was_never_measured_has_no_mean_weight(noisy):
    noisy[:, 1] = np.nan
    upper, lower = weighing(ran(noisy, gf.Exact()))
    assert upper.mean == 1.0
    assert np.isnan(lower.mean)
    assert (lower.clipped, lower.outliers, lower.locked) == (0.0, 0.0, None)


def test_a_filter_that_shuts_itself_off_from_one_sensor_is_told_of_with_its_time(noisy):
    noisy[JUMP:, 0] += 10.0
    result = ran(noisy, gf.WeightedLikelihood(), gain=0.5)
    upper, lower = weighing(result, window=WINDOW, most=0.6)
    # Nothing counted less than half before; the thirteenth of twenty is the first beyond 60 %.
    assert not (result.weight[:JUMP, 0] < 0.5).any()
    assert (result.weight[JUMP:, 0] < 0.5).all()
    assert upper.locked == 0.5 * (JUMP + 12)
    assert lower.locked is None
    assert upper.warning == (
        "more than 60 % of 20 measurements of upper in a row counted less than half, first at t = 36 s: "
        "the model or R is wrong, or something failed"
    )


def test_rows_without_a_measurement_do_not_count_among_those_in_a_row(noisy):
    noisy[JUMP:, 0] += 10.0
    noisy[1::2, 0] = np.nan
    upper, _ = weighing(ran(noisy, gf.WeightedLikelihood()), window=WINDOW, most=0.6)
    assert upper.locked == JUMP + 2 * 12


def test_fewer_measurements_than_the_window_are_not_judged(noisy):
    noisy[:, 0] += 10.0
    result = ran(noisy, gf.WeightedLikelihood())
    assert weighing(result, window=150)[0].locked == 149.0
    assert weighing(result, window=151)[0].locked is None


def test_the_verdict_warns_of_a_filter_that_shut_itself_off(noisy, rng):
    more = np.concatenate([noisy, 10.0 + 0.1 * rng.normal(size=(250, 2))])
    told = verdict(ran(more, gf.WeightedLikelihood())).warnings
    assert [text.split(" in a row")[0] for text in told] == [
        f"more than 60 % of 200 measurements of {name}" for name in ("upper", "lower")
    ]
    assert verdict(ran(more, gf.Exact())).warnings == ()


def test_of_a_smoothed_result_the_filter_is_judged(spiked):
    assert weighing(gf.smooth(spiked)) == weighing(spiked)
