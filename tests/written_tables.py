"""Tables that were written for other programs, read back and compared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, netcdf_file

from fegear.files.matlab import matlab_names
from fegear.studies.table import tables_of
from fegear.studies.table_files import columns_of
from lumped.steady.sweep_table import SweepTable, parse_sweep


def read_sweep(path: str) -> SweepTable:
    """Read a sweep table; raises OSError or TableError if that fails."""
    with open(path, encoding="utf-8", newline="") as file:
        return parse_sweep(file.read(), str(path))


def require_same(result: Any, path: Path) -> None:
    """Every column of every table is in the file, to the last bit."""
    read = {".mat": of_matlab, ".xlsx": of_excel, ".nc": of_netcdf}[path.suffix.lower()]
    for name, table in tables_of(result):
        expected = columns_of(table)
        actual = read(path, name, [*expected])
        for column, values in expected.items():
            if column in actual or path.suffix.lower() != ".nc":  # numbers alone
                cells = actual[column]
                if not np.any(values != "") and path.suffix.lower() == ".xlsx":
                    values = np.full(len(values), np.nan)  # empty cells have no kind
                np.testing.assert_array_equal(cells, values, column)


def of_matlab(path: Path, name: str, columns: list[str]) -> dict[str, Any]:
    struct = loadmat(path, chars_as_strings=True)[matlab_names([name])[name]][0, 0]
    fields = matlab_names(columns)
    return {column: plain(struct[field]) for column, field in fields.items()}


def plain(cells: Any) -> Any:
    """A column of a MAT file: texts of cells, numbers as they are."""
    if cells.dtype != object:
        return cells.ravel()
    return np.array([c.item() if c.size else "" for c in cells.ravel()], str)


def of_excel(path: Path, name: str, columns: list[str]) -> dict[str, Any]:
    from openpyxl import load_workbook

    names, _, *rows = load_workbook(path)[name].values
    assert list(names) == columns
    cells = zip(*rows, strict=True) if rows else [()] * len(names)
    return {n: _values(column) for n, column in zip(names, cells, strict=True)}


def _values(cells: Any) -> Any:
    texts = [c for c in cells if isinstance(c, str) and c != "inf" and c != "-inf"]
    if texts or not cells:
        return np.array(["" if c is None else c for c in cells], str)
    if all(isinstance(c, bool) for c in cells):
        return np.array(cells)
    return np.array([np.nan if c is None else float(c) for c in cells])


def of_netcdf(path: Path, name: str, columns: list[str]) -> dict[str, Any]:
    prefix = "" if name == "table" else f"{name}."
    with netcdf_file(path, "r", mmap=False) as file:
        return {
            column: file.variables[prefix + column].data.astype(float)
            for column in columns
            if prefix + column in file.variables
        }
