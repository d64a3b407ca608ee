"""What the figures show, and what they must not hide."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import gainful as gf
from gainful.report import Section, figures_of
from gainful.report.panels import add_band, panels, set_range
from gainful.report.series import aligned, compact, drawable, extremes, scattered, settled_range
from gainful.report.states import error_sections, state_sections
from gainful.report.trajectory import position_pairs
from gainful.running import Result
from gainful.spaces import make_space


def of(drawn: Result | list[Section], title: str) -> Section:
    sections = figures_of(drawn) if isinstance(drawn, Result) else drawn
    return next(section for section in sections if section.title == title)


def lines(section: Section, name: str) -> list:
    return [trace for trace in section.figure.data if trace.name == name]


@pytest.mark.parametrize("seed", range(3))
def test_thinning_keeps_extremes_and_ends(seed):
    random = np.random.default_rng(seed)
    values = [random.normal(size=40_001) for _ in range(3)]
    values[1][random.integers(40_001, size=3)] = 50.0, -50.0, 40.0  # spikes of one row
    values[2][1000:9000] = np.nan
    rows = extremes(values, 2500)
    assert len(rows) <= 2500
    assert (rows[0], rows[-1]) == (0, 40_000)
    for line in values:
        assert np.nanmin(line[rows]) == np.nanmin(line)
        assert np.nanmax(line[rows]) == np.nanmax(line)
    assert {50.0, -50.0, 40.0} <= set(values[1][rows])


def test_short_lines_are_not_thinned():
    assert extremes([np.arange(100.0)], 100).tolist() == list(range(100))


def test_scattered_points_keep_extremes_and_stay_few():
    values = np.random.default_rng(0).normal(size=100_000)
    values[77_777] = 9.0
    chosen = scattered(values, 2500)
    assert 77_777 in chosen
    assert len(chosen) <= 2500


def test_lines_are_interrupted_at_long_gaps_and_not_at_unknown_values():
    t = np.concatenate([np.arange(100.0), np.arange(150.0, 250.0)])
    y = np.where(np.arange(200) % 2 == 0, 1.0, np.nan)
    times, values = drawable(t, y)
    assert np.isnan(values).sum() == 1
    assert times[np.isnan(values)] == 98.0
    assert np.isfinite(times).all()


def test_rounding_is_only_accepted_where_it_cannot_be_seen():
    assert compact(np.linspace(0, 1, 10)).dtype == np.float32
    assert compact(6_378_137.0 + np.linspace(0, 1, 10)).dtype == np.float64  # m, on the surface of the Earth


def test_a_start_up_transient_does_not_flatten_a_panel():
    t = np.arange(1000.0)
    band = np.where(t < 5, 1e4, 1.0)
    low, high, cut = settled_range(t, [np.sin(t)], [band, -band])
    assert cut
    assert -2 < low < -1 < 1 < high < 2
    late = np.where(t > 900, 1e4, 1.0)
    assert settled_range(t, [np.sin(t)], [late])[1] > 1e4


def test_angles_are_unwrapped_and_truth_follows(vehicle, vehicle_sections):
    wrapped = np.abs(np.diff(vehicle["heading"]))
    assert wrapped.max() > np.pi
    section = of(vehicle_sections, "States")
    estimate, truth = lines(section, "estimate")[2], lines(section, "truth")[2]
    assert np.abs(np.diff(estimate.y)).max() < np.pi
    assert np.abs(np.diff(truth.y)).max() < np.pi
    assert np.abs(np.asarray(estimate.y) - np.asarray(truth.y)).max() < np.pi
    np.testing.assert_allclose(np.cos(estimate.y), np.cos(vehicle["heading"]), atol=1e-5)
    lower, upper = np.asarray(estimate.customdata).T
    assert ((lower < estimate.y) & (estimate.y < upper)).all()


def test_aligned_angles_are_the_same_angles():
    np.testing.assert_allclose(aligned(np.array([3.0, -3.0]), np.array([3.0, 3.3])), [3.0, 2 * np.pi - 3.0])


def test_every_state_and_signal_has_a_panel(vehicle_sections):
    labels = [note.text for note in of(vehicle_sections, "States").figure.layout.annotations]
    assert labels == ["<b>x</b> [m]", "<b>y</b> [m]", "<b>heading</b> [rad]", "<b>rate_bias</b> [rad/s]"]
    assert len(of(vehicle_sections, "Innovations").figure.layout.annotations) == 3
    assert len(of(vehicle_sections, "Whiteness").figure.layout.annotations) == 3


def test_time_axes_move_together(vehicle_sections):
    for section in vehicle_sections:
        axes = list(section.figure.select_xaxes())
        assert all(axis.matches for axis in axes[:-1])
        assert section.timed == (axes[-1].title.text == "time [s]")
        assert section.figure.layout.hovermode == ("x unified" if section.timed else section.figure.layout.hovermode)


def test_only_what_was_measured_is_drawn_and_rejections_stand_out(vehicle, vehicle_sections):
    section = of(vehicle_sections, "Innovations")
    drawn = {name: sum(len(trace.x) for trace in lines(section, name)) for name in ("used", "used, beyond")}
    left = {name: sum(len(trace.x) for trace in lines(section, name)) for name in ("rejected", "rejected, beyond")}
    rejected = vehicle.seen & (vehicle.weight == 0)
    assert sum(left.values()) == rejected.sum() > 10
    assert sum(drawn.values()) == (vehicle.seen & ~rejected).sum()
    used, refused = lines(section, "used")[0].marker, lines(section, "rejected")[0].marker
    assert used.symbol != refused.symbol
    assert used.color != refused.color


def test_points_beyond_a_panel_are_marked_inside_it_with_their_own_value(vehicle_sections):
    section = of(vehicle_sections, "Innovations")
    trace = lines(section, "rejected, beyond")[0]
    reach = section.figure.layout.yaxis.range[1]
    assert (np.abs(trace.y) < reach).all()
    assert (np.abs(trace.customdata) > reach).all()


def test_bounds_are_interrupted_where_nothing_was_measured(vehicle_sections):
    bound = lines(of(vehicle_sections, "Innovations"), "upper bound")[0]
    assert np.isnan(bound.y).sum() == 1


def test_nis_and_its_mean_are_those_of_the_diagnostics(vehicle, vehicle_sections):
    label = of(vehicle_sections, "Consistency").figure.layout.annotations[0].text
    assert f"mean {gf.diagnostics.nis_test(vehicle).mean:.3g}" in label


def test_without_truth_there_are_no_errors(vehicle):
    bare = dataclasses.replace(vehicle, log=dataclasses.replace(vehicle.log, truth={}))
    sections = figures_of(bare)
    assert "Errors" not in {section.title for section in sections}
    assert not any(trace.name == "truth" for section in sections for trace in section.figure.data)


def test_a_smoothed_result_keeps_the_filters_innovations(vehicle, vehicle_sections, smoothed):
    sections = figures_of(smoothed)
    states = of(sections, "States")
    np.testing.assert_allclose(lines(states, "filtered")[0].y, vehicle["x"], rtol=1e-6)
    np.testing.assert_allclose(lines(states, "smoothed estimate")[0].y, smoothed["x"], rtol=1e-6)
    assert of(sections, "Innovations").figure == of(vehicle_sections, "Innovations").figure


def test_quaternions_have_rotation_errors_in_place_of_bands(attitude_sections):
    sections = attitude_sections
    states = [section for section in sections if section.title == "States"]
    assert not lines(states[0], "95 % band")
    assert len(lines(states[0], "truth")) == 4
    assert len(lines(states[1], "95 % band")) == 3
    errors = next(section for section in sections if section.title == "Errors")
    labels = [note.text for note in errors.figure.layout.annotations]
    assert [label.split("</b>")[0] for label in labels] == [f"<b>q_rotation_{axis}" for axis in "xyz"]
    assert all("[rad]" in label and "inside" in label for label in labels)


def test_the_same_attitude_with_the_other_sign_looks_the_same(attitude, attitude_sections):
    turned = {name: -values if name.startswith("q_") else values for name, values in attitude.log.truth.items()}
    other = dataclasses.replace(attitude, log=dataclasses.replace(attitude.log, truth=turned))
    drawn = [lines(sections[0], "truth")[0].y for sections in (state_sections(other, 2500), attitude_sections)]
    np.testing.assert_array_equal(*drawn)


def test_rotation_bounds_are_shown_without_truth(attitude):
    bare = dataclasses.replace(attitude, log=dataclasses.replace(attitude.log, truth={}))
    errors = error_sections(bare, 2500)[0]
    assert len(errors.figure.layout.annotations) == 3
    assert "no truth" in errors.caption


@pytest.mark.parametrize(
    ("signals", "pairs"),
    [
        ({"x": "m", "y": "m"}, [("x", "y")]),
        ({"px": "m", "v": "m/s", "py": "m", "pz": "m"}, [("px", "py")]),
        ({"e": "m", "n": "m"}, [("e", "n")]),
        ({"pos_east": "m", "pos_north": "m"}, [("pos_east", "pos_north")]),
        ({"E": "m", "N": "m"}, [("E", "N")]),
        ({"x1": "m", "y1": "m", "x2": "m", "y2": "m"}, [("x1", "y1"), ("x2", "y2")]),
        ({"x": "m/s", "y": "m/s"}, []),
        ({"bias_x": "m", "bias_y": "m"}, []),
        ({"x": "m", "z": "m"}, []),
    ],
)
def test_positions_are_known_by_name_and_unit(signals, pairs):
    assert position_pairs(make_space(signals)) == pairs


def test_the_path_is_drawn_to_scale_with_ellipses(vehicle_sections):
    section = of(vehicle_sections, "Trajectory")
    assert section.figure.layout.yaxis.scaleanchor == "x"
    assert len(lines(section, "estimate")[0].x) == 600
    ellipses = lines(section, "95 % ellipses")[0]
    assert 10 <= np.isnan(ellipses.x).sum() <= 25


def test_long_records_are_thinned_and_say_so(walk):
    result = walk(30_000)
    sections = figures_of(result)
    for section in sections:
        longest = max(len(trace.x) for trace in section.figure.data)
        # A band is drawn forth and back.
        assert longest <= 2 * 2500 + 1
        assert ("Thinned from 30,000 rows" in section.caption) == (section.title != "Whiteness")
    truth, estimate = (lines(of(sections, "States"), name)[0] for name in ("truth", "estimate"))
    for trace, values in ((truth, result.log.truth["level"]), (estimate, result["level"])):
        np.testing.assert_allclose([np.min(trace.y), np.max(trace.y)], [values.min(), values.max()], rtol=1e-6)


def test_inserted_rows_are_left_out(walk):
    plain = walk(60)
    log = gf.make_log(plain.model, plain.t, plain.log.y, max_step=0.004)
    split = gf.run(plain.estimator, plain.model, plain.prior, log)
    assert len(split.t) > 100
    assert len(lines(of(split, "States"), "estimate")[0].x) == 60


def test_very_late_times_are_counted_from_the_start(walk):
    section = of(walk(200, start=1.7e9), "States")
    titles = [axis.title.text for axis in section.figure.select_xaxes()]
    assert titles[-1] == "time after 1,700,000,000 s [s]"
    assert np.max(section.figure.data[0].x) == pytest.approx(1.99)


def test_failed_rows_are_not_drawn():
    model = gf.discrete_model(
        lambda x, u, t: jnp.where(t > 50, jnp.nan, 1.0) * x, lambda x, u, t: x, states=1, outputs=1, Q=0.1, R=1.0
    )
    prior = gf.make_prior(model, [1.0], [1.0])
    log = gf.make_log(model, np.arange(100.0), np.ones(100))
    result = gf.run(gf.extended_kalman_filter(), model, prior, log, throw=False)
    section = of(result, "States")
    assert np.max(lines(section, "estimate")[0].x) == 50.0
    assert "failed" in section.caption


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("measured", [True, False])
def test_very_short_records_can_be_drawn(rows, measured):
    model = gf.linear_model([[1.0]], [[1.0]], Q=0.1, R=1.0)
    prior = gf.make_prior(model, [0.0], [1.0])
    log = gf.make_log(model, np.arange(float(rows)), np.ones(rows) if measured else np.full(rows, np.nan))
    titles = [section.title for section in figures_of(gf.run(gf.kalman_filter(), model, prior, log))]
    assert titles[0] == "States"
    assert ("Innovations" in titles) == measured


def test_many_states_are_shared_out_over_figures_that_fit_a_page():
    n = 12
    model = gf.linear_model(0.9 * np.eye(n), np.eye(n)[:2], Q=0.1 * np.eye(n), R=np.eye(2))
    prior = gf.make_prior(model, np.zeros(n), np.ones(n))
    log = gf.draw_log(model, prior, np.arange(80.0), key=jax.random.key(0))
    states = state_sections(gf.run(gf.kalman_filter(), model, prior, log), 2500)
    assert [len(section.figure.layout.annotations) for section in states] == [4, 4, 4]
    assert all(section.figure.layout.height < 860 for section in states)


def test_neighbours_that_say_the_same_say_it_once(attitude_sections):
    captions = [section.caption for section in attitude_sections if section.title == "Errors"]
    assert captions[1:] == ["Continued."]
    assert captions[0].startswith("Truth minus estimate")


def test_alarms_are_upright_lines_across_the_panel_of_their_state(vehicle):
    sections = figures_of(vehicle, {"heading": (3.0, 5.5), "x": ()})
    first = next(section for section in sections if section.title == "States")
    assert "Alarms are upright lines." in first.caption
    (marks,) = [trace for trace in first.figure.data if trace.name == "alarm"]
    heading = vehicle.model.space.names.index("heading")
    axis = first.figure.layout["yaxis" if heading == 0 else f"yaxis{heading + 1}"]
    assert marks.yaxis == ("y" if heading == 0 else f"y{heading + 1}")
    np.testing.assert_array_equal(marks.x, [3.0, 3.0, 3.0, 5.5, 5.5, 5.5])
    np.testing.assert_array_equal(marks.y, [*axis.range, np.nan] * 2)
    assert not any(trace.name == "alarm" for section in figures_of(vehicle) for trace in section.figure.data)


def test_alarms_move_with_times_that_are_counted_from_the_start(walk):
    start = 1.7e9  # s
    sections = figures_of(walk(200, start=start), {"level": (start + 1.0,)})
    (marks,) = [trace for trace in sections[0].figure.data if trace.name == "alarm"]
    np.testing.assert_allclose(marks.x, 1.0, atol=1e-6)


@pytest.mark.parametrize(("turns", "dash"), [(5, "dash"), (400, None)])
def test_bounds_are_dashed_unless_they_swing_too_fast_for_dashes(turns, dash):
    t = np.linspace(0.0, 1.0, 1000)
    bound = 2 + np.sin(np.pi * turns * t)
    figure = panels(["x"], (0.0, 1.0))
    add_band(figure, 1, t, -bound, bound, "bound", edge="#000000")
    assert {trace.line.dash for trace in figure.data[1:]} == {dash}


@pytest.mark.parametrize(("span", "words"), [(8e-5, "power"), (1e-3, "none")])
def test_small_numbers_are_told_in_powers_of_ten(span, words):
    figure = panels(["x"])
    set_range(figure, 1, 0.0, span)
    assert figure.layout.yaxis.exponentformat == words
