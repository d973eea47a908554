"""From [[planetary]] to the [[gear]] and [[mesh]] tables of its planets.

This is done before keys are checked, so that what follows knows gears and meshes only.
Tables that are expanded already stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from fegear.files.errors import InputError
from fegear.gearset.planetary.members import sun_drives
from fegear.gearset.rack_keys import MODULE_KEYS, restated
from fegear.gearset.schema import PlanetaryEntry, with_defaults

MESH_SIDES = ("sun_mesh", "ring_mesh")
POSITION_TOLERANCE = 1e-4  # pitches of the planet, within which a position is rounded
SHIFT_KEYS = ("profile_shift", "span_mm", "pin_dimension_mm")


def unexpanded(tables: dict[str, Any]) -> PlanetaryEntry | None:
    """The planetary set of tables that are not expanded yet, None if there is none.

    None also where its keys are wrong, which is said when the tables are checked.
    """
    listed = tables.get("planetary")
    if not isinstance(listed, list) or len(listed) != 1:
        return None
    try:
        entry = PlanetaryEntry.model_validate(listed[0])
    except ValidationError:
        return None
    names = set(_gears_by_name(tables))
    if entry.planet in names or names.isdisjoint(entry.planet_names):
        return entry
    return None


def expanded(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables with gears and meshes of every planet.

    Meshes are in the order sun and planet 1, planet 1 and ring, sun and planet 2 and
    so on. Raises InputError where a gear is not there or others are.
    """
    entry = unexpanded(tables)
    if entry is None:
        return tables
    gears = _gears_by_name(tables)
    for key in ("sun", "planet", "ring"):
        if (name := getattr(entry, key)) not in gears:
            listed = ", ".join(gears)
            raise InputError(
                f'planetary: {key} = "{name}"; no such gear (gears: {listed})'
            )
    _require_alone(entry, tables)
    distance = _center_distance(entry, tables)
    meshes = list(_meshes(entry, tables["planetary"][0], _positions(entry, tables)))
    return tables | {
        "gear": list(_gears(entry, tables["gear"])),
        "mesh": [mesh | distance for mesh in meshes],
    }


def _gears_by_name(tables: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of gears, with defaults, that have a name."""
    gears = with_defaults(tables).get("gear")
    listed = gears if isinstance(gears, list) else []
    return {
        gear["name"]: gear
        for gear in listed
        if isinstance(gear, dict) and isinstance(gear.get("name"), str)
    }


def _require_alone(entry: PlanetaryEntry, tables: dict[str, Any]) -> None:
    """Require that the set has no other gears, meshes or shafts."""
    others = set(_gears_by_name(tables)) - {entry.sun, entry.planet, entry.ring}
    if others:
        name = min(others)
        raise InputError(
            f'planetary: gear "{name}" is neither sun, planet nor ring; a planetary '
            "set has no other gears"
        )
    for kind in ("mesh", "shaft"):
        if tables.get(kind):
            raise InputError(
                f"planetary: [[{kind}]] is not allowed beside it; meshes follow from "
                "it, their keys are in sun_mesh and ring_mesh"
            )


def _gears(entry: PlanetaryEntry, gears: list[Any]) -> Iterator[Any]:
    """All gears, the planet once for each of its names."""
    for gear in gears:
        if isinstance(gear, dict) and gear.get("name") == entry.planet:
            yield from (deepcopy(gear) | {"name": n} for n in entry.planet_names)
        else:
            yield gear


def _meshes(
    entry: PlanetaryEntry, table: dict[str, Any], positions: list[float]
) -> Iterator[dict[str, Any]]:
    """Both meshes of each planet; power passes from sun to ring or the reverse."""
    forward = sun_drives(entry.input, entry.held)
    for planet, position in zip(entry.planet_names, positions, strict=True):
        inward = math.remainder(position + 180.0, 360.0)
        outward = math.remainder(position, 360.0)
        ends = (entry.sun, planet, outward), (planet, entry.ring, inward)
        if not forward:
            ends = (planet, entry.sun, inward), (entry.ring, planet, outward)
        for (driver, driven, line), side in zip(ends, MESH_SIDES, strict=True):
            gears = {"driver": driver, "driven": driven, "center_line_deg": line}
            yield gears | deepcopy(table.get(side) or {})


def _number(gear: dict[str, Any], key: str) -> float | None:
    value = gear.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return value if math.isfinite(value) and value else None


def _center_distance(entry: PlanetaryEntry, tables: dict[str, Any]) -> dict[str, float]:
    """Centre distance, if not given of gears without profile shift; empty where a key
    is wrong."""
    if entry.center_distance_mm is not None:
        return {"center_distance_mm": entry.center_distance_mm}
    names = entry.sun, entry.planet, entry.ring
    gears = [_gears_by_name(tables)[name] for name in names]
    for gear in gears:
        for key in SHIFT_KEYS:
            if _number(gear, key):
                raise InputError(
                    f'planetary: center_distance_mm is needed; gear "{gear["name"]}" '
                    f"has {key}"
                )
    sun, planet, ring = (_number(gear, "teeth") for gear in gears)
    module = _transverse_module_mm(gears[0])
    if not (sun and planet and ring and module):
        return {}
    if ring != sun + 2 * planet:
        raise InputError(
            f"planetary: center_distance_mm is needed; teeth of the ring, {ring:g}, "
            f"are not those of the sun and twice those of the planet, "
            f"{sun + 2 * planet:g}"
        )
    return {"center_distance_mm": 0.5 * module * (sun + planet)}


def _transverse_module_mm(gear: dict[str, Any]) -> float | None:
    """Module by the key that states it; None where it or the helix angle is wrong."""
    stated = {key: _number(gear, key) for key in MODULE_KEYS if key in gear}
    helix_angle_deg = _number(gear, "helix_angle_deg") or 0.0
    if len(stated) != 1 or not 0.0 <= helix_angle_deg < 90.0:
        return None
    ((key, value),) = stated.items()
    if value is None:
        return None
    return restated(key, value, "transverse_module_mm", helix_angle_deg)


def _positions(entry: PlanetaryEntry, tables: dict[str, Any]) -> list[float]:
    """Positions of the planets [deg], exactly where teeth of all of them fit."""
    count = entry.planets
    positions = entry.positions_deg or [360.0 * n / count for n in range(count)]
    gears = _gears_by_name(tables)
    sun, ring = (_number(gears[name], "teeth") for name in (entry.sun, entry.ring))
    if not (sun and ring):
        return list(positions)
    first, step = positions[0], 360.0 / (sun + ring)
    steps = [(position - first) / step for position in positions]
    return [
        first + step * round(number)
        if abs(number - round(number)) < POSITION_TOLERANCE
        else position
        for number, position in zip(steps, positions, strict=True)
    ]
