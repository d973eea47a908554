"""Results as files: saved, loaded where their study cannot be run, and shown the same.

A file holds what a result is made of, and what its study said of it: summary, tables
and the lines of its page. Tables are variables with the names of their columns, for
`xarray.open_dataset`; all other arrays are in one variable for each type of numbers.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fegear.boundary import public
from fegear.files.errors import InputError
from fegear.files.netcdf import Variable, read_netcdf, write_netcdf
from fegear.files.output import path_of
from fegear.files.values import PACKAGES, Decoder, Encoder, class_of, name_of_class
from fegear.files.version import package_version
from fegear.result import Result
from fegear.studies.columns import MAIN, meaning_and_unit
from fegear.studies.page import ColumnTable, Page, RowTable
from fegear.studies.registry import commands, packages
from fegear.studies.table import Table, Tabled, tables_of

FORMAT = "fegear result 4"


@dataclass(frozen=True, eq=False)
class Shown:
    """Summary, tables and page of a result, as its study made them."""

    summary: Mapping[str, Any]
    tables: Mapping[str, Table]
    page: Sequence[str | RowTable | ColumnTable]


class Saved(Tabled, Protocol):
    """What a file has of a result besides its fields."""

    @property
    def summary(self) -> Mapping[str, Any]: ...

    def page(self) -> Page: ...


class Loaded:
    """Base of results that are loaded: they show what was saved."""

    _shown: Shown

    @property
    def summary(self) -> Mapping[str, Any]:
        return self._shown.summary

    @property
    def table(self) -> Table:
        if MAIN not in self._shown.tables:
            raise InputError("this result has no table")
        return self._shown.tables[MAIN]

    @property
    def more_tables(self) -> Mapping[str, Table]:
        tables = self._shown.tables.items()
        return {name: table for name, table in tables if name != MAIN}

    def page(self) -> Page:
        yield from self._shown.page


def save(result: Saved, path: str | Path) -> None:
    """Write a result, `.nc`; see `load`."""
    target = path_of(path)
    if target.suffix.lower() != ".nc":
        raise InputError(f"{target}: the name of a saved result ends with .nc")
    instance: Any = result
    encoder, variables = Encoder(_packages()), dict[str, Variable]()
    command = result.study.command
    try:
        tree = {
            "class": name_of_class(_class_of_result(result), _packages()),
            "fields": {
                f.name: encoder.plain(getattr(result, f.name)) for f in fields(instance)
            },
            "summary": encoder.plain(dict(result.summary)),
            "page": [encoder.plain(_plain_part(part)) for part in result.page()],
            "tables": {
                name: _plain_table(command, name, table, encoder, variables)
                for name, table in tables_of(result)
            },
            "shared": encoder.shared,
            "arrays": [[array.dtype.str, array.size] for array in encoder.arrays],
        }
    except ValueError as error:
        raise InputError(f"{target}: a value of {error} cannot be saved") from None
    variables |= _joined_by_type(encoder.arrays)
    attributes = {
        "format": FORMAT,
        "made_with": f"fegear {package_version()}",
        "command": command,
        **_header_lines(result),
        "result": json.dumps(tree, allow_nan=False),
    }
    write_netcdf(target, attributes, variables)


@public
def load(path: str | Path) -> Any:
    """The result in a file of `save`: it shows, tabulates and draws the same.

    Nothing is computed anew, and no other file is read.

    Parameters
    ----------
    path : str or Path
        File that the method `save` of a result has written, ``.nc``.

    Returns
    -------
    StudyResult
        The result, with the attributes and methods of the one that was saved.

    Raises
    ------
    InputError
        If the file cannot be read, holds no result, is damaged, or was saved by a
        version whose results differ.
    """
    target = path_of(path)
    attributes, variables = read_netcdf(target)
    if attributes.get("format") != FORMAT:
        raise InputError(f"{target}: is no result that was saved")
    command = attributes.get("command", "")
    if command not in commands():
        raise InputError(f"{target}: is a result of fegear {command}, which is missing")
    try:
        tree = json.loads(attributes["result"])
        arrays = list(_split_arrays(tree["arrays"], variables))
        decoder = Decoder(arrays, tree["shared"], _packages())
        return _restored_result(tree, decoder, variables)
    except Exception:  # a file may hold any tree, and its digest any content
        program_version = attributes.get("made_with", "another version")
        raise InputError(
            f"{target}: was saved by {program_version}, whose results "
            f"fegear {package_version()} cannot load"
        ) from None


def _joined_by_type(arrays: Sequence[NDArray[Any]]) -> dict[str, Variable]:
    """One variable for all arrays of a type: thousands of them are slow to open."""
    by_type: dict[str, list[NDArray[Any]]] = {}
    for array in arrays:
        by_type.setdefault(array.dtype.str, []).append(array)
    return {
        f"parts_{number}": Variable(np.concatenate(members), f"parts_{number}_size")
        for number, members in enumerate(by_type.values())
    }


def _split_arrays(
    places: Sequence[tuple[str, int]], variables: Mapping[str, NDArray[Any]]
) -> Iterator[NDArray[Any]]:
    """Arrays (n,) of `_joined_by_type` in order, from the type and the size of each."""
    kinds = {kind: number for number, kind in enumerate(dict(places))}
    starts = dict.fromkeys(kinds, 0)
    for kind, size in places:
        start = starts[kind]
        yield variables[f"parts_{kinds[kind]}"][start : start + size]
        starts[kind] = start + size


def _restored_result(tree: Any, decoder: Decoder, variables: Mapping[str, Any]) -> Any:
    kind = class_of(tree["class"], _packages())
    if not (issubclass(kind, Result) and hasattr(kind, "page")):
        raise ValueError(f"{kind.__name__} is no result")
    names = {"__module__": kind.__module__, "__qualname__": kind.__qualname__}
    result: Any = object.__new__(type(kind.__name__, (Loaded, kind), names))
    for name, part in tree["fields"].items():
        result.__dict__[name] = decoder.value(part)
    shown = Shown(
        summary=decoder.value(tree["summary"]),
        tables={
            name: _restored_table(part, decoder, variables)
            for name, part in tree["tables"].items()
        },
        page=[_restored_part(decoder.value(part)) for part in tree["page"]],
    )
    object.__setattr__(result, "_shown", shown)
    return result


def _packages() -> frozenset[str]:
    """Packages of this program and of all studies."""
    return PACKAGES | packages()


def _class_of_result(result: Saved) -> type:
    kind = type(result)
    return kind.__mro__[2] if isinstance(result, Loaded) else kind


def _header_lines(result: Tabled) -> dict[str, str]:
    """The header of the table as in CSV, for other programs; none without a table."""
    with suppress(InputError):
        entries = result.table.header.items()
        return {"header": "\n".join(f"{key}: {text}" for key, text in entries)}
    return {}


def _plain_table(
    command: str,
    name: str,
    table: Table,
    encoder: Encoder,
    variables: dict[str, Variable],
) -> dict[str, Any]:
    """Columns of numbers become variables, others plain items."""
    rows = [tuple(row) for row in table.rows()]
    columns: dict[str, Any] = {}
    for number, key in enumerate(table.names):
        cells = [row[number] for row in rows]
        kinds = set(map(type, cells))
        if kinds in ({float}, {int}):
            variable_name = key if name == MAIN else f"{name}.{key}"
            dimension = "row" if name == MAIN else f"{name}_row"
            attributes = _attributes(command, name, key, table.header)
            variables[variable_name] = Variable(np.array(cells), dimension, attributes)
            columns[key] = {"variable": variable_name}
        else:
            columns[key] = {"items": encoder.plain(cells)}
    return {"columns": columns, "header": encoder.plain(dict(table.header))}


def _attributes(
    command: str, table: str, key: str, header: Mapping[str, str]
) -> dict[str, str]:
    """Meaning and unit of a column by the conventions CF, which name no unit 1."""
    meaning, unit = meaning_and_unit(command, key, table, header)
    attributes = {"long_name": meaning} if meaning else {}
    return attributes | {"units": unit or "1"}


def _restored_table(
    plain: Any, decoder: Decoder, variables: Mapping[str, Any]
) -> Table:
    columns = {
        key: variables[part["variable"]].tolist()
        if "variable" in part
        else decoder.value(part["items"])
        for key, part in plain["columns"].items()
    }
    rows = list(zip(*columns.values(), strict=True))
    return Table(tuple(columns), lambda: rows, decoder.value(plain["header"]))


def _plain_part(part: str | RowTable | ColumnTable) -> Any:
    """A part of a page as texts."""
    if not isinstance(part, RowTable):
        return part if isinstance(part, str) else vars(part)
    cells = list(part.cells())
    texts = part.text_columns
    return {
        "cells": cells,
        "names": list(part.columns),
        "title": part.title,
        "text_columns": None if texts is None else list(texts),
        "whole": part.whole,
    }


def _restored_part(plain: Any) -> str | RowTable | ColumnTable:
    if isinstance(plain, str):
        return plain
    if "cells" not in plain:
        return ColumnTable(**plain)
    names = plain.pop("names")
    rows = [dict(zip(names, cells, strict=True)) for cells in plain.pop("cells")]
    return RowTable(rows, {name: itemgetter(name) for name in names}, **plain)
