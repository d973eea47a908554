"""Tables of results in files of other programs: MAT files, spreadsheets, NetCDF."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import written_tables
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

import fegear
from fegear.files.errors import InputError
from fegear.files.excel import LONGEST_TEXT, Sheet, write_excel
from fegear.files.matlab import LONGEST_NAME, matlab_names
from fegear.studies.result import StudyResult
from fegear.studies.saving import load
from fegear.studies.study import Study
from fegear.studies.table import Table
from fegear.studies.table_files import columns_of


@dataclass(frozen=True, kw_only=True)
class Cells(Study, command="cells", example="cells"):
    """Cells of every kind."""


@dataclass(frozen=True, eq=False, repr=False)
class CellsResult(StudyResult):
    columns: dict[str, Any]
    header: dict[str, str] = field(default_factory=dict)
    more: dict[str, Table] = field(default_factory=dict)
    study: Any = field(default_factory=Cells)
    summary: Any = field(default_factory=dict)

    @property
    def table(self) -> Table:
        rows = list(zip(*self.columns.values(), strict=True))
        return Table(tuple(self.columns), lambda: rows, self.header)

    @property
    def more_tables(self) -> dict[str, Table]:
        return self.more

    def page(self) -> Any:
        return iter(())


CELLS = {
    "time_s": [0.1, 1.0 / 3.0, 5e-324],
    "force_N": [-1.7976931348623157e308, math.nan, math.inf],
    "count": [1, 2, 3],
    "mesh.2.phase": [0.1 + 0.2, "", None],
    "kind": ["=1+1", "#N/A", "gear \u00e4"],
    "free": [True, False, True],
}
HEADER = {"gear set": "pair", "kind": "what moves", "speeds": "1 " * LONGEST_TEXT}


@pytest.fixture
def result():
    more = {"spectra": Table.of({"order": [1.0, 2.0]}, {"lines": "all"})}
    return CellsResult(CELLS, HEADER, more)


@pytest.mark.parametrize("ending", [".mat", ".xlsx", ".MAT", ".XLSX"])
def test_all_tables_come_back_to_the_bit(result, tmp_path, ending):
    path = tmp_path / f"t{ending}"
    result.write(path)
    written_tables.require_same(result, path)


def test_names_of_columns_are_identifiers_of_matlab(result, tmp_path):
    result.write(tmp_path / "t.mat")
    held = loadmat(tmp_path / "t.mat", simplify_cells=True)
    assert held["names"]["mesh_2_phase"] == "mesh.2.phase"
    assert held["units"]["force_N"] == "N"
    assert held["meaning"]["kind"] == "what moves"
    assert held["table"]["kind"].tolist() == CELLS["kind"]
    assert held["table"]["free"].dtype == np.uint8  # logical
    assert dict(held["header"]) == HEADER
    assert dict([held["spectra_header"]]) == {"lines": "all"}
    names = ["a.b", "a b", "2nd", "end", "x" * 80, "x" * 90, "\u00e4", "a_b"]
    identifiers = [*matlab_names(names).values()]
    assert identifiers[:4] == ["a_b", "a_b_2", "x_2nd", "end_"]
    assert len({*identifiers}) == len(names)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.text(max_size=70), unique=True, max_size=4))
def test_every_name_becomes_an_identifier_of_its_own(names):
    identifiers = list(matlab_names(names).values())
    assert len({*identifiers}) == len(names)
    for name in identifiers:
        assert name.isidentifier()
        assert name.isascii()
        assert name[0].isalpha()
        assert len(name) <= LONGEST_NAME


def test_a_spreadsheet_says_units_meanings_and_inputs(result, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    result.write(tmp_path / "t.xlsx")
    book = openpyxl.load_workbook(tmp_path / "t.xlsx")
    assert book.sheetnames == ["table", "spectra", "columns", "inputs"]
    assert [c.value for c in book["table"][2]] == ["s", "N", None, None, None, None]
    assert book["table"]["E3"].data_type == "s"  # no formula
    assert book["table"]["B5"].value == "inf"
    columns = list(book["columns"].values)
    assert ("table", "kind", None, "what moves") in columns
    inputs = list(book["inputs"].values)[2:]
    assert "".join(v for _, k, v in inputs if k == "speeds") == HEADER["speeds"]
    assert "kind" not in [key for _, key, _ in inputs]
    assert book.properties.created == datetime(1980, 1, 1)


@pytest.mark.parametrize("ending", [".csv", ".mat", ".xlsx"])
def test_equal_tables_give_equal_bytes(result, tmp_path, monkeypatch, ending):
    one, other = tmp_path / f"a{ending}", tmp_path / f"b{ending}"
    result.write(one)
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 0, 0, 0))
    monkeypatch.setattr("time.asctime", lambda *_: "another day")
    result.write(other)
    assert one.read_bytes() == other.read_bytes()


def test_a_table_without_rows_is_written(tmp_path):
    result = CellsResult({"time_s": [], "kind": []})
    for ending in (".mat", ".xlsx"):
        result.write(tmp_path / f"t{ending}")
        written_tables.require_same(result, tmp_path / f"t{ending}")


def test_columns_are_numbers_where_they_can_be(result):
    kinds = {
        name: values.dtype.kind for name, values in columns_of(result.table).items()
    }
    assert "".join(kinds.values()) == "ffffUb"
    texts = CellsResult({"a": ["", ""], "b": [None, None], "c": [1, "one"]}).table
    assert [v.dtype.kind for v in columns_of(texts).values()] == ["U", "f", "U"]


def test_a_table_is_written_alone(result, tmp_path):
    for ending in (".csv", ".mat", ".xlsx"):
        result.write_table(tmp_path / f"s{ending}", "spectra")
    alone = loadmat(tmp_path / "s.mat", simplify_cells=True)
    assert alone["spectra"]["order"].tolist() == [1.0, 2.0]
    assert (tmp_path / "s.csv").read_text() == result.more["spectra"].csv()
    with pytest.raises(InputError, match=r"s\.nc: .*\.csv, \.mat, \.xlsx or \.txt$"):
        result.write_table(tmp_path / "s.nc", "spectra")
    with pytest.raises(InputError, match=r"^name = other; tables are spectra$"):
        result.write_table(tmp_path / "s.csv", "other")


def test_files_that_cannot_be_are_refused_in_one_line(result, tmp_path, monkeypatch):
    allowed = r"must end in \.csv, \.mat, \.nc, \.xlsx or \.txt$"
    with pytest.raises(InputError, match=allowed):
        result.write(tmp_path / "t.ods")
    monkeypatch.setattr("fegear.files.excel.MAX_ROWS", 4)
    with pytest.raises(InputError, match="table has 5 rows, a sheet holds at most 4; "):
        result.write(tmp_path / "t.xlsx")
    monkeypatch.setattr("fegear.files.output.has_package", lambda name: False)
    needed = r"needs openpyxl: pip install 'fegear\[excel\]'$"
    with pytest.raises(InputError, match=needed):
        result.write(tmp_path / "t.xlsx")
    assert not list(tmp_path.iterdir())


def test_a_file_that_fails_leaves_what_was_there(result, tmp_path, monkeypatch):
    path = tmp_path / "t.mat"
    path.write_text("before")
    monkeypatch.setattr(Path, "write_bytes", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        result.write(path)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_numbers_of_a_spreadsheet_are_whole(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    numbers = np.random.default_rng(5).standard_normal(200) * 10.0 ** np.arange(200)
    write_excel(tmp_path / "t.xlsx", {"a": Sheet({"x": numbers.tolist()})})
    rows = openpyxl.load_workbook(tmp_path / "t.xlsx")["a"].values
    assert [value for (value,) in rows][1:] == numbers.tolist()


MESH = fegear.StaticsSettings(resolution="coarse", positions=16)


def test_a_mesh_table_is_a_lookup_table_too(tmp_path):
    study = fegear.MeshStiffness(torque=[200.0, 100.0], elements=MESH)
    result = fegear.run(study)
    result.write(tmp_path / "t.mat")
    held = loadmat(tmp_path / "t.mat")
    lookup, table = held["lookup"][0, 0], result.solved.table
    assert lookup["torque_Nm"].tolist() == [[100.0], [200.0]]
    assert lookup["position"].ravel().tolist() == table.position.tolist()
    for name in ("stiffness_N_per_m", "ste_m"):
        assert np.array_equal(lookup[name], table[name][::-1])
    result.write(tmp_path / "t.nc")
    assert load(tmp_path / "t.nc").table.csv() == result.table.csv()
