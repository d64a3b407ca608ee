"""Records from files: every signal lands in the right row, in the right unit, or the file is refused."""

import numpy as np
import pytest

import gainful as gf
from gainful.errors import ConfigError, DataError, UnitError
from gainful.plants import attitude_kinematics, planar_vehicle

from .problems import walk

HEADER = "t,x\n"


def driven(**changes):
    """The one-number model with an input [m/s]."""
    return walk(B=[[1.0]], inputs={"u": "m/s"}, **changes)


# ---------------------------------------------------------------- order and repetition


def test_rows_out_of_order_are_refused_with_row_and_time(put, read):
    put(HEADER + "0,1\n2,3\n1,2\n3,4\n")
    with pytest.raises(DataError) as caught:
        read()
    assert "log.csv: time goes back from 2 s to 1 s in data row 2" in str(caught.value)
    assert "signal 'y'" in str(caught.value)
    assert 'late = "sort"' in str(caught.value)


def test_rows_out_of_order_are_sorted_on_request_and_counted(put, read):
    put(HEADER + "0,1\n2,3\n1,2\n3,4\n")
    log = read(late="sort")
    assert log.t.tolist() == [0, 1, 2, 3]
    assert log.y[:, 0].tolist() == [1, 2, 3, 4]
    assert log.counts["late rows sorted"] == 1


def test_two_values_at_one_time_are_refused_with_both_values(put, read):
    put(HEADER + "0,1\n1,2\n1,5\n2,3\n")
    with pytest.raises(DataError, match=r"signal 'y': two values at t = 1 s \(2 and 5; 1 such rows\)"):
        read()


@pytest.mark.parametrize(
    ("how", "t", "y"),
    [("keep", [0, 1, 1, 2], [1, 2, 5, 3]), ("first", [0, 1, 2], [1, 2, 3]), ("last", [0, 1, 2], [1, 5, 3])],
)
def test_two_values_at_one_time_are_kept_or_one_is_taken(put, read, how, t, y):
    put(HEADER + "0,1\n1,2\n1,5\n2,3\n")
    log = read(duplicates=how)
    assert log.t.tolist() == t
    assert log.y[:, 0].tolist() == y


@pytest.mark.parametrize("how", ["refuse", "keep", "first", "last"])
def test_a_row_of_another_signal_is_no_duplicate(put, read, how):
    model = walk(H=[[1.0], [1.0]], R=[1.0, 1.0], outputs={"left": "m", "right": "m"})
    put("t,a,b\n0,1,\n0,,5\n1,,6\n1,2,\n2,3,\n2,,\n")
    log = read(model, outputs={"left": "a", "right": "b"}, duplicates=how)
    assert log.t.tolist() == [0, 1, 2]
    np.testing.assert_array_equal(np.where(log.seen, log.y, np.nan), [[1, 5], [2, 6], [3, np.nan]])


def test_two_values_of_an_input_at_one_time_are_refused_or_the_last_holds(put, read):
    put("t,x,u\n0,1,1\n1,2,2\n1,,3\n2,3,4\n")
    with pytest.raises(DataError, match=r"signal 'u': two values at t = 1 s \(2 and 3"):
        read(driven(), inputs={"u": "u"})
    log = read(driven(), inputs={"u": "u"}, duplicates="keep")
    assert log.u[log.t == 2, 0].tolist() == [3]
    log = read(driven(), inputs={"u": "u"}, duplicates="first")
    assert log.u[log.t == 2, 0].tolist() == [2]


# ---------------------------------------------------------------- finding signals


def test_rows_are_filtered_by_the_value_of_another_column(put, read):
    model = walk(H=[[1.0], [1.0]], R=[1.0, 1.0], outputs={"left": "m", "right": "m"})
    put("t,id,x\n0,1,10\n0,2,20\n1,2,21\n2,1,12\n")
    columns = {name: gf.Column("x", where={"id": i}) for name, i in (("left", 1), ("right", 2))}
    log = read(model, outputs=columns)
    np.testing.assert_array_equal(np.where(log.seen, log.y, np.nan), [[10, 20], [np.nan, 21], [12, np.nan]])


def test_a_filter_that_finds_no_row_lists_what_is_there(put, read):
    put("t,id,x\n0,1,10\n1,2,20\n")
    with pytest.raises(DataError, match=r"signal 'y': no row of log.csv has id = 3; it has 1, 2"):
        read(outputs={"y": gf.Column("x", where={"id": 3})})
    with pytest.raises(DataError, match=r"no row of log.csv has id = 1, x = 20 at once"):
        read(outputs={"y": gf.Column("x", where={"id": 1, "x": 20})})
    with pytest.raises(DataError, match=r"log.csv: no column 'idd'; did you mean 'id'"):
        read(outputs={"y": gf.Column("x", where={"idd": 3})})


