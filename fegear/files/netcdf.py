"""NetCDF files of texts and arrays, which appear whole or not at all.

The classic format, which SciPy writes and `xarray.open_dataset` reads. It has no
64-bit integers and no truth values: these are stored as bytes, doubles or 32-bit
integers that hold them exactly, and an attribute names what they were.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError, refused_foreign_errors
from fegear.files.output import read_content, write_bytes

STORED_TYPES = {"f": "f8", "i": "i4", "u": "i4", "b": "i1"}  # by kind of NumPy
EXACT_INTEGERS = 2**53  # in doubles
MAX_INT32 = 2**31 - 1  # of 32-bit integers
DIGEST_ATTRIBUTE = "content_sha256"


@dataclass(frozen=True)
class Variable:
    """An array that is not empty, with names of its dimensions and descriptions.

    dimensions : a name for each, or the one of an array (n,)
    """

    values: NDArray[Any]
    dimensions: str | tuple[str, ...]
    attributes: Mapping[str, str] = field(default_factory=dict)


def write_netcdf(
    path: Path, attributes: Mapping[str, str], variables: Mapping[str, Variable]
) -> None:
    """Write texts and arrays. Raises InputError where the file cannot be written."""
    from scipy.io import netcdf_file

    out = io.BytesIO()
    # version 2 has 64-bit offsets
    with netcdf_file(out, "w", version=2) as file:
        for name, variable in variables.items():
            array = _storable_array(variable.values)
            names = variable.dimensions
            names = (names,) if isinstance(names, str) else names
            for dimension, size in zip(names, array.shape, strict=True):
                if dimension not in file.dimensions:
                    file.createDimension(dimension, size)
            target = file.createVariable(name, array.dtype, names)
            target[:] = array
            for key, text in {
                **variable.attributes,
                "numpy_type": variable.values.dtype.str,
            }.items():
                setattr(target, key, text.encode())
        for key, text in {
            **attributes,
            DIGEST_ATTRIBUTE: _digest(attributes, variables),
        }.items():
            setattr(file, key, text.encode())
        file.flush()
        content = out.getvalue()
    write_bytes(path, content)


def read_netcdf(path: Path) -> tuple[dict[str, str], dict[str, NDArray[Any]]]:
    """Texts and arrays of a file of `write_netcdf`.

    Raises InputError for a file that cannot be read, is none of these, or whose
    content is not what was written.
    """
    from scipy.io import netcdf_file

    content = read_content(path)
    with (
        refused_foreign_errors(path, "result that was saved"),
        netcdf_file(io.BytesIO(content), "r", mmap=False) as file,
    ):
        file_attributes = vars(file).items()
        texts = {k: v.decode() for k, v in file_attributes if isinstance(v, bytes)}
        arrays = {name: _restored_array(v) for name, v in file.variables.items()}
    digest = texts.pop(DIGEST_ATTRIBUTE, "")
    if digest != _digest(texts, {n: Variable(v, "") for n, v in arrays.items()}):
        raise InputError(f"{path}: is no result that was saved, or damaged")
    return texts, arrays


def _storable_array(values: NDArray[Any]) -> NDArray[Any]:
    """An array as the format can hold it, to the last bit."""
    kind = values.dtype.kind
    if kind not in STORED_TYPES:
        raise ValueError(f"arrays of {values.dtype} cannot be saved")
    largest = largest_integer(values)
    if largest > EXACT_INTEGERS:
        raise ValueError(f"integers up to {largest} cannot be saved")
    return values.astype("f8" if largest > MAX_INT32 else STORED_TYPES[kind])


def largest_integer(values: NDArray[Any]) -> int:
    """Largest size of the integers of an array, 0 of other numbers."""
    if values.dtype.kind not in "iu" or not values.size:
        return 0
    return max(abs(int(values.min())), abs(int(values.max())))


def _restored_array(variable: Any) -> NDArray[Any]:
    values = np.array(variable.data)
    return values.astype(np.dtype(variable.numpy_type.decode()))


def _digest(attributes: Mapping[str, str], variables: Mapping[str, Variable]) -> str:
    sha256 = hashlib.sha256()
    for key in sorted(attributes):
        sha256.update(f"{key}={attributes[key]}\0".encode())
    for name in sorted(variables):
        values = np.ascontiguousarray(variables[name].values)
        sha256.update(f"{name} {values.dtype.str} {values.shape}\0".encode())
        sha256.update(values.tobytes())
    return sha256.hexdigest()
