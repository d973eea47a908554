"""Gear sets from TOML text, files and the built-in collection."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from importlib import resources
from importlib.resources.abc import Traversable
from os import PathLike, fspath
from os.path import exists
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fegear.files.errors import InputError, nearest
from fegear.files.kinds import KIND_OF_ENDING, kind_of_text, require_kind
from fegear.files.output import read_text
from fegear.gearset.build import build_gear_set
from fegear.gearset.edit import edited
from fegear.gearset.model import GearSet, Origin
from fegear.gearset.problems import first_problem
from fegear.gearset.refusals import Refusal
from fegear.gearset.schema import Document, with_defaults
from lumped.common.checks import check_arguments

LIMIT_NAMES = "le", "ge"  # names of limits in what pydantic says of an error
# keys of a mesh whose tables may name a file
MEASURED_KEYS = (
    *("profile", "driver_profile", "driven_profile"),
    *("driver_topography", "driven_topography"),
)


@check_arguments
def load_gear_set(
    name_or_path: str | PathLike[str], edits: Mapping[str, Any] | None = None
) -> GearSet:
    """A built-in gear set by its name, or the one in a TOML file.

    Parameters
    ----------
    name_or_path : str or path-like
        Name of a built-in gear set, see `builtin_names`, or path of a gear-set file.
    edits : mapping of str, optional
        Values to set before the gear set is read, by key, such as
        ``{"mesh.1.tip_relief.magnitude_um": 10}``; units are those of the file.

    Returns
    -------
    GearSet
        The gear set in SI units, checked.

    Raises
    ------
    InputError
        If there is no such gear set or file, or its content or a key cannot be used.

    Examples
    --------
    >>> import fegear
    >>> fegear.load_gear_set("liu-pair").name
    'liu-pair'
    """
    name, changes = fspath(name_or_path), dict(edits or {})
    text, source = _text_and_source(name)
    gear_set = _make_gear_set_from_text(text, source, changes, _folder_of(name))
    return replace(gear_set, origin=Origin(name=name, edits=changes))


def load_tables(name_or_path: str, edits: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a gear set with some values set, as in its file.

    Paths of files that it names are absolute, for the tables may be written to
    another folder.
    """
    text, source_name = _text_and_source(name_or_path)
    try:
        tables = edited(parsed_toml(text), edits)
    except InputError as error:
        raise InputError(f"{source_name}: {error}") from None
    folder = _folder_of(name_or_path)
    return _with_changed_paths(tables, lambda file: os.path.abspath(folder / file))


def files_of_gear_set(name_or_path: str, edits: Mapping[str, Any]) -> list[str]:
    """Paths of the files that a gear set names, with some values set."""
    tables = load_tables(name_or_path, edits)
    return [table["file"] for table in _tables_with_file(tables)]


