"""Files of a record: read as they are, with their gaps, or refused with file, row and time."""

import numpy as np
import pandas as pd
import pytest

import gainful as gf
from gainful.errors import ConfigError, DataError, MissingExtraError
from gainful.io import Outage, read_table
from gainful.plants import attitude_kinematics
from gainful.running import with_outage

from .problems import walk

HEADER = "t,x\n"


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
