"""Tables of results as files that other programs read, by the ending of the name.

CSV has the table of a result. MAT and HDF5 files and spreadsheets have all of its
tables, with the unit and the meaning of every column, and NetCDF the whole result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.data_sets import DataArray, write_data_set
from fegear.files.errors import InputError
from fegear.files.excel import Sheet, wrapped, write_excel
from fegear.files.matlab import matlab_column, matlab_names, text_cells, write_matlab
from fegear.files.output import HDF5, SINGLE_TABLES, path_of, require_ending, write_text
from fegear.files.version import package_version
from fegear.studies.columns import MAIN, meaning_and_unit
from fegear.studies.saving import Saved, save
from fegear.studies.table import Table, Tabled, tables_of
from lumped.common.csv_text import TableError
from lumped.train.table import REQUIRED_COLUMNS, table_of_columns


@dataclass(frozen=True, eq=False)
class DescribedTable:
    """A table with what its columns mean.

    columns : (n,) doubles, truth values or texts by name
    units, meanings : of the columns, in their order; empty where there is none
    header : entries above the table in CSV
    """

    columns: Mapping[str, NDArray[Any]]
    units: list[str]
    meanings: list[str]
    header: Mapping[str, str]

    @property
    def entries(self) -> dict[str, str]:
        """The header without the meanings of columns."""
        return {k: str(v) for k, v in self.header.items() if k not in self.columns}


def write_result(result: Saved, path: str | Path) -> None:
    """Write the tables of a result, or the whole result as `.nc`.

    Raises InputError for another ending, or where the file cannot be written.
    """
    target = path_of(path)
    require_ending(target, result.study.endings)
    kind = target.suffix.lower()
    if kind == ".nc":
        save(result, target)
    elif kind in WRITERS:
        _ = result.table  # InputError where there is none
        _write_tables(target, result.study.command, dict(tables_of(result)))
    else:
        write_text(target, result.table.csv())


def write_table(result: Tabled, path: str | Path, name: str) -> None:
    """Write one of the tables besides the first; InputError as `write_result`."""
    target = path_of(path)
    require_ending(target, SINGLE_TABLES)
    tables = result.more_tables
    if name not in tables:
        raise InputError(f"name = {name}; tables are {', '.join(tables) or 'none'}")
    if target.suffix.lower() in WRITERS:
        _write_tables(target, result.study.command, {name: tables[name]})
    else:
        write_text(target, tables[name].csv())


def _write_tables(path: Path, command: str, tables: Mapping[str, Table]) -> None:
    described = {name: describe(command, name, t) for name, t in tables.items()}
    WRITERS[path.suffix.lower()](path, command, described)


def describe(command: str, name: str, table: Table) -> DescribedTable:
    """A table of a command with the meaning and the unit of its columns."""
    pairs = [meaning_and_unit(command, key, name, table.header) for key in table.names]
    meanings, units = ([pair[i] for pair in pairs] for i in (0, 1))
    return DescribedTable(columns_of(table), units, meanings, table.header)


def columns_of(table: Table) -> dict[str, NDArray[Any]]:
    """Columns (n,) of a table by name: numbers, truth values or texts."""
    cells = list(zip(*table.rows(), strict=True)) or [()] * len(table.names)
    return {
        name: _column(values) for name, values in zip(table.names, cells, strict=True)
    }


def _column(cells: Iterable[Any]) -> NDArray[Any]:
    """Doubles where all cells that are not empty are numbers, texts otherwise."""
    values = np.array([_plain_cell(cell) for cell in cells], dtype=object)
    kinds = {type(value) for value in values if value is not None and value != ""}
    if kinds == {bool} and None not in values:
        return values.astype(bool)
    if kinds <= {bool, int, float} and (kinds or "" not in values):
        return np.array([np.nan if v in (None, "") else v for v in values], float)
    return np.array(["" if value is None else str(value) for value in values], str)


def _plain_cell(cell: Any) -> Any:
    return cell.item() if isinstance(cell, np.generic) else cell


def _write_matlab(
    path: Path, command: str, tables: Mapping[str, DescribedTable]
) -> None:
    """A struct of columns for each table, and structs of their units and meanings."""
    variables: dict[str, Any] = {}
    for name, table in tables.items():
        table_name = matlab_names([name])[name]
        prefix = "" if name == MAIN else f"{table_name}_"
        fields = matlab_names(table.columns)
        columns = {
            field: matlab_column(table.columns[key]) for key, field in fields.items()
        }
        texts = {"units": table.units, "meaning": table.meanings, "names": fields}
        variables[table_name] = columns
        for suffix, values in texts.items():
            described_table = dict(zip(fields.values(), values, strict=True))
            variables[f"{prefix}{suffix}"] = described_table
        rows = [[key, str(text)] for key, text in table.header.items()]
        variables[f"{prefix}header"] = text_cells(rows)
        lookup = lookup_of(table)
        if lookup:
            variables[f"{prefix}lookup"] = lookup
    variables["made_with"] = f"fegear {package_version()}, {command}"
    write_matlab(path, variables)


def lookup_of(table: DescribedTable) -> dict[str, NDArray[Any]]:
    """Breakpoints and matrices (torques x positions) of a mesh table, {} of others.

    Torques rise, as tables that interpolate ask for.
    """
    columns = {n: v for n, v in table.columns.items() if v.dtype.kind != "U"}
    if not set(REQUIRED_COLUMNS) <= columns.keys():
        return {}
    with suppress(TableError):
        mesh_table = table_of_columns(columns, {})
        order = np.argsort(mesh_table.torque_Nm)
        fields = matlab_names(mesh_table.columns)
        return {
            "torque_Nm": mesh_table.torque_Nm[order][:, None],
            "position": mesh_table.position[:, None],
            **{fields[key]: v[order] for key, v in mesh_table.columns.items()},
        }
    return {}


def _write_excel(
    path: Path, command: str, tables: Mapping[str, DescribedTable]
) -> None:
    """A sheet for each table, one of what the columns mean and one of the inputs."""
    sheets = {
        name: Sheet({k: v.tolist() for k, v in table.columns.items()}, table.units)
        for name, table in tables.items()
    }
    columns = [
        (name, *entry)
        for name, table in tables.items()
        for entry in zip(table.columns, table.units, table.meanings, strict=True)
    ]
    inputs = [("", "made with", f"fegear {package_version()}, {command}")]
    inputs += [
        (name, key, part)
        for name, table in tables.items()
        for key, text in table.entries.items()
        for part in wrapped(text)
    ]
    sheets["columns"] = _sheet(("table", "column", "unit", "meaning"), columns)
    sheets["inputs"] = _sheet(("table", "entry", "value"), inputs)
    write_excel(path, sheets)


def _sheet(names: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Sheet:
    cells = zip(*rows, strict=True)
    return Sheet(dict(zip(names, cells, strict=True)))


def _write_hdf5(path: Path, command: str, tables: Mapping[str, DescribedTable]) -> None:
    """A group of columns for each table."""
    groups = {}
    attributes = {"made_with": f"fegear {package_version()}, {command}"}
    for name, table in tables.items():
        described_table = zip(
            table.columns.items(), table.units, table.meanings, strict=True
        )
        groups[name] = {
            key: DataArray(
                values, ("row",), {"units": unit or "1", "long_name": meaning}
            )
            for (key, values), unit, meaning in described_table
        }
        attributes |= table.entries
    write_data_set(path, attributes, groups)


Writer = Callable[[Path, str, Mapping[str, DescribedTable]], None]
WRITERS: Mapping[str, Writer] = {
    ".mat": _write_matlab,
    ".xlsx": _write_excel,
    HDF5: _write_hdf5,
}
