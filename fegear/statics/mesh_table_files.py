"""Mesh tables from files of other programs: MAT files, HDF5, NetCDF and CSV.

A file holds columns (n,), a row for each torque and position, or two vectors and
matrices, torques x positions, as tables that interpolate have. Either is at the top of
the file, or in the first struct or group that has the required names. Texts are left
out, and so are single numbers, which are settings of the program.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError, refused_foreign_errors
from fegear.files.hdf5_groups import read_group
from fegear.files.matlab import is_hdf5, matlab_tree, read_matlab
from fegear.files.output import (
    HDF5_NEEDED,
    has_package,
    listed,
    read_content,
    read_text,
)
from lumped.common.csv_text import TableError
from lumped.train.table import (
    REQUIRED_COLUMNS,
    MeshTable,
    parse_table,
    table_of_columns,
)

Tree = Mapping[str, Any]  # of arrays, texts and further trees
Parts = tuple[Tree, Tree | None]  # the top of a file, and what has the columns
MAX_SIZE = 1e30  # of a number: products of a few stay in the range of doubles


def read_mesh_table(path: str) -> MeshTable:
    """A mesh table by the ending of the name, CSV unless it is one of `READERS`.

    Raises TableError naming the file, and InputError where it cannot be read.
    """
    table = _read(path)
    for name, values in table.columns.items():
        large = np.abs(values) > MAX_SIZE
        if large.any():
            raise TableError(
                f"{path}: column {name} has {values[large][0]:g}; allowed "
                f"{-MAX_SIZE:g} to {MAX_SIZE:g}"
            )
    return table


def _read(path: str) -> MeshTable:
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        return parse_table(read_text(path), path)
    top, holder = reader(read_content(path), path)
    if holder is None:
        names = listed(REQUIRED_COLUMNS).replace(" or ", " and ")
        raise TableError(f"{path}: no struct or group has the variables {names}")
    return table_of_columns(_columns(holder, path), _header(top, holder), path)


def _top_and_holder(tree: Tree) -> Parts:
    """A tree, and its first part that has all required columns."""
    return tree, next(_holders(tree), None)


def _holders(tree: Tree) -> Iterator[Tree]:
    """Parts of a file that have all required columns, from the top."""
    if set(REQUIRED_COLUMNS) <= tree.keys():
        yield tree
    for part in tree.values():
        if isinstance(part, Mapping):
            yield from _holders(part)


def _columns(holder: Tree, source: str) -> dict[str, NDArray[np.float64]]:
    """Columns (n,) of the numbers of a part of a file."""
    arrays = {name: v for name, v in holder.items() if _is_numbers(v)}
    for name in REQUIRED_COLUMNS:
        if name not in arrays:
            raise TableError(f"{source}: {name} must hold real numbers")
    torque, position = (arrays.pop(name).ravel() for name in REQUIRED_COLUMNS[:2])
    arrays = {name: v for name, v in arrays.items() if v.size > 1 or position.size == 1}
    if arrays[REQUIRED_COLUMNS[2]].size == torque.size == position.size:
        flat = {name: _vector(v) for name, v in arrays.items()}
    else:
        shape = (torque.size, position.size)
        flat = {name: _matrix(name, v, shape, source) for name, v in arrays.items()}
        torque, position = (
            grid.ravel() for grid in np.meshgrid(torque, position, indexing="ij")
        )
    columns = {REQUIRED_COLUMNS[0]: torque, REQUIRED_COLUMNS[1]: position, **flat}
    with np.errstate(over="ignore"):  # of longer floats: infinite, which is refused
        return {name: values.astype(float) for name, values in columns.items()}


def _is_numbers(values: Any) -> bool:
    return isinstance(values, np.ndarray) and values.dtype.kind in "fiu"


def _vector(values: NDArray[Any]) -> NDArray[Any]:
    """A row or a column as a vector; of others the shape is refused later."""
    return values.ravel() if values.size == max(values.shape, default=1) else values


def _matrix(
    name: str, values: NDArray[Any], shape: tuple[int, int], source: str
) -> NDArray[Any]:
    fits = values.shape == shape or (1 in shape and values.size == max(shape))
    if not fits:
        expected, actual = (
            " x ".join(map(str, size)) for size in (shape, values.shape)
        )
        raise TableError(
            f"{source}: {name} must have a row for each torque and a column for each "
            f"position, {expected}, got {actual}"
        )
    return values.ravel()


def _header(*parts: Tree) -> dict[str, str]:
    """Entries of headers: texts by name, and lines or cells of the one named header."""
    entries: dict[str, str] = {}
    for part in parts:
        texts = {key: text for key, text in part.items() if isinstance(text, str)}
        header = texts.pop("header", part.get("header"))
        entries |= texts
        if isinstance(header, str):
            rows = [line.split(": ", 1) for line in header.splitlines()]
        else:
            rows = getattr(header, "tolist", list)()
        entries |= {str(row[0]): str(row[1]) for row in rows if _is_entry(row)}
    return entries


def _is_entry(row: Any) -> bool:
    is_pair = isinstance(row, list) and len(row) == 2
    return is_pair and row[0] is not None and row[1] is not None


def _read_mat(content: bytes, path: str) -> Parts:
    if is_hdf5(content):
        return _read_hdf5(content, path)
    variables = read_matlab(content, path)
    with refused_foreign_errors(path, "MAT file"):
        return _top_and_holder({n: matlab_tree(v) for n, v in variables.items()})


def _read_hdf5(content: bytes, path: str) -> Parts:
    if not has_package("h5py"):
        raise InputError(f"{path}: {HDF5_NEEDED}")
    return read_group(content, REQUIRED_COLUMNS, path)


def _read_netcdf(content: bytes, path: str) -> Parts:
    from scipy.io import netcdf_file

    if is_hdf5(content):  # version 4 of the format
        return _read_hdf5(content, path)
    with (
        refused_foreign_errors(path, "NetCDF file"),
        netcdf_file(io.BytesIO(content), "r", mmap=False) as file,
    ):
        return _top_and_holder(_netcdf_parts(file))


def _netcdf_parts(file: Any) -> dict[str, Any]:
    """The header, and variables over torques and positions."""
    needed = [file.variables.get(name) for name in REQUIRED_COLUMNS[:2]]
    allowed = {d for variable in needed if variable for d in variable.dimensions}
    header = getattr(file, "header", b"").decode()
    return {"header": header} | {
        name: np.array(variable.data)
        for name, variable in file.variables.items()
        if set(variable.dimensions) <= allowed
    }


READERS: Mapping[str, Callable[[bytes, str], Parts]] = {
    ".mat": _read_mat,
    ".h5": _read_hdf5,
    ".hdf5": _read_hdf5,
    ".nc": _read_netcdf,
}
# for a help text
TABLE_FILE = f"({listed(['.csv', *READERS])})"
