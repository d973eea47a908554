"""Single figures of a gear set file, changed by name before it is read.

`mesh.2.tip_relief.magnitude_um`, `gear.idler.inertia_kg_m2`, `dynamics.damping_ratio`:
tables of a list are named by number, counted from 1, or gears by their name.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from fegear.files.errors import InputError
from fegear.gearset.problems import known_keys, nearest

LISTS = ("gear", "mesh", "shaft")
# keys that say the same thing: the one that is set replaces the others
ALTERNATIVES = (
    {"length_pitches", "start_roll_angle_deg", "start"},
    {"center_distance_mm", "operating_pressure_angle_deg"},
    {"tip_radius_mm", "addendum_mm"},
    {"file", "roll_angle_deg"},
    {"file", "diameter_mm"},
    {"file", "deviation_um"},
    {"roll_angle_deg", "diameter_mm"},
)
DEFAULT_START = {"tip_relief": "HPSTC", "root_relief": "LPSTC"}


def edited(tables: Mapping[str, Any], edits: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a TOML file with some values set; the originals stay.

    A relief that is not there yet begins at the HPSTC or LPSTC unless its start is
    set as well; a relief magnitude of 0 takes the relief away. Raises InputError for
    a name that leads nowhere.
    """
    copy: dict[str, Any] = {key: _python_value(value) for key, value in tables.items()}
    for name, value in edits.items():
        _set(copy, name, _python_value(value))
    for mesh in _tables_of(copy, "mesh"):
        _settle_reliefs(mesh)
    return copy


def _python_value(value: Any) -> Any:
    """A copy with numbers of NumPy as those of Python."""
    if isinstance(value, Mapping):
        return {key: _python_value(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_python_value(entry) for entry in value]
    return value.item() if getattr(value, "ndim", None) == 0 else deepcopy(value)


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
        raise InputError(f"{name}: which {path[0]}? such as {path[0]}.1")
    inner = path[2:] if path[0] in LISTS else path[1:]
    place: list[str] = []
    for step in [path[0], *inner, key]:
        keys = known_keys(place)
        if step not in keys:
            raise InputError(f"{name}: unknown key {step}{nearest(step, keys)}")
        place.append(step)


def _set(tables: dict[str, Any], name: str, value: Any) -> None:
    require_known_key(name)
    *path, key = name.split(".")
    table = _table(tables, path, name)
    for group in ALTERNATIVES:
        if key in group:
            for other in group - {key}:
                table.pop(other, None)
    table[key] = value


def _table(tables: dict[str, Any], path: list[str], name: str) -> dict[str, Any]:
    """The table that a path leads to; tables within it are made where missing."""
    inner = path
    table: Any = tables
    if path[0] in LISTS:
        table, inner = _entry(tables, path[0], path[1], name), path[2:]
    for step in inner:
        table = table.setdefault(step, {})
        if not isinstance(table, dict):
            raise InputError(f"{name}: {step} is a value, no table")
    return table


def _entry(tables: dict[str, Any], kind: str, which: str, name: str) -> dict[str, Any]:
    entries = _tables_of(tables, kind)
    numbered = [entry for i, entry in enumerate(entries, 1) if which == str(i)]
    for entry in (*numbered, *(e for e in entries if e.get("name") == which)):
        return entry
    names = [str(entry.get("name", i)) for i, entry in enumerate(entries, 1)]
    hint = f" (known: {', '.join(names)})" if names else ""
    raise InputError(f"{name}: no {kind} {which}{hint}")


def _tables_of(tables: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    """The tables of a list such as [[mesh]]; what is none is refused later."""
    entries = tables.get(kind)
    listed = entries if isinstance(entries, list) else []
    return [entry for entry in listed if isinstance(entry, dict)]


def _settle_reliefs(mesh: dict[str, Any]) -> None:
    for place, start in DEFAULT_START.items():
        for key in (place, f"driver_{place}", f"driven_{place}"):
            relief = mesh.get(key)
            if not isinstance(relief, dict):
                continue
            if relief.get("magnitude_um") == 0:
                del mesh[key]
            elif not ALTERNATIVES[0] & relief.keys():
                relief["start"] = start
