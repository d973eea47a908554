"""The sweep table and its file."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from written_tables import read_sweep

from lumped.common.csv_text import TableError
from lumped.steady.response import Status
from lumped.steady.sweep_table import (
    COLUMNS,
    LEGEND,
    SweepRow,
    SweepTable,
    format_sweep,
    parse_sweep,
    sweep_table,
)

ROW = SweepRow("1", "up", 100.0, 800.0, 1, 2e-6, 1e-8, 7e-6, 9e-6, 3e3, 0.25, 0.0, 2)
numbers = st.floats(allow_nan=False, allow_infinity=True, width=64)


def test_columns_are_those_that_are_documented():
    assert COLUMNS == (
        "model",
        "direction",
        "torque_Nm",
        "mesh_frequency_Hz",
        "mesh",
        "dte_rms_m",
        "dte_rms_stderr_m",
        "dte_mean_m",
        "dte_peak_m",
        "force_peak_N",
        "contact_loss_fraction",
        "back_side_fraction",
        "period_multiple",
    )


@given(numbers, numbers)
def test_reading_back_gives_the_same_bits(one, two):
    row = replace(ROW, dte_rms_m=one, force_peak_N=two, direction="down", mesh=2)
    table = SweepTable((ROW, row), {"gear set": "a: b"})
    assert parse_sweep(format_sweep(table)) == table


def test_nan_is_an_empty_cell():
    text = format_sweep(SweepTable((replace(ROW, dte_rms_m=math.nan),)))
    assert ",1,,1e-08,7e-06," in text
    assert math.isnan(parse_sweep(text).rows[0].dte_rms_m)


def test_file_goes_there_and_back(tmp_path):
    table = SweepTable((ROW,), {"gear set": "liu-idler"})
    (tmp_path / "s.csv").write_text(format_sweep(table))
    assert read_sweep(str(tmp_path / "s.csv")) == table


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1,up", "1,sideways", "t.csv, line 3, column direction: 'sideways'"),
        ("800.0", "fast", "line 3, column mesh_frequency_Hz"),
        ("800.0,1,", "800.0,0,", "line 3, column mesh: 0 must be 1 or more"),
        ("0.0,2", "0.0,-1", "line 3, column period_multiple: -1"),
        ("0.0,2", "0.0", "line 3: 12 cells where 13 are named"),
        ("mesh,dte", "gear,dte", "t.csv: column mesh is missing"),
        ("period_multiple\n", "period_multiple,x\n", "line 3: 13 cells where 14"),
    ],
)
def test_wrong_files_name_line_and_column(old, new, message):
    text = format_sweep(SweepTable((ROW,), {"gear set": "a"}))
    assert old in text
    with pytest.raises(TableError, match=message):
        parse_sweep(text.replace(old, new), "t.csv")


def test_an_unknown_column_is_refused():
    text = format_sweep(SweepTable((ROW,), {"gear set": "a"}))
    text = text.replace("\n", ",x\n").replace("gear set: a,x", "gear set: a")
    with pytest.raises(TableError, match=r"t\.csv: unknown column x"):
        parse_sweep(text, "t.csv")


def test_an_empty_file_is_refused():
    with pytest.raises(TableError, match=r"t\.csv: no column names"):
        parse_sweep("# only: comments\n", "t.csv")


def response(frequency, status=Status.PERIODIC):
    values = np.array([1.0, 2.0])
    names = (
        "dte_rms",
        "dte_rms_stderr",
        "dte_mean",
        "dte_peak",
        "force_peak",
        "contact_loss",
    )
    figures = dict.fromkeys((*names, "back_side"), values)
    multiple = np.array([72, 19])
    return SimpleNamespace(
        frequency=frequency, status=status, period_multiple=multiple, **figures
    )


def test_rows_come_mesh_by_mesh_and_a_divergence_has_none():
    responses = (response(900.0), response(880.0, Status.DIVERGED))
    branch = SimpleNamespace(direction="down", responses=responses)
    table = sweep_table([(50.0, branch)], "2", {"gear set": "a"})
    assert [(r.mesh, r.dte_rms_m, r.period_multiple) for r in table.rows] == [
        (1, 1.0, 72),
        (2, 2.0, 19),
    ]
    assert {r.mesh_frequency_Hz for r in table.rows} == {900.0}
    assert dict(table.header) == {"gear set": "a"} | LEGEND
