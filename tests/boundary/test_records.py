"""Records from files: every signal lands in the right row, in the right unit, or the file is refused."""

import numpy as np
import pandas as pd
import pytest

import gainful as gf
from gainful.errors import ConfigError, DataError, MissingExtraError, UnitError
from gainful.io import Outage, convert, read_table
from gainful.plants import attitude_kinematics, planar_vehicle
from gainful.running import with_outage

from .problems import walk

HEADER = "t,x\n"


@pytest.fixture
def put(tmp_path):
    """Writes a file into the test's folder and returns its name."""

    def write(text, name="log.csv"):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    return write


@pytest.fixture
def read(tmp_path):
    """Reads a record of the one-number model, `y` from column `x`, unless told otherwise."""

    def log(model=None, **given):
        source = {"outputs": {"y": "x"}, "file": "log.csv"} | given
        return gf.read_log(walk() if model is None else model, gf.Source(**source), tmp_path)

    return log


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


# ---------------------------------------------------------------- units and times


@pytest.mark.parametrize(
    ("unit", "target", "given", "expected"),
    [
        ("deg", "rad", 180.0, np.pi),
        ("deg", "angle", 90.0, np.pi / 2),
        ("km/h", "m/s", 36.0, 10.0),
        ("degC", "K", 20.0, 293.15),
        ("%", "1", 50.0, 0.5),
        ("kPa", "Pa", 2.0, 2000.0),
        ("rpm", "rad/s", 60.0, 2 * np.pi),
        ("", "1", 3.0, 3.0),
    ],
)
def test_units_are_converted(unit, target, given, expected):
    np.testing.assert_allclose(convert(np.array([given]), unit, target, "signal"), [expected])


@pytest.mark.parametrize(
    ("unit", "target", "message"),
    [
        ("kg", "m", "signal 'y': expected a unit that converts to 'm', got 'kg'"),
        ("metre per", "m", "signal 'y': 'metre per' is not a unit"),
        ("furlng", "m", "signal 'y': 'furlng' is not a unit"),
        ("2*m", "m", "signal 'y': '2*m' is not a unit"),
        ("g", "m/s^2", "signal 'y': expected a unit that converts to 'm/s^2', got 'g'"),
    ],
)
def test_units_that_do_not_convert_are_refused(unit, target, message):
    with pytest.raises(UnitError) as caught:
        convert(np.array([1.0]), unit, target, "y")
    assert message in str(caught.value)


def test_a_column_is_scaled_before_its_unit_is_converted(put, read):
    put(HEADER + "0,100\n1,200\n")
    log = read(outputs={"y": gf.Column("x", unit="km", scale=0.01)})
    assert log.y[:, 0].tolist() == [1000, 2000]
    with pytest.raises(UnitError, match="signal 'y'"):
        read(outputs={"y": gf.Column("x", unit="kg")})


def test_time_is_converted_to_seconds(put, read):
    put(HEADER + "0,1\n1500,2\n")
    assert read(time_unit="ms").t.tolist() == [0, 1.5]
    with pytest.raises(UnitError, match="signal 'time': expected a unit that converts to 's', got 'm'"):
        read(time_unit="m")


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_dates_are_read_as_seconds_since_1970_whatever_the_unit(put, read, tmp_path, unit):
    put(HEADER + "1970-01-02T00:00:00Z,1\n1970-01-02T00:00:00.5Z,2\n1970-01-02 02:00:01+02:00,3\n")
    assert read(time_unit=unit).t.tolist() == [86400, 86400.5, 86401]
    dates = pd.to_datetime(["1970-01-02 00:00:00.0", "1970-01-02 00:00:00.5"])
    for name, column in (("naive", dates), ("zoned", dates.tz_localize("UTC").tz_convert("Europe/Rome"))):
        pd.DataFrame({"t": column, "x": [1.0, 2.0]}).to_parquet(tmp_path / f"{name}.parquet")
        assert read(time_unit=unit, file=f"{name}.parquet").t.tolist() == [86400, 86400.5]