def test_a_bad_cell_is_named_by_its_place_in_the_file_also_behind_a_filter(put, read):
    put("t,id,x\n0,1,10\n1,2,20\n2,1,oops\n")
    with pytest.raises(DataError, match=r"log.csv: column 'x' expected numbers, got 'oops' in data row 2"):
        read(outputs={"y": gf.Column("x", where={"id": 1})})


def test_each_sensor_may_have_its_own_file_and_time_column(put, read):
    model = walk(H=[[1.0], [1.0]], R=[1.0, 1.0], outputs={"left": "m", "right": "m"})
    put("t,a\n0,1\n1,2\n", "left.csv")
    put("stamp\tb\n0.5\t5\n1\t6\n", "right.tsv")
    columns = {"left": gf.Column("a", file="left.csv"), "right": gf.Column("b", file="right.tsv", time="stamp")}
    log = read(model, outputs=columns, file="")
    assert log.t.tolist() == [0, 0.5, 1]
    np.testing.assert_array_equal(np.where(log.seen, log.y, np.nan), [[1, np.nan], [np.nan, 5], [2, 6]])


def test_a_signal_without_a_file_is_refused(read):
    with pytest.raises(ConfigError, match="signal 'y': no file given"):
        read(file="")


def test_an_unknown_column_is_answered_with_the_nearest(put, read):
    put(HEADER + "0,1\n")
    with pytest.raises(DataError, match=r"log.csv: no column 'xx'; did you mean 'x'"):
        read(outputs={"y": "xx"})
    with pytest.raises(DataError, match=r"log.csv: no column 'tt'; did you mean 't'"):
        read(time="tt")


def test_unknown_signals_are_answered_with_the_nearest(put, read):
    put(HEADER + "0,1\n")
    with pytest.raises(ConfigError, match="outputs: 'yy' is not a signal of the model; did you mean 'y'"):
        read(outputs={"yy": "x"})
    with pytest.raises(ConfigError, match="inputs: 'u' is not a signal of the model"):
        read(inputs={"u": "x"})
    with pytest.raises(ConfigError, match="truth: 'z' is not a signal of the model; known: x"):
        read(truth={"z": "x"})
    with pytest.raises(ConfigError, match="inputs: the model's input 'u' has no column"):
        read(driven())
    with pytest.raises(ConfigError, match="outputs: expected at least one of y, got none"):
        read(outputs={})
    with pytest.raises(ConfigError, match=r"signal 'y': expected one column, got \['x', 't'\]"):
        read(outputs={"y": gf.Column(["x", "t"])})


# ---------------------------------------------------------------- inputs


def inputs_of(read, **column):
    log = read(driven(), inputs={"u": gf.Column("u", **column)})
    return dict(zip(log.t.tolist(), log.u[:, 0].tolist(), strict=True))


def test_inputs_hold_their_previous_value_unless_told_otherwise(put, read):
    put("t,x,u\n0,1,10\n1,1,20\n1.5,1,\n2,1,30\n")
    assert inputs_of(read) == {0: 10, 1: 10, 1.5: 20, 2: 20}
    assert inputs_of(read, hold="next") == {0: 10, 1: 20, 1.5: 30, 2: 30}
    assert inputs_of(read, hold="linear") == {0: 10, 1: 15, 1.5: 22.5, 2: 27.5}


def test_increments_become_rates_over_the_interval_they_end(put, read):
    put("t,x,u\n0,1,99\n1,1,2\n1.5,1,\n3,1,5\n")
    assert inputs_of(read, increment=True) == {1: 2, 1.5: 2.5, 3: 2.5}


def test_the_unit_of_an_increment_is_that_of_the_change(put, read):
    put("t,x,u\n0,1,0\n1,1,200\n3,1,500\n")
    assert inputs_of(read, increment=True, unit="cm") == {1: 2, 3: 2.5}
    with pytest.raises(UnitError, match=r"signal 'u': expected a unit that converts to '\(m/s\) \* s', got 'cm/s'"):
        inputs_of(read, increment=True, unit="cm/s")


def test_increments_need_times_that_increase(put, read):
    put("t,x,u\n0,1,0\n1,1,2\n1,,3\n")
    with pytest.raises(DataError, match="signal 'u': an increment needs times that increase, got t = 1 s twice"):
        read(driven(), inputs={"u": gf.Column("u", increment=True)}, duplicates="keep")


