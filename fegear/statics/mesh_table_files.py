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

from fegear.files.errors import InputError, file_error
from fegear.files.output import HDF5_NEEDED, has_package, listed, read_text
from lumped.common.csv_text import TableError
from lumped.train.table import (
    REQUIRED_COLUMNS,
    MeshTable,
    parse_table,
    table_of_columns,
)

Tree = Mapping[str, Any]  # of arrays, texts and further trees
HDF5_START = b"\x89HDF\r\n\x1a\n"
MAT_73_START = b"MATLAB 7.3"


def read_mesh_table(path: str) -> MeshTable:
    """A mesh table by the ending of the name, CSV unless it is one of `READERS`.

    Raises TableError naming the file, and InputError where it cannot be read.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        return parse_table(read_text(path), path)
    try:
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise file_error(path, "read", error) from None
    tree = reader(content, path)
    holder = next(_holders(tree), None)
    if holder is None:
        names = listed(REQUIRED_COLUMNS).replace(" or ", " and ")
        raise TableError(f"{path}: no struct or group has the variables {names}")
    return table_of_columns(_columns(holder, path), _header(tree, holder), path)


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
    return isinstance(row, list) and len(row) == 2


def _mat_tree(content: bytes, path: str) -> Tree:
    from scipy.io import loadmat

    if content.startswith((MAT_73_START, HDF5_START)):
        return _hdf5_tree(content, path)
    stream: Any = io.BytesIO(content)
    try:
        held = loadmat(stream, struct_as_record=True)
    except Exception:  # whatever SciPy makes of bytes that are no such file
        raise InputError(f"{path}: is no MAT file, or damaged") from None
    return {k: _mat_part(v) for k, v in held.items() if not k.startswith("__")}


def _mat_part(value: Any) -> Any:
    """A struct as a tree, a text as one, cells as an array of what is in them."""
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names:
        one = value.ravel()
        names = value.dtype.names if one.size == 1 else ()
        return {name: _mat_part(one[0][name]) for name in names}
    if value.dtype.kind == "U":
        return "\n".join(map(str, value.ravel()))
    if value.dtype == object:
        cells = np.empty(value.shape, dtype=object)
        for index in np.ndindex(value.shape):
            cells[index] = _mat_part(value[index])
        return cells
    return value


def _hdf5_tree(content: bytes, path: str) -> Tree:
    if not has_package("h5py"):
        raise InputError(f"{path}: {HDF5_NEEDED}")
    import h5py

    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            return _hdf5_part(file)
    except OSError:
        raise InputError(f"{path}: is no HDF5 file, or damaged") from None


def _hdf5_part(group: Any) -> dict[str, Any]:
    """Arrays and groups of a group, and its attributes that are texts."""
    import h5py

    texts = {k: v for k, v in group.attrs.items() if isinstance(v, str)}
    parts: dict[str, Any] = texts
    for name, item in group.items():
        if isinstance(item, h5py.Group):
            parts[name] = _hdf5_part(item)
        elif "MATLAB_class" in item.attrs:
            parts[name] = _mat_73_part(item)
        elif item.dtype.kind in "fiu":
            parts[name] = np.asarray(item[()])
    return parts


def _mat_73_part(item: Any) -> Any:
    """A variable of MATLAB, which stores by columns: numbers, a text or cells."""
    kind, values = bytes(item.attrs["MATLAB_class"]), item[()]
    if "MATLAB_empty" in item.attrs:
        return ""
    if kind == b"char":
        return "".join(map(chr, values.ravel()))
    if kind == b"cell":
        cells = np.empty(values.T.shape, dtype=object)
        for index in np.ndindex(cells.shape):
            inner = item.file[values.T[index]]
            if "MATLAB_class" in inner.attrs and hasattr(inner, "dtype"):
                cells[index] = _mat_73_part(inner)
        return cells
    return values.T


def _netcdf_tree(content: bytes, path: str) -> Tree:
    from scipy.io import netcdf_file

    if content.startswith(HDF5_START):  # version 4 of the format
        return _hdf5_tree(content, path)
    try:
        with netcdf_file(io.BytesIO(content), "r", mmap=False) as file:
            return _netcdf_parts(file)
    except Exception:  # as above
        raise InputError(f"{path}: is no NetCDF file, or damaged") from None


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


READERS: Mapping[str, Callable[[bytes, str], Tree]] = {
    ".mat": _mat_tree,
    ".h5": _hdf5_tree,
    ".hdf5": _hdf5_tree,
    ".nc": _netcdf_tree,
}
# for a help text
TABLE_FILE = f"({listed(['.csv', *READERS])})"