def test_durations_are_read_as_seconds(read, tmp_path):
    pd.DataFrame({"t": pd.to_timedelta([0, 250], unit="ms"), "x": [1.0, 2.0]}).to_parquet(tmp_path / "d.parquet")
    assert read(file="d.parquet").t.tolist() == [0, 0.25]


def test_a_row_without_a_time_is_refused_with_its_row(put, read, tmp_path):
    put(HEADER + "0,1\n,2\n2,3\n")
    with pytest.raises(DataError, match=r"log.csv: expected a time in every row, got none in data row 1"):
        read()
    times = pd.to_datetime(["1970-01-02", None])
    pd.DataFrame({"t": times, "x": [1.0, 2.0]}).to_parquet(tmp_path / "d.parquet")
    with pytest.raises(DataError, match=r"d.parquet: expected a time in every row, got none in data row 1"):
        read(file="d.parquet")


def test_start_and_stop_cut_the_record(put, read):
    put(HEADER + "".join(f"{k},{k}\n" for k in range(6)))
    log = read(start=1.5, stop=4)
    assert log.t.tolist() == [2, 3, 4]
    assert log.dt[0] == 0
    with pytest.raises(DataError, match=r"no row is left: outputs and inputs span 0 s to 5 s, start is 7"):
        read(start=7)


def test_long_intervals_are_split_and_counted(put, read):
    put(HEADER + "0,1\n1,2\n4,3\n")
    log = read(max_step=1.0)
    assert log.t.tolist() == [0, 1, 2, 3, 4]
    assert log.kept.tolist() == [True, True, False, False, True]
    assert log.seen[:, 0].tolist() == [True, True, False, False, True]
    assert log.counts["split intervals"] == 1
    with pytest.raises(ConfigError, match="max_step: expected a time above 0 s, got 0"):
        read(max_step=0)


# ---------------------------------------------------------------- geodetic columns


def test_latitude_and_longitude_become_metres_from_the_first_row(put, read):
    model = walk(H=[[1.0], [1.0]], R=[1.0, 1.0], outputs={"left": "m", "right": "m"})
    put("t,lat,lon\n0,45,9\n1,45.001,9\n2,45,9.001\n")
    log = read(model, outputs={"left": "east", "right": "north"}, local=[gf.LocalFrame("lat", "lon")])
    # WGS 84 at 45 degrees: 111131.7 m per degree of latitude, 78846.8 m per degree of longitude.
    np.testing.assert_allclose(log.y, [[0, 0], [0, 111.1317], [78.8468, 0]], atol=2e-3)
    given = gf.LocalFrame("lat", "lon", origin=[45.001, 9.0, 0.0], files=["log.csv"])
    log = read(model, outputs={"left": "east", "right": "north"}, local=[given])
    np.testing.assert_allclose(log.y[1], [0, 0], atol=1e-6)


def test_geodetic_columns_that_cannot_be_right_are_refused(put, read):
    outputs = {"y": "east"}
    put("t,lat,lon\n0,45,9\n1,145,9\n")
    with pytest.raises(DataError, match=r"log.csv: column 'lat' expected degrees up to 90, got 145 in data row 1"):
        read(outputs=outputs, local=[gf.LocalFrame("lat", "lon")])
    put("t,lat,lon\n0,,9\n1,45,\n")
    with pytest.raises(DataError, match=r"log.csv: no row with a whole position to take as the origin"):
        read(outputs=outputs, local=[gf.LocalFrame("lat", "lon")])
    put("t,lat,lon,east\n0,45,9,1\n")
    with pytest.raises(DataError, match=r"log.csv: column 'east' is there already"):
        read(outputs=outputs, local=[gf.LocalFrame("lat", "lon")])
    put("t,lat,lon\n0,45,9\n")
    for origin in ([45.0, 9.0], [145.0, 9.0, 0.0]):
        with pytest.raises(ConfigError, match="origin: expected latitude"):
            read(outputs=outputs, local=[gf.LocalFrame("lat", "lon", origin=origin)])


# ---------------------------------------------------------------- missing values and bad cells


