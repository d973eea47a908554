"""A group of an HDF5 file, or of a MAT file of version 7.3, as arrays and texts.

Names and shapes are read first: a small file may declare arrays that fill the memory,
and hold objects that are no tables. Only the arrays of the wanted group are read.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from fegear.files.errors import InputError, refused_foreign_errors

Part = dict[str, Any]  # arrays and texts by name
MAX_VALUES = 10_000_000  # of all arrays that are read
MAX_RECORDED_VALUES = 50_000_000  # the same of a recording


def read_group(
    content: bytes, names: Collection[str], path: str
) -> tuple[Part, Part | None]:
    """Texts at the top of a file, and the first group that has all names.

    Raises InputError, which names the file, where it is damaged or too large.
    """
    with _opened(content, path) as file:
        reader = _Reader(path)
        top = reader.part(file, has_numbers=False)
        for group in _named_groups(file):
            if all(name in group or name in group.attrs for name in names):
                return top, reader.part(group, has_numbers=True)
        return top, None


def read_ranked_group(
    content: bytes, rank: Callable[[Collection[str]], int], path: str
) -> Part | None:
    """The group of a file whose names rank highest, the first of equal ones.

    Its attributes that are single numbers are among its arrays. None where no group
    ranks above 0. Raises InputError as `read_group`.
    """
    with _opened(content, path) as file:
        chosen, highest = None, 0
        for group in _named_groups(file):
            if (rank_of_group := rank(_names_of_numbers(group))) > highest:
                chosen, highest = group, rank_of_group
        if chosen is None:
            return None
        reader = _Reader(path, MAX_RECORDED_VALUES)
        return _attribute_numbers(chosen) | reader.part(chosen, has_numbers=True)


@contextmanager
def _opened(content: bytes, path: str) -> Iterator[Any]:
    import h5py

    with (
        refused_foreign_errors(path, "HDF5 file"),
        h5py.File(io.BytesIO(content), "r") as file,
    ):
        yield file


def _names_of_numbers(group: Any) -> list[str]:
    """Names of the arrays of numbers in a group, and of its attributes."""
    import h5py

    arrays = [
        name
        for name, item in _group_members(group)
        if isinstance(item, h5py.Dataset)
        and item.shape
        and (dtype := _dtype_of(item)) is not None
        and dtype.kind in "fiu"
        and _matlab_class(item) not in (b"char", b"cell")
    ]
    return [*arrays, *group.attrs]


def _attribute_numbers(group: Any) -> Part:
    """Attributes that are single numbers."""
    numbers: Part = {}
    for name in group.attrs:
        attribute = group.attrs.get_id(name)
        dtype = _dtype_of(attribute)
        if dtype is not None and dtype.kind in "fiu" and attribute.shape in ((), (1,)):
            numbers[name] = np.asarray(group.attrs[name])
    return numbers


def _named_groups(file: Any) -> Iterator[Any]:
    """All groups once, a group before those in it; links may form a circle."""
    import h5py

    groups_to_read, visited = [file], set()
    while groups_to_read:
        group = groups_to_read.pop()
        address = h5py.h5o.get_info(group.id).addr
        if address not in visited:
            visited.add(address)
            yield group
            inner = [m for _, m in _group_members(group) if isinstance(m, h5py.Group)]
            groups_to_read.extend(reversed(inner))


def _group_members(group: Any) -> Iterator[tuple[str, Any]]:
    """Objects in a group, without those of other files and links that lead nowhere."""
    import h5py

    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.SoftLink):
            with suppress(KeyError, OSError, RuntimeError):
                yield name, group[name]
        elif not isinstance(link, h5py.ExternalLink):
            yield name, group[name]


class _Reader:
    """Reads arrays of a file until they have too many values together."""

    def __init__(self, path: str, max_values: int = MAX_VALUES) -> None:
        self.path = path
        self.max_values = max_values
        self.n_values = 0

    def part(self, group: Any, has_numbers: bool) -> Part:
        """Texts of a group, and its arrays of numbers where they are wanted."""
        import h5py

        part = _attribute_texts(group)
        for name, item in _group_members(group):
            if not isinstance(item, h5py.Dataset) or item.shape is None:
                continue
            kind, dtype = _matlab_class(item), _dtype_of(item)
            if dtype is None:
                continue
            if kind == b"char":
                part[name] = self.text(name, item)
            elif kind == b"cell" and name == "header":
                part[name] = self.cells(name, item)
            elif has_numbers and dtype.kind in "fiu":
                values = self.values(name, item)
                part[name] = values if kind is None else values.T
        return part

    def values(self, name: str, item: Any) -> Any:
        chunk = int(np.prod(item.chunks or (0,), dtype=object))
        self.n_values += max(item.size, chunk)
        if self.n_values > self.max_values:
            raise InputError(
                f"{self.path}: {name} has shape {item.shape}, in pieces of {chunk}; "
                f"{self.max_values} values are allowed in all"
            )
        return np.asarray(item[()])

    def text(self, name: str, item: Any) -> str:
        if "MATLAB_empty" in item.attrs or item.dtype.kind != "u":
            return ""
        codes = self.values(name, item).ravel().astype("<u2")
        return codes.tobytes().decode("utf-16-le", "replace")

    def cells(self, name: str, item: Any) -> Any:
        """Texts and numbers in cells, which are stored by columns as references."""
        import h5py

        references = self.values(name, item).T
        cells = np.empty(references.shape, dtype=object)
        for index in np.ndindex(cells.shape):
            inner = item.file[references[index]] if references[index] else None
            if isinstance(inner, h5py.Dataset) and inner.shape is not None:
                is_text = _matlab_class(inner) == b"char"
                read = self.text if is_text else self.values
                cells[index] = read(name, inner)
        return cells


def _attribute_texts(group: Any) -> Part:
    """Attributes that are texts; others may be large or of types without a reader."""
    import h5py

    texts: Part = {}
    for name in group.attrs:
        attribute = group.attrs.get_id(name)
        dtype = _dtype_of(attribute)
        if attribute.shape == () and dtype and h5py.check_string_dtype(dtype):
            value = group.attrs[name]
            texts |= {name: value} if isinstance(value, str) else {}
    return texts


def _matlab_class(item: Any) -> bytes | None:
    kind = item.attrs.get("MATLAB_class")
    return bytes(kind) if isinstance(kind, bytes) else None


def _dtype_of(item: Any) -> Any:
    """Type of an array or attribute, None of those that NumPy does not have."""
    try:
        return item.dtype
    except TypeError:
        return None