def relative_tables(tables: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Tables for a gear-set file at a path: files beside or below it by relative paths.

    The folder can then be moved. Other files keep their absolute paths.
    """
    folder = Path(os.path.abspath(path)).parent

    def relative(file: str) -> str:
        is_below = Path(file).is_relative_to(folder)
        return Path(file).relative_to(folder).as_posix() if is_below else file

    return _with_changed_paths(deepcopy(dict(tables)), relative)


def _with_changed_paths(
    tables: dict[str, Any], change_path: Callable[[str], str]
) -> dict[str, Any]:
    """Change the names of the files that tables name."""
    for table in _tables_with_file(tables):
        table["file"] = change_path(table["file"])
    return tables


def _tables_with_file(tables: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Profiles, topographies and a housing with a file, also where none is checked."""
    meshes = tables.get("mesh")
    candidates = [
        mesh.get(key)
        for mesh in (meshes if isinstance(meshes, list) else ())
        for key in (MEASURED_KEYS if isinstance(mesh, dict) else ())
    ]
    for table in (*candidates, tables.get("housing")):
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            yield table


def _folder_of(name: str) -> Path:
    """Folder in which the files lie that a gear set names."""
    return Path() if name in builtin_names() else Path(name).parent


def _text_and_source(name: str) -> tuple[str, str]:
    """Text of a built-in gear set or of a file, and the name of its source."""
    if name in builtin_names():
        return (_builtin_folder() / f"{name}.toml").read_text("utf-8"), name
    path = path_of(name, "gear set", builtin_names())
    return read_text(path), str(path)


def path_of(name_or_path: str, kind: str, names: Sequence[str]) -> Path:
    """The path of a TOML file; InputError where a name was meant that is not known.

    names : of what is built in, such as gear sets
    """
    if not name_or_path:
        raise InputError(f"no name of a {kind} (built-in: {', '.join(names)})")
    path = Path(name_or_path)
    if path.suffix != ".toml" and path.name == name_or_path and not exists(path):
        raise InputError(
            f"{name_or_path}: neither a file nor a built-in {kind}"
            f"{nearest(name_or_path, names)} (built-in: {', '.join(names)})"
        )
    if other_kind := KIND_OF_ENDING.get(path.suffix.lower()):
        raise InputError(f"{path}: seems to be {other_kind}; a {kind} file is TOML")
    return path


def read_gear_set_file(path: Path, edits: Mapping[str, Any] | None = None) -> GearSet:
    """The gear set in a TOML file; raises InputError naming the file."""
    return _make_gear_set_from_text(read_text(path), str(path), edits, path.parent)


@check_arguments
def read_gear_set(
    text: str, source: str = "gear set", edits: Mapping[str, Any] | None = None
) -> GearSet:
    """The gear set in TOML text.

    Parameters
    ----------
    text : str
        Content of a gear-set file.
    source : str, optional
        Where the text comes from; messages of errors begin with it.
    edits : mapping of str, optional
        Values to set before the gear set is read, by key, as in `load_gear_set`.

    Returns
    -------
    GearSet
        The gear set in SI units, checked.

    Raises
    ------
    InputError
        If the text is not TOML, or its content or a key cannot be used.
    """
    return _make_gear_set_from_text(text, source, edits, Path())


def _make_gear_set_from_text(
    text: str, source: str, edits: Mapping[str, Any] | None, folder: Path
) -> GearSet:
    """The gear set in TOML text; files that it names lie in the folder."""
    try:
        return _make_gear_set_from_tables(parsed_toml(text), edits or {}, folder)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


@check_arguments
def make_gear_set(
    tables: Mapping[str, Any], edits: Mapping[str, Any] | None = None
) -> GearSet:
    """The gear set of tables with the keys of a gear-set file.

    Parameters
    ----------
    tables : mapping of str
        Tables of a gear-set file, as `tomllib` reads them, in the units of the keys.
    edits : mapping of str, optional
        Values to set before the gear set is made, by key, as in `load_gear_set`.

    Returns
    -------
    GearSet
        The gear set in SI units, checked.

    Raises
    ------
    InputError
        If a table or a key cannot be used.
    """
    return _make_gear_set_from_tables(tables, edits or {}, Path())


def parsed_toml(text: str) -> dict[str, Any]:
    """The tables of TOML text; InputError with the line that is wrong."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("TOML syntax: nested too deeply") from None
    except ValueError as error:  # of TOML, or an integer of thousands of digits
        if other_kind := kind_of_text(text):
            raise InputError(f"not TOML: seems to be {other_kind}") from None
        line_number = re.search(r"at line (\d+)", str(error))
        line = text.splitlines()[int(line_number[1]) - 1].strip() if line_number else ""
        quoted = f": {line[:60]}" if line else ""
        raise InputError(f"TOML syntax: {error}{quoted}") from None


def builtin_names() -> list[str]:
    """Names of the gear sets that come with the program, sorted.

    Returns
    -------
    list of str
        Names that `load_gear_set` takes.
    """
    files = (Path(item.name) for item in _builtin_folder().iterdir())
    return sorted(file.stem for file in files if file.suffix == ".toml")


def _builtin_folder() -> Traversable:
    return resources.files("fegear.gearset") / "sets"


def _make_gear_set_from_tables(
    raw_tables: Mapping[str, Any], edits: Mapping[str, Any], folder: Path
) -> GearSet:
    require_kind(raw_tables, "gear-set")
    tables = with_defaults(edited(raw_tables, edits))
    try:
        document = Document.model_validate(tables)
    except ValidationError as error:
        raise InputError(_first_refusal(error, tables, folder)) from None
    return build_gear_set(document, folder)


def _first_refusal(
    error: ValidationError, tables: Mapping[str, Any], folder: Path
) -> str:
    """The first problem; of a value beyond a limit with one that all rules allow."""
    problem, details = first_problem(error, tables), error.errors(include_url=False)
    limit = next(
        (details[0]["ctx"][k] for k in LIMIT_NAMES if k in details[0].get("ctx", {})),
        None,
    )
    if limit is None:
        return problem
    key_path, changed_tables = details[0]["loc"], deepcopy(dict(tables))
    table: Any = changed_tables
    for step in key_path[:-1]:
        table = table[step]
    table[key_path[-1]] = limit
    try:
        build_gear_set(Document.model_validate(changed_tables), folder)
    except Refusal as refusal:
        if refusal.key.parts == key_path[2:]:
            stated_value = problem.partition("; ")[0]
            return f"{stated_value}; {refusal.bound.stated(refusal.unit)}"
    except (InputError, ValidationError):
        pass  # of other keys
    return problem