def test_empty_cells_and_markers_are_missing_and_counted(put, read):
    put(HEADER + "0,1\n1,\n2,NA\n3,-999\n4,inf\n5,6\n")
    log = read(outputs={"y": gf.Column("x", missing=[-999, np.inf])})
    assert log.seen[:, 0].tolist() == [True, False, False, False, False, True]
    assert log.missing == {"y": 4}


def test_an_infinite_cell_is_refused_with_signal_column_row_and_time(put, read):
    put(HEADER + "0,1\n0.5,-inf\n")
    with pytest.raises(DataError) as caught:
        read()
    message = str(caught.value)
    assert "signal 'y': expected a finite number or an empty cell, got -inf in column 'x' of log.csv" in message
    assert "data row 1 (counted from 0) at t = 0.5 s" in message


def test_text_in_a_column_of_numbers_is_refused_with_its_row(put, read):
    put(HEADER + "0,1\n1,off\n2,off\n")
    with pytest.raises(DataError, match=r"column 'x' expected numbers, got 'off' in data row 1 .* \(2 such cells\)"):
        read()
    put(HEADER + "now,1\nthen,2\n")
    with pytest.raises(DataError, match=r"log.csv: column 't' expected numbers, got 'now' in data row 0"):
        read()


def test_a_column_without_a_single_number_is_refused(put, read):
    put(HEADER + "0,\n1,\n")
    with pytest.raises(DataError, match=r"signal 'y': column 'x' of log.csv holds no number at all"):
        read()


def test_blanks_around_numbers_and_names_do_not_matter(put, read):
    put(" t , x \n 0 , 1 \n 1 ,   \n2, 3\n")
    log = read()
    assert log.y[log.seen[:, 0], 0].tolist() == [1, 3]


# ---------------------------------------------------------------- files


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "data file log.csv: expected a header and rows, got an empty file"),
        ("\n \n", "data file log.csv: expected a header and rows, got an empty file"),
        (HEADER, "data file log.csv: expected at least one row under the header, got none"),
        ("t,x,x\n0,1,2\n", "data file log.csv: column 'x' appears twice"),
        ("t,x, x\n0,1,2\n", "data file log.csv: column 'x' appears twice"),
        ("t;x\n0;1\n", "data file log.csv: expected ',' between columns, got ';' in 't;x'"),
        ("t,x\n0,1,5\n1,2,6\n", "data file log.csv: expected 2 cells in every row, got more"),
        ("t,x\n0,1,5\n1,2\n", "data file log.csv: expected 2 cells in every row, got more"),
        ("t,x\n0,1\n1,2,6\n", "data file log.csv: cannot be read: Error tokenizing data"),
        (b"t,x\n0,\xff\n", "data file log.csv: cannot be read: 'utf-8' codec can't decode"),
    ],
)
def test_a_broken_file_is_refused_by_name(put, read, text, message):
    put(text)
    with pytest.raises(DataError) as caught:
        read()
    assert str(caught.value).startswith(message)


def test_a_comma_at_the_end_of_every_row_shifts_nothing(put, read):
    put("t,x\n0,1,\n1,2,\n")
    log = read()
    assert (log.t.tolist(), log.y[:, 0].tolist()) == ([0, 1], [1, 2])


def test_a_mark_of_utf_8_at_the_start_is_no_part_of_the_name(put, read):
    put("\ufefft,x\n0,1\n")
    assert read().t.tolist() == [0]


def test_files_that_are_not_there_are_answered_with_the_nearest(put, read):
    put(HEADER + "0,1\n")
    with pytest.raises(DataError, match=r"data file .*lgo.csv: not found; did you mean 'log.csv'"):
        read(file="lgo.csv")
    with pytest.raises(DataError, match=r"not found; there is no folder .*nowhere"):
        read(folder="nowhere")


