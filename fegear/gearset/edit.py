"""Single figures of a gear set file, changed by name before it is read.

`mesh.2.tip_relief.magnitude_um`, `gear.idler.inertia_kg_m2`, `dynamics.damping_ratio`:
tables of a list are named by number, counted from 1, or gears by their name. So are
the faults of a gear, `gear.idler.cracks.1.depth_mm`.
"""

from __future__ import annotations

import re
import tomllib
from collections import deque
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

from fegear.files.errors import InputError
from fegear.gearset.planetary.expansion import MESH_SIDES, expanded
from fegear.gearset.problems import known_keys, lists_tables, nearest_key
from fegear.gearset.schema import START_KEYS, replaced_keys

LISTS = ("gear", "mesh", "shaft", "planetary")
# sizes of faults, which are not there at 0
FAULT_SIZES = {
    "cracks": "depth_mm",
    "broken_tips": "height_mm",
    "spalls": "width_share",
}
DEFAULT_START = {"tip_relief": "HPSTC", "root_relief": "LPSTC"}


def edited(tables: Mapping[str, Any], edits: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a TOML file with some values set; the originals stay.

    A relief that is not there yet begins at the HPSTC or LPSTC unless its start is
    set as well; a relief magnitude of 0 takes the relief away, as a size of 0 does a
    crack, a broken tip or a spall; a lead modification without sizes is none.
    A planetary set is expanded; what is set in tables
    that the file has, such as those of its planet, is set before, the rest in gears and
    meshes of single planets. Raises InputError for a name that leads nowhere.
    """
    edited_tables: dict[str, Any] = {
        key: _python_value(value, key) for key, value in tables.items()
    }
    names = sorted(edits, key=_is_single_value)
    if "planetary" in edited_tables:
        names_in_file = [name for name in names if _is_in_file(edited_tables, name)]
        _set_all(edited_tables, {name: edits[name] for name in names_in_file})
        edited_tables = expanded(edited_tables)
        names = [name for name in names if name not in names_in_file]
    _set_all(edited_tables, {name: edits[name] for name in names})
    return edited_tables


def with_values(tables: Mapping[str, Any], edits: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a file without lists, with values set by `table.key`.

    Whether there is such a key is for the file's schema to say.
    """
    changed = dict(tables)
    for name, value in edits.items():
        table, _, key = name.partition(".")
        changed[table] = {**changed.get(table, {}), key: value}
    return changed


def _set_all(tables: dict[str, Any], edits: Mapping[str, Any]) -> None:
    """Set values in order, then complete reliefs and take away what has no size."""
    for name, value in edits.items():
        _set_value(tables, name, _python_value(value, name))
    for mesh in _tables_of(tables, "mesh"):
        _complete_reliefs(mesh)
        _complete_leads(mesh)
    for gear in _tables_of(tables, "gear"):
        _remove_faults_of_no_size(gear)
    for planetary in _tables_of(tables, "planetary"):
        for side in map(planetary.get, MESH_SIDES):
            if isinstance(side, dict):
                _complete_reliefs(side)
                _complete_leads(side)


def _is_in_file(tables: dict[str, Any], name: str) -> bool:
    """Whether a name leads to a table of no list or to an entry of one."""
    require_known_key(name)
    kind, *path = name.split(".")
    return kind not in LISTS or find_entry(tables, kind, path[0]) is not None


def _is_single_value(name: str) -> bool:
    """Materials come first: they replace values, which may be set as well."""
    return not name.endswith(".material")


def _python_value(value: Any, name: str) -> Any:
    """A copy with numbers of NumPy as those of Python; InputError for a masked one."""
    if isinstance(value, Mapping):
        return {
            key: _python_value(entry, f"{name}.{key}") for key, entry in value.items()
        }
    if isinstance(value, list | tuple):
        return [
            _python_value(entry, f"{name} entry {number}")
            for number, entry in enumerate(value, 1)
        ]
    if getattr(value, "ndim", None) != 0:
        return deepcopy(value)
    if getattr(value, "mask", False):  # its item would be 0
        raise InputError(f"{name} = masked; must be a number")
    return value.item()


def parsed_value(text: str) -> Any:
    """A value as TOML would read it; a bare word is a string."""
    try:
        tables = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return tables["value"] if len(tables) == 1 else text


def require_known_key(name: str) -> None:
    """Raises InputError for a name that no gear set file could have."""
    *path, key = name.split(".")
    if not path or not key:
        raise InputError(f"{name}: must name a table and a key, such as mesh.1.phase")
    if path[0] in LISTS and len(path) < 2:
        if key.isdecimal():
            raise InputError(f"{name}: which key? such as {name}.{known_keys(path)[0]}")
        raise InputError(f"{name}: which {path[0]}? such as {path[0]}.1")
    inner_path = path[2:] if path[0] in LISTS else path[1:]
    key_path: list[str] = []
    remaining_keys = deque([path[0], *inner_path, key])
    while remaining_keys:
        step = remaining_keys.popleft()
        keys = known_keys(key_path)
        if step not in keys:
            raise InputError(f"{name}: unknown key {step}{nearest_key(step, keys)}")
        key_path.append(step)
        if len(key_path) > 1 and remaining_keys and lists_tables(key_path):
            _require_number(remaining_keys.popleft(), name, key_path)
            if not remaining_keys:
                known_inner_keys = known_keys(key_path)
                raise InputError(
                    f"{name}: which key? such as {name}.{known_inner_keys[0]}"
                )


def _require_number(text: str, name: str, key_path: Sequence[str]) -> None:
    """Require the number of a table in a list that is not at the top."""
    if not re.fullmatch("[1-9][0-9]{0,5}", text):
        path = name.partition(f".{key_path[-1]}.")[0]
        raise InputError(
            f"{name}: which of {key_path[-1]}? such as {path}.{key_path[-1]}.1.KEY"
        )


def _set_value(tables: dict[str, Any], name: str, value: Any) -> None:
    require_known_key(name)
    *path, key = name.split(".")
    table = _find_or_make_table(tables, path, name)
    for other in replaced_keys(key):
        table.pop(other, None)
    table[key] = value


def _find_or_make_table(
    tables: dict[str, Any], path: list[str], name: str
) -> dict[str, Any]:
    """The table that a path leads to; tables within it are made where missing."""
    inner_path = path
    table: Any = tables
    if path[0] in LISTS:
        table, inner_path = _require_entry(tables, path[0], path[1], name), path[2:]
    key_path = [path[0]]
    for step in inner_path:
        if isinstance(table, list):
            table = _numbered_table(table, int(step), name)
        else:
            key_path.append(step)
            table = table.setdefault(step, [] if lists_tables(key_path) else {})
        if not isinstance(table, dict | list):
            raise InputError(f"{name}: {step} is a value, no table")
    if isinstance(table, list):
        raise InputError(f"{name}: {key_path[-1]} is a list, no table")
    return table


def _numbered_table(entries: list[Any], number: int, name: str) -> Any:
    """A table of a list by its number from 1; the next one is made."""
    if number > len(entries) + 1:
        raise InputError(
            f"{name}: there are {len(entries)} of them; {len(entries) + 1} is the next"
        )
    if number == len(entries) + 1:
        entries.append({})
    return entries[number - 1]


def _require_entry(
    tables: dict[str, Any], kind: str, number_or_name: str, name: str
) -> dict[str, Any]:
    entry = find_entry(tables, kind, number_or_name)
    if entry is not None:
        return entry
    entries = _tables_of(tables, kind)
    names = [str(entry.get("name", i)) for i, entry in enumerate(entries, 1)]
    hint = f" (known: {', '.join(names)})" if names else ""
    raise InputError(f"{name}: no {kind} {number_or_name}{hint}")


def find_entry(
    tables: Mapping[str, Any], kind: str, number_or_name: str
) -> dict[str, Any] | None:
    """An entry of a list by its number or name, None if there is none."""
    entries = _tables_of(tables, kind)
    entries_of_number = [
        entry for i, entry in enumerate(entries, 1) if number_or_name == str(i)
    ]
    entries_of_name = [
        entry for entry in entries if entry.get("name") == number_or_name
    ]
    return next(iter(entries_of_number + entries_of_name), None)


def _tables_of(tables: Mapping[str, Any], kind: str) -> list[dict[str, Any]]:
    """The tables of a list such as [[mesh]]; what is none is refused later."""
    entries = tables.get(kind)
    listed_entries = entries if isinstance(entries, list) else []
    return [entry for entry in listed_entries if isinstance(entry, dict)]


def _complete_reliefs(mesh: dict[str, Any]) -> None:
    for relief_key, start in DEFAULT_START.items():
        for key in (relief_key, f"driver_{relief_key}", f"driven_{relief_key}"):
            relief = mesh.get(key)
            if not isinstance(relief, dict):
                continue
            if relief.get("magnitude_um") == 0:
                del mesh[key]
            elif not relief.keys() & set(START_KEYS):
                relief["start"] = start


def _complete_leads(mesh: dict[str, Any]) -> None:
    """Take away an end relief of no size with its length, and leads of no size."""
    for key in ("lead", "driver_lead", "driven_lead"):
        lead = mesh.get(key)
        if not isinstance(lead, dict):
            continue
        if _is_zero(lead.get("end_relief_um")):
            lead.pop("end_relief_length_mm", None)
        if lead and all(map(_is_zero, lead.values())):
            del mesh[key]


def _remove_faults_of_no_size(gear: dict[str, Any]) -> None:
    for key, size in FAULT_SIZES.items():
        if isinstance(entries := gear.get(key), list):
            gear[key] = [
                entry
                for entry in entries
                if not (isinstance(entry, dict) and _is_zero(entry.get(size)))
            ]


def _is_zero(value: Any) -> bool:
    return value == 0 and not isinstance(value, bool)
