"""Data sets of arrays in groups, with units, as HDF5, NetCDF and MAT files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.matlab import matlab_column, matlab_names, write_matlab
from fegear.files.netcdf import Variable, write_netcdf
from fegear.files.output import HDF5, write_whole

DATA_SETS = (HDF5, ".nc", ".mat")  # endings of names


@dataclass(frozen=True)
class DataArray:
    """An array of numbers, truth values or, in one dimension, texts.

    dimensions : names, one for each; attributes : such as units and long_name
    """

    values: NDArray[Any]
    dimensions: tuple[str, ...]
    attributes: Mapping[str, str] = field(default_factory=dict)


Groups = Mapping[str, Mapping[str, DataArray]]


def write_data_set(path: Path, attributes: Mapping[str, str], groups: Groups) -> None:
    """Write groups of arrays by the ending of the path; InputError if that fails.

    NetCDF has `group_name` for arrays of groups, with underscores for letters of other
    alphabets, and no texts.
    """
    WRITERS[path.suffix.lower()](path, attributes, groups)


def _write_hdf5(path: Path, attributes: Mapping[str, str], groups: Groups) -> None:
    write_whole(path, lambda beside: _fill_hdf5(beside, attributes, groups))


def _fill_hdf5(path: Path, attributes: Mapping[str, str], groups: Groups) -> None:
    import h5py

    # the file has a lock of this process, see `write_whole`
    with h5py.File(path, "w", locking=False) as file:
        file.attrs.update(attributes)
        for group, arrays in groups.items():
            target = file.create_group(group)
            for name, array in arrays.items():
                values: Any = array.values
                if array.values.dtype.kind == "U":
                    values = values.astype(h5py.string_dtype())
                entry = target.create_dataset(name.replace("/", "_"), data=values)
                entry.attrs.update(array.attributes)
                for number, dimension in enumerate(array.dimensions):
                    entry.dims[number].label = dimension


def _write_netcdf(path: Path, attributes: Mapping[str, str], groups: Groups) -> None:
    variables = {}
    for group, arrays in groups.items():
        identifiers = matlab_names(arrays)
        for name, array in arrays.items():
            if array.values.dtype.kind != "U":
                called = name if name.isascii() else identifiers[name]
                described = array.dimensions, array.attributes
                variables[f"{group}_{called}"] = Variable(array.values, *described)
    write_netcdf(path, attributes, variables)


def _write_matlab(path: Path, attributes: Mapping[str, str], groups: Groups) -> None:
    """A struct of matrices for each group, and one of the units."""
    variables: dict[str, Any] = {}
    units: dict[str, Any] = {}
    for group, arrays in groups.items():
        names = matlab_names(arrays)
        variables[group] = {
            names[name]: matlab_column(np.asarray(array.values))
            if array.values.ndim == 1
            else array.values
            for name, array in arrays.items()
        }
        units[group] = {
            names[name]: array.attributes.get("units", "1")
            for name, array in arrays.items()
        }
    about = {matlab_names([key])[key]: text for key, text in attributes.items()}
    write_matlab(path, {**variables, "units": units, "about": about})


Writer = Callable[[Path, Mapping[str, str], Groups], None]
WRITERS: Mapping[str, Writer] = {
    HDF5: _write_hdf5,
    ".nc": _write_netcdf,
    ".mat": _write_matlab,
}