def test_files_of_unknown_or_wrong_kind_are_refused(put, read, tmp_path):
    put("hello", "log.xlsx")
    with pytest.raises(DataError, match=r"data file log.xlsx: expected one of .csv, .*got '.xlsx'"):
        read(file="log.xlsx")
    put("hello", "log.parquet")
    with pytest.raises(DataError, match=r"data file log.parquet: cannot be read"):
        read(file="log.parquet")
    put("hello", "log.csv.gz")
    with pytest.raises(DataError, match=r"data file log.csv.gz: cannot be read"):
        read(file="log.csv.gz")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(DataError, match=r"data file folder.csv: cannot be read"):
        read(file="folder.csv")


def test_a_file_without_permission_is_refused(put, read, tmp_path, as_nobody):
    put(HEADER + "0,1\n")
    (tmp_path / "log.csv").chmod(0)
    with as_nobody(), pytest.raises(DataError, match=r"data file .*log.csv: no permission to read it"):
        read()


@pytest.mark.parametrize("name", ["log.csv.gz", "log.txt", "log.parquet", "log.pq"])
def test_other_kinds_of_file_read_the_same(read, tmp_path, name):
    table = pd.DataFrame({"t": [0.0, 0.1, 0.2], "x": [1.0, np.nan, 1.0 / 3.0]})
    if name.endswith(("parquet", "pq")):
        table.to_parquet(tmp_path / name)
    else:
        table.to_csv(tmp_path / name, index=False)
    log = read(file=name)
    np.testing.assert_array_equal(log.t, table["t"])
    np.testing.assert_array_equal(np.where(log.seen[:, 0], log.y[:, 0], np.nan), table["x"])


def test_a_parquet_file_may_keep_its_times_in_the_index(read, tmp_path):
    frame = pd.DataFrame({"x": [1.0, 2.0]}, index=pd.Index([0.0, 0.5], name="t"))
    frame.to_parquet(tmp_path / "log.parquet")
    assert read(file="log.parquet").t.tolist() == [0, 0.5]
    assert read_table(tmp_path / "log.parquet").columns == ["t", "x"]


def test_reading_without_pandas_names_the_extra(monkeypatch, put, read):
    put(HEADER + "0,1\n")
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"gainful\[io\]"):
        read()


# ---------------------------------------------------------------- outages


def test_an_outage_leaves_out_what_it_names_from_its_start_to_before_its_stop_and_counts_it(put, read):
    put("t,x,z\n0,1,1\n1,2,2\n2,,3\n3,4,4\n4,5,5\n")
    two = walk(H=[[1.0], [1.0]], outputs=["y", "z"], R=[1.0, 1.0])
    sources = {"outputs": {"y": "x", "z": "z"}}
    log = read(two, **sources, outages=[Outage(["y"], 1.0, 4.0), Outage(["y", "z"], 4.0)])
    assert log.seen.tolist() == [[True, True], [False, True], [False, True], [False, True], [False, False]]
    # The gap in the file is the record's own and not the outage's.
    assert log.missing == read(two, **sources).missing == {"y": 1, "z": 0}
    assert log.counts == {"y left out in an outage": 3, "z left out in an outage": 1}


def test_an_outage_of_a_measured_attitude_takes_its_three_angles():
    model = attitude_kinematics()
    log = gf.make_log(model, [0.0, 1.0], [[0.0, 0.0, 0.0, 1.0]] * 2, np.zeros((2, 3)))
    (name,) = {each.removesuffix("_x") for each in model.output.names if each.endswith("_x")}
    cut = with_outage(log, model, [name], 1.0)
    assert cut.seen.tolist() == [[True] * 3, [False] * 3]
    assert cut.counts == {f"{name} left out in an outage": 1}


def test_an_outage_of_nothing_or_backwards_or_of_an_unknown_output_is_refused(put, read):
    put(HEADER + "0,1\n1,2\n")
    for outage, told in (
        (Outage([], 0.0), "outages: outputs: expected at least one, got none"),
        (Outage(["z"], 0.0), "outages: outputs: 'z' is not an output of the model"),
        (Outage(["y"], 1.0, 1.0), "outages: stop: expected a time after the start at 1 s, got 1 s"),
    ):
        with pytest.raises(ConfigError, match=told):
            read(outages=[outage])
