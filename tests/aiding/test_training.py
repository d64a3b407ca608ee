"""A correction is learned from records, kept only where it helps on others, and told with a covariance of its own."""

import dataclasses
from collections.abc import Callable

import jax
import numpy as np
import pytest

import gainful as gf
from gainful.aiding import AidingReport, Smoother, aided_filter, validation_gate
from gainful.aiding.gates import mean_squares
from gainful.aiding.playing import gathered, play
from gainful.networks import AffineTraining, CMACTraining
from gainful.updates import Corrected

from .track import DESIGN, TRUTH, prior, static_bound, track_model, tracks

MODEL, FILTER, FIRST = track_model(), gf.kalman_filter(), 60
TABLE = CMACTraining(levels=32, layers=8, method="ridge", least_visits=5)
LESSONS, OTHERS = 24, 10


def trained(logs: list[gf.Log], **options: object) -> tuple[Corrected, AidingReport]:
    given = {"held_out": OTHERS, "key": jax.random.key(0), "training": TABLE, "steady_from": FIRST, "least_visits": 5.0}
    return gf.train_aiding(FILTER, MODEL, prior(), logs, **(given | options))


@pytest.fixture(scope="module")
def logs(generator: Callable[[str], np.random.Generator]) -> list[gf.Log]:
    return tracks(generator("aiding"), LESSONS + OTHERS)


@pytest.fixture(scope="module")
def matched(generator: Callable[[str], np.random.Generator]) -> list[gf.Log]:
    """Records in which the filter is right about its noise."""
    return tracks(generator("matched"), LESSONS + OTHERS, sigmas=DESIGN)


@pytest.fixture(scope="module")
def opened(logs: list[gf.Log]) -> tuple[Corrected, AidingReport]:
    return trained(logs)


def test_open_loop_it_comes_near_the_best_that_one_innovation_allows(opened: tuple[Corrected, AidingReport]) -> None:
    _, report = opened
    variances, bound = static_bound()
    np.testing.assert_allclose(bound, [0.006393, 0.013268], rtol=1e-3)
    # Means over 600 rows, the slow error of the speed alike for some 28 of them.
    np.testing.assert_allclose(report.base, variances, rtol=0.5)
    assert (report.aided < 1.35 * bound).all()
    assert report.components == ("x", "v")
    assert (report.low > 0).all()


def test_its_covariance_holds_where_the_filters_does_not(opened: tuple[Corrected, AidingReport]) -> None:
    update, report = opened
    assert report.nees_of_filter > 10
    assert report.nees == pytest.approx(2.0, rel=0.25)
    # Of the rows that were corrected; a few in the tails were not.
    assert (np.diagonal(update.covariance) <= report.aided).all()
    np.testing.assert_allclose(np.diagonal(update.covariance), report.aided, rtol=0.3)


def test_with_feedback_it_does_better_than_any_map_of_one_innovation(logs: list[gf.Log]) -> None:
    update, report = trained(logs, feedback=True)
    assert update.feedback
    assert len(report.trainings) == 4
    assert report.aided[1] < 0.85 * static_bound()[1][1]
    assert report.components == ("x", "v")


def test_a_filter_that_is_right_is_left_alone(matched: list[gf.Log]) -> None:
    update, report = trained(matched)
    assert report.components == ()
    np.testing.assert_array_equal(report.aided, report.base)
    assert any("nothing is corrected" in text for text in report.warnings)
    assert update.covariance is None
    assert report.passed == 0


def test_where_it_was_not_trained_the_online_gate_stays_shut(
    opened: tuple[Corrected, AidingReport], matched: list[gf.Log]
) -> None:
    states = [np.stack([log.truth["x"], log.truth["v"]], axis=1) for log in matched]
    played = play(FILTER, opened[0], gathered(MODEL, [prior()] * len(matched), matched, states))
    assert played.passed.sum() < 0.05 * played.measured.sum()
    ungated = play(
        FILTER,
        dataclasses.replace(opened[0], gate=None),
        gathered(MODEL, [prior()] * len(matched), matched, states),
    )
    gated, free = (mean_squares(each.errors[:, FIRST:]).mean(axis=0)[1] for each in (played, ungated))
    assert gated < 0.3 * free


def test_the_same_key_gives_the_same_network_to_the_last_bit(
    opened: tuple[Corrected, AidingReport], logs: list[gf.Log]
) -> None:
    again, _ = trained(logs)
    np.testing.assert_array_equal(again.network.weights, opened[0].network.weights)


