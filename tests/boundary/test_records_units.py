"""Units, times and places of a record: converted, or refused by name."""

import numpy as np
import pandas as pd
import pytest

import gainful as gf
from gainful.errors import ConfigError, DataError, UnitError
from gainful.io import convert

from .problems import walk

HEADER = "t,x\n"


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