def test_one_increment_alone_is_no_rate(put, read):
    put("t,x,u\n0,1,\n1,1,2\n")
    with pytest.raises(DataError, match="signal 'u': an increment needs at least two rows, got 1"):
        inputs_of(read, increment=True)


def test_rows_outside_the_inputs_are_left_out_and_counted(put, read):
    put("t,x\n0,1\n1,2\n2,3\n3,4\n")
    put("t,u\n1,5\n2,6\n", "u.csv")
    log = read(driven(), inputs={"u": gf.Column("u", file="u.csv")})
    assert log.t.tolist() == [1, 2, 3]
    assert log.counts["rows before or after the inputs"] == 1
    log = read(driven(), inputs={"u": gf.Column("u", file="u.csv", hold="next")})
    assert log.t.tolist() == [1, 2]
    assert log.counts["rows before or after the inputs"] == 2


# ---------------------------------------------------------------- truth


def test_truth_is_interpolated_the_short_way_round(put, read):
    put("t,speed,turn,px,py\n0,1,0,0,0\n1,1,0,0,0\n2,1,0,0,0\n")
    put("t,deg\n0,170\n2,-170\n", "truth.csv")
    log = read(
        planar_vehicle(),
        outputs={"measured_x": "px", "measured_y": "py"},
        inputs={"speed": "speed", "turn_rate": "turn"},
        truth={"heading": gf.Column("deg", file="truth.csv", unit="deg")},
    )
    assert abs(np.degrees(log.truth["heading"][1])) == pytest.approx(180.0)


def test_truth_is_not_interpolated_across_long_gaps_or_beyond_its_ends(put, read):
    put(HEADER + "".join(f"{k},0\n" for k in range(-1, 22)))
    put("t,v\n" + "".join(f"{k},{k * 10}\n" for k in (0, 1, 2, 3, 4, 15, 16, 17, 18, 19, 20)), "truth.csv")
    truth = read(truth={"x": gf.Column("v", file="truth.csv")}).truth["x"]
    known = np.arange(-1, 22)
    expected = np.where((known < 0) | (known > 20) | ((known > 4) & (known < 15)), np.nan, known * 10.0)
    np.testing.assert_allclose(truth, expected)


def test_a_single_value_of_truth_counts_only_at_its_own_time(put, read):
    put("t,x,v\n0,1,\n1,2,7\n2,3,\n")
    np.testing.assert_array_equal(read(truth={"x": "v"}).truth["x"], [np.nan, 7, np.nan])


def attitude_record(read, put, measured, truth):
    rows = "".join(f"{k},0,0,0,{','.join(map(str, q))}\n" for k, q in enumerate(measured))
    put("t,wx,wy,wz,qx,qy,qz,qw\n" + rows)
    put("t,a,b,c,d\n" + "".join(f"{t},{','.join(map(str, q))}\n" for t, q in truth), "truth.csv")
    return read(
        attitude_kinematics(),
        outputs={"measured": gf.Column(["qx", "qy", "qz", "qw"])},
        inputs={name: name for name in ("wx", "wy", "wz")},
        truth={"attitude": gf.Column(["a", "b", "c", "d"], file="truth.csv")},
    )


def test_truth_of_an_attitude_survives_a_change_of_sign(put, read):
    half = np.sqrt(0.5)
    log = attitude_record(
        read,
        put,
        [(0, 0, 0, 1), (0, 0, 0, 1), (0, 0, 0, 1)],
        [(0, (0, 0, 0, 1)), (2, (0, 0, -half, -half))],  # a quarter turn, written with the other sign
    )
    found = np.array([log.truth[f"attitude_{axis}"][1] for axis in "xyzw"])
    np.testing.assert_allclose(found, [0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)], atol=1e-12)


def test_an_attitude_with_one_empty_cell_is_missing_as_a_whole(put, read):
    log = attitude_record(
        read, put, [(0, 0, 0, 1), (0, "", 0, 1), (0, 0, 1, 0)], [(0, (0, 0, 0, 1)), (2, (0, 0, 0, 1))]
    )
    assert log.seen.tolist() == [[True] * 3, [False] * 3, [True] * 3]
    np.testing.assert_array_equal(log.y[2], [0, 0, 1, 0])
    assert log.missing == dict.fromkeys((f"measured_rotation_{axis}" for axis in "xyz"), 1)


def test_four_numbers_that_are_no_attitude_are_refused_with_their_length(put, read):
    with pytest.raises(DataError, match=r"signal 'measured': expected a unit quaternion, got one of length 2 in row 1"):
        attitude_record(read, put, [(0, 0, 0, 1), (0, 0, 0, 2), (0, 0, 0, 1)], [(0, (0, 0, 0, 1)), (2, (0, 0, 0, 1))])