def test_a_reference_that_is_the_truth_teaches_the_same(
    opened: tuple[Corrected, AidingReport], logs: list[gf.Log]
) -> None:
    states = [np.stack([log.truth["x"], log.truth["v"]], axis=1) for log in logs]
    update, report = trained(logs, teacher="reference", reference=states)
    np.testing.assert_array_equal(update.network.weights, opened[0].network.weights)
    np.testing.assert_array_equal(report.aided, opened[1].aided)


def test_a_smoother_with_fitted_noise_teaches_nearly_as_well_as_the_truth(
    opened: tuple[Corrected, AidingReport], logs: list[gf.Log]
) -> None:
    update, report = trained(logs, teacher="smoother", smoother=Smoother(FILTER, track_model(TRUTH)))
    assert not any("inherits" in text for text in report.warnings)
    # Scored against the smoother; its own errors are part of both scores and small beside them.
    assert report.components == ("x", "v")
    probe = np.linspace(-3.0, 3.0, 13)
    k = 0.93194, 0.00326096
    said = [
        np.array([each.network(np.array([-k[0] * r, -k[1] * r, (1 - k[0]) * r, *k])) for r in probe])
        for each in (update, opened[0])
    ]
    # Speeds up to 0.3 m/s are corrected; the two lessons differ by what the smoother cannot know.
    assert np.abs(said[0] - said[1])[:, 1].mean() < 0.06


def test_a_teacher_that_is_the_pupil_is_warned_of(logs: list[gf.Log]) -> None:
    _, report = trained(logs[-14:], teacher="smoother", training=AffineTraining())
    assert any("inherits its errors" in text for text in report.warnings)


def test_records_may_be_of_any_length_and_lack_some_truth(logs: list[gf.Log]) -> None:
    short = [
        dataclasses.replace(
            log,
            **{name: getattr(log, name)[:rows] for name in ("t", "dt", "u", "y", "seen")},
            truth={"x": log.truth["x"][:rows]},
        )
        for log, rows in zip(logs[:20], [80 + 2 * k for k in range(20)], strict=True)
    ]
    _, report = trained(short, training=AffineTraining(), steady_from=30)
    assert report.components == ("x",)
    assert np.isnan(report.base[1])
    assert any("covariance of the corrected estimate is not known" in text for text in report.warnings)


def test_what_was_trained_runs_as_a_filter_and_survives_its_file(
    opened: tuple[Corrected, AidingReport], logs: list[gf.Log], tmp_path: object
) -> None:
    update, report = opened
    gf.save_part(tmp_path / "aiding.part", update, model=MODEL)
    read = gf.load_part(tmp_path / "aiding.part", model=MODEL, kind=Corrected)
    results = [gf.run(aided_filter(FILTER, each), MODEL, prior(), logs[-1]) for each in (update, read)]
    np.testing.assert_array_equal(results[0].mean, results[1].mean)
    last = np.flatnonzero(np.asarray(results[0].memories[0].passed))[-1]
    np.testing.assert_allclose(results[0].cov[last], update.covariance, rtol=1e-12)
    assert "validated" in str(report)


def test_regions_learn_variances_of_their_own(logs: list[gf.Log]) -> None:
    regions = CMACTraining(levels=8, layers=2, method="ridge", least_visits=0)
    update, _ = trained(logs, training=AffineTraining(), regions=regions)
    result = gf.run(aided_filter(FILTER, update), MODEL, prior(), logs[-1])
    assert np.ptp(result.std[FIRST:, 1]) > 0.01 * result.std[FIRST:, 1].mean()


def test_the_offline_gate_passes_chance_once_in_twenty(rng: np.random.Generator) -> None:
    errors = rng.normal(size=(400, 20, 10, 1))
    other = rng.normal(size=(400, 20, 10, 1))
    passed = sum(bool(validation_gate(one, two)[0]) for one, two in zip(errors, other, strict=True))
    # Five standard deviations of a binomial count; 20 records make the normal quantile a little easier than it says.
    assert abs(passed - 0.058 * 400) < 5 * np.sqrt(400 * 0.05 * 0.95)


def test_rows_without_a_reference_do_not_count() -> None:
    base = np.array([[[1.0], [np.nan], [3.0]], [[1.0], [1.0], [1.0]]])
    np.testing.assert_array_equal(mean_squares(base), [[5.0], [1.0]])
