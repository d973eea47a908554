"""MAT files, version 5, of structs, matrices and texts, as MATLAB and Octave load them.

Numbers are doubles, which MATLAB computes with; columns are n x 1, texts of a column a
cell array. The file holds no date, so that equal values give equal bytes.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError, refused_foreign_errors
from fegear.files.mat_elements import require_sound_sizes
from fegear.files.output import write_bytes
from fegear.files.version import package_version

LONGEST_NAME = 63  # letters, namelengthmax of MATLAB
DESCRIPTION = 116  # bytes at the start of a file, where SciPy writes the date
HDF5_START = b"\x89HDF\r\n\x1a\n"
MAT_73_START = b"MATLAB 7.3"
NO_LETTER = re.compile(r"[^A-Za-z0-9_]")
KEYWORDS = frozenset(
    (
        *("break", "case", "catch", "classdef", "continue", "else", "elseif", "end"),
        *("for", "function", "global", "if", "otherwise", "parfor", "persistent"),
        *("return", "spmd", "switch", "try", "while"),
    )
)


def matlab_names(names: Iterable[str]) -> dict[str, str]:
    """Identifiers of MATLAB by name, all different, such as `mesh_2_phase`."""
    identifiers: dict[str, str] = {}
    for name in names:
        identifier, number = _identifier(name), 1
        while identifier in identifiers.values():
            number += 1
            end = f"_{number}"
            identifier = _identifier(name)[: LONGEST_NAME - len(end)] + end
        identifiers[name] = identifier
    return identifiers


def _identifier(name: str) -> str:
    letters = NO_LETTER.sub("_", name)
    if not letters[:1].isalpha():
        letters = f"x_{letters}"
    return f"{letters}_" if letters in KEYWORDS else letters[:LONGEST_NAME]


def matlab_column(values: NDArray[Any]) -> NDArray[Any]:
    """A column (n,) as n x 1: doubles, logicals, or texts in cells."""
    if values.dtype.kind == "U":
        return text_cells([[str(text)] for text in values])
    return (values if values.dtype == bool else values.astype(float))[:, None]


def text_cells(rows: Sequence[Sequence[str]]) -> NDArray[Any]:
    """Rows of texts as a cell array."""
    cells = np.empty((len(rows), len(rows[0]) if rows else 0), dtype=object)
    for index in np.ndindex(cells.shape):
        cells[index] = rows[index[0]][index[1]]
    return cells


def is_hdf5(content: bytes) -> bool:
    """Whether a content is an HDF5 file, or a MAT file of version 7.3, which is one."""
    return content.startswith((MAT_73_START, HDF5_START))


def read_matlab(content: bytes, path: str) -> dict[str, Any]:
    """Variables of a MAT file up to version 7 as SciPy reads them, structs as records.

    Raises InputError for a damaged file, and for one that is HDF5.
    """
    from scipy.io import loadmat

    if is_hdf5(content):
        raise InputError(f"{path}: is HDF5; save it as version 7, save -v7")
    stream: Any = io.BytesIO(content)
    with refused_foreign_errors(path, "MAT file"):
        require_sound_sizes(content, path)
        variables = loadmat(stream, struct_as_record=True)
    return {name: v for name, v in variables.items() if not name.startswith("__")}


def matlab_tree(value: Any) -> Any:
    """A struct as a tree, a text as one, cells as an array of what is in them."""
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names:
        one = value.ravel()
        names = value.dtype.names if one.size == 1 else ()
        return {name: matlab_tree(one[0][name]) for name in names}
    if value.dtype.kind == "U":
        return "\n".join(map(str, value.ravel()))
    if value.dtype == object:
        cells = np.empty(value.shape, dtype=object)
        for index in np.ndindex(value.shape):
            cells[index] = matlab_tree(value[index])
        return cells
    return value


def write_matlab(path: Path, variables: Mapping[str, Any]) -> None:
    """Write variables: matrices, texts, and mappings of these as structs.

    Raises InputError where the file cannot be written or cannot hold the values.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    out: Any = io.BytesIO()
    try:
        savemat(out, dict(variables), long_field_names=True, oned_as="column")
    except MatWriteError:
        raise InputError(
            f"{path}: the tables are too large for a MAT file; use .nc or .csv"
        ) from None
    text = f"MATLAB 5.0 MAT-file, written by fegear {package_version()}"
    content = text.encode().ljust(DESCRIPTION) + out.getvalue()[DESCRIPTION:]
    write_bytes(path, content)
