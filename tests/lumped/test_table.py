"""The mesh table and its file."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lumped.train.table import (
    MeshTable,
    TableError,
    format_table,
    pair_names,
    parse_table,
    read_table,
    write_table,
)

numbers = st.floats(allow_nan=True, allow_infinity=True, width=64)


def make_table(values, header=None):
    columns = {
        "n_pairs": np.ones(values.shape),
        "stiffness_N_per_m": values,
        "pair1_load_share": values,
    }
    torque = np.arange(1.0, values.shape[0] + 1.0)
    position = np.arange(values.shape[1]) / values.shape[1]
    return MeshTable(torque, position, columns, header or {"gear set": "a: b"})


@given(arrays(np.float64, (2, 5), elements=numbers))
def test_reading_back_gives_the_same_bits(values):
    table = make_table(values)
    back = parse_table(format_table(table))
    assert back == table
    column = back["stiffness_N_per_m"]
    same = column.view(np.int64) == values.view(np.int64)
    assert (same | np.isnan(values)).all()


def test_file_round_trip(tmp_path):
    table = make_table(np.array([[1.0 / 3.0, math.pi, 2.0]]))
    path = tmp_path / "table.csv"
    write_table(table, path)
    assert read_table(path) == table


def test_generic_readers_understand_it():
    table = make_table(np.array([[1.5, 2.5], [3.5, 4.5]]))
    text = format_table(table)
    data = np.genfromtxt(
        io.StringIO(text), delimiter=",", names=True, skip_header=text.count("#")
    )
    np.testing.assert_array_equal(data["stiffness_N_per_m"], [1.5, 2.5, 3.5, 4.5])
    np.testing.assert_array_equal(data["torque_Nm"], [1, 1, 2, 2])


def test_spreadsheet_byte_order_mark_and_blank_lines_are_ignored():
    text = "\ufeff" + format_table(make_table(np.ones((1, 3)))) + "\n\n"
    assert parse_table(text)["stiffness_N_per_m"].shape == (1, 3)


def test_minimal_table_of_another_code():
    table = parse_table("torque_Nm,position,stiffness_N_per_m\n100,0,3e8\n100,0.5,2e8")
    assert table.pair_count == 0
    assert table.torque_Nm.tolist() == [100.0]


def test_pairs_are_listed_in_order():
    table = make_table(np.ones((1, 2)))
    assert table.pair_count == 1
    assert len(pair_names(table, "load_share")) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no column names"),
        ("# only: comments\n", "no column names"),
        ("torque_Nm,position\n1,0", "stiffness_N_per_m is missing"),
        ("torque_Nm,position,stiffness_N_per_m", "no rows"),
        ("torque_Nm,position,stiffness_N_per_m\n1,0", "2 cells where 3"),
        ("torque_Nm,position,stiffness_N_per_m\n1,0,abc", "abc"),
        (
            "torque_Nm,position,stiffness_N_per_m\n1,0,1\n1,.5,1\n2,0,1",
            "the same positions",
        ),
        ("torque_Nm,position,stiffness_N_per_m\n1,.5,1\n1,0,1", "must increase"),
    ],
)
def test_what_is_no_table_is_named(text, message):
    with pytest.raises(TableError, match=message):
        parse_table(text, "t.csv")


def test_tables_are_frozen():
    table = make_table(np.ones((1, 2)))
    with pytest.raises(TypeError):
        table.columns["n_pairs"] = np.zeros((1, 2))  # type: ignore[index]


SPREADSHEET = """\
# gear set: a
torque_Nm;position;stiffness_N_per_m;n_pairs
50,5;0;3e8;2
50,5;0,25;3,25e8;1
"""


@pytest.mark.parametrize(
    "text",
    [
        SPREADSHEET,
        SPREADSHEET.replace(";", "\t"),
        SPREADSHEET.replace(",", "."),
        SPREADSHEET.replace(",", ".").replace(";", ","),
        "\ufeff" + SPREADSHEET.replace("\n", "\r\n"),
    ],
)
def test_tables_of_spreadsheets(text):
    table = parse_table(text)
    assert table.torque_Nm.tolist() == [50.5]
    assert table.position.tolist() == [0.0, 0.25]
    assert table["stiffness_N_per_m"].tolist() == [[3e8, 3.25e8]]


def test_a_comma_that_is_no_decimal():
    with pytest.raises(TableError, match=r"t.csv, line 3, .*'50,5,1' is no number"):
        parse_table(SPREADSHEET.replace("50,5;0;", "50,5,1;0;"), "t.csv")


def test_a_cell_of_megabytes_is_no_table():
    text = SPREADSHEET + "1" * 2_000_000 + ";0;0;0\n"
    with pytest.raises(TableError, match=r"t.csv, line 5: field larger than"):
        parse_table(text, "t.csv")


def test_positions_that_fall_are_told_with_the_file():
    text = SPREADSHEET.replace("50,5;0;", "50,5;0,5;")
    message = r"^t.csv: position must increase, 0.25 follows 0.5$"
    with pytest.raises(TableError, match=message):
        parse_table(text, "t.csv")


def test_three_digits_after_a_mark_may_be_thousands():
    """Read as decimals only where another cell shows that commas are decimal."""
    text = SPREADSHEET.replace("50,5", "50,125")
    assert parse_table(text).torque_Nm.tolist() == [50.125]
    for line in ("2,990;0;3e8;2", "2;0;2,990;2"):
        lines = [*SPREADSHEET.splitlines()[:2], line]
        with pytest.raises(TableError) as caught:
            parse_table("\n".join(lines), "t.csv")
        assert str(caught.value) == (
            "t.csv, line 3: '2,990' may be 2.990 or 2990; write thousands without a "
            "separator, and decimals with a point"
        )
    text = SPREADSHEET.replace("50,5", "2.990")
    with pytest.raises(TableError, match=r"'2\.990' may be 2\.990 or 2990; write"):
        parse_table(text, "t.csv")
    assert parse_table(text.replace(",", ".")).torque_Nm.tolist() == [2.99]


def test_a_torque_is_there_once():
    with pytest.raises(TableError, match=r"^torque_Nm = 5 is there more than once$"):
        MeshTable(np.array([5.0, 5.0]), np.zeros(1), {})
