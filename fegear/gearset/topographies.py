"""From the keys of a topography to depths over a flank."""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset.modifications import MAX_TOPOGRAPHY_POINTS, FlankTopography
from fegear.gearset.problems import shown
from fegear.gearset.profiles import (
    DEVIATION,
    MAX_DEVIATION_UM,
    MAX_SLOPE,
    RANGE_RTOL,
    measured_column,
    measured_table,
)
from fegear.gearset.schema import MeshEntry, TopographyEntry
from fegear.gearset.zones import Zones, zones
from lumped.common.checks import format_number
from lumped.common.units import MM, UM
from meshes import GearPair
from meshes.gear import ceiled, floored

ROLL, PLACE = "roll_angle_deg", "place_mm"


def topographies_by_key(
    entry: MeshEntry, pair: GearPair, widths: tuple[float, float], folder: Path
) -> dict[str, FlankTopography | None]:
    """Both topographies of a mesh by their keys; InputError if one does not fit.

    widths : face widths of driver and driven gear [m]
    folder : where files with measured points lie
    """
    topographies: dict[str, FlankTopography | None] = {}
    for role, width in zip(("driver", "driven"), widths, strict=True):
        key = f"{role}_topography"
        of_gear = getattr(entry, key)
        where = f"{entry.label}: {key}"
        topographies[key] = (
            None
            if of_gear is None
            else _topography(of_gear, zones(pair, role), width, where, folder)
        )
    return topographies


def _topography(
    entry: TopographyEntry, flank: Zones, width: float, where: str, folder: Path
) -> FlankTopography | None:
    _require_depths(f"{where}.bias_um", np.array([entry.bias_um]), flank)
    points = _points(entry, where, folder)
    if points is not None:
        return _with_bias(_on_flank(*points, flank, width, where), entry, flank, width)
    if not entry.bias_um:
        return None
    ends = FlankTopography(
        roll_lengths=(flank.start, flank.tip),
        places=(-0.5 * width, 0.5 * width),
        depths=((0.0, 0.0), (0.0, 0.0)),
    )
    return _with_bias(ends, entry, flank, width)


def topography_keys(
    topography: FlankTopography, base_radius: float, decimals: int
) -> dict[str, Any]:
    """Keys of a gear-set file that give a topography.

    base_radius : of its gear, negative of an internal one [m]
    decimals : of angles [deg], places [mm] and depths [um]
    """
    angles = np.degrees(np.array(topography.roll_lengths) / base_radius)
    order = np.argsort(angles)
    places = np.array(topography.places) / MM
    depths = np.array(topography.depths)[order] / UM
    return {
        ROLL: angles[order].round(decimals).tolist(),
        PLACE: places.round(decimals).tolist(),
        "depth_um": depths.round(decimals).tolist(),
    }


Points = tuple[tuple[float, ...], tuple[float, ...], np.ndarray]  # deg, mm and um


def _points(entry: TopographyEntry, where: str, folder: Path) -> Points | None:
    """Roll angles (k,), places (l,) and depths (k, l) of the lists or of the file."""
    if entry.file is not None:
        return _points_of_file(entry.file, where, folder)
    if entry.roll_angle_deg is None or entry.place_mm is None or entry.depth_um is None:
        return None
    counts = len(entry.roll_angle_deg), len(entry.place_mm)
    if len(entry.depth_um) != counts[0]:
        raise InputError(
            f"{where}: depth_um has {len(entry.depth_um)} lists; must be {counts[0]}, "
            f"one for each {ROLL}"
        )
    for number, row in enumerate(entry.depth_um, 1):
        if len(row) != counts[1]:
            raise InputError(
                f"{where}: depth_um entry {number} has {len(row)} depths; must be "
                f"{counts[1]}, one for each {PLACE}"
            )
    return entry.roll_angle_deg, entry.place_mm, np.array(entry.depth_um)


def _points_of_file(name: str, where: str, folder: Path) -> Points:
    source = f"{where}.file = {shown(name)}"
    table = measured_table(name, source, folder)
    columns = (ROLL, PLACE, DEVIATION)
    if not set(columns) <= set(table.names):
        raise InputError(
            f"{source}; needs the columns {', '.join(columns)}, has "
            f"{', '.join(table.names)}"
        )
    rolls, places, deviations = (measured_column(table, name) for name in columns)
    depths: dict[tuple[float, float], float] = {}
    for line, roll, place, deviation in zip(
        table.rows, rolls, places, deviations, strict=True
    ):
        if (roll, place) in depths:
            raise InputError(f"{line}: {_stated(roll, place)} is there more than once")
        depths[roll, place] = -deviation
    grid_rolls, grid_places = tuple(sorted(set(rolls))), tuple(sorted(set(places)))
    for point in product(grid_rolls, grid_places):
        if point not in depths:
            raise InputError(
                f"{source}; has no point at {_stated(*point)}; must have one for each "
                f"of {len(grid_rolls)} roll angles at each of {len(grid_places)} places"
            )
    values = [[depths[roll, place] for place in grid_places] for roll in grid_rolls]
    return grid_rolls, grid_places, np.array(values)


def _stated(roll: float, place: float) -> str:
    return f"{ROLL} = {format_number(roll)}, {PLACE} = {format_number(place)}"


def _on_flank(
    rolls: tuple[float, ...],
    places: tuple[float, ...],
    depths: np.ndarray,
    flank: Zones,
    width: float,
    where: str,
) -> FlankTopography:
    """The topography of points [deg, mm, um], which must be on the flank."""
    half = 0.5 * width / MM
    low, high = sorted(
        map(flank.roll_angle_deg, (flank.gear.form_roll_length, flank.tip))
    )
    _require_points(f"{where}.{ROLL}", rolls, (low, high))
    _require_points(f"{where}.{PLACE}", places, (-half, half))
    _require_depths(f"{where}: depth", depths, flank)
    roll_lengths = np.radians(rolls) * flank.gear.base_radius
    for name, points, axis in (
        (ROLL, roll_lengths, 0),
        (PLACE, MM * np.array(places), 1),
    ):
        steps = np.diff(points)[:, None] if axis == 0 else np.diff(points)
        slope = float(np.abs(UM * np.diff(depths, axis=axis) / steps).max())
        if not slope <= MAX_SLOPE:
            raise InputError(
                f"{where}: depths change by {slope:.3g} of the way between two points "
                f"along {name}; must be at most {MAX_SLOPE:g}"
            )
    order = np.argsort(roll_lengths)  # those of internal gears are below zero
    return FlankTopography(
        roll_lengths=tuple(roll_lengths[order].tolist()),
        places=tuple(MM * place for place in places),
        depths=tuple(map(tuple, (UM * depths[order]).tolist())),
    )


def _require_points(
    name: str, points: tuple[float, ...], limits: tuple[float, float]
) -> None:
    """Require increasing points, within the flank but for what is rounded."""
    if not 2 <= len(points) <= MAX_TOPOGRAPHY_POINTS:
        raise InputError(
            f"{name} = {len(points)} values; must be 2 to {MAX_TOPOGRAPHY_POINTS}"
        )
    for before, point in pairwise(points):
        if not point > before:
            raise InputError(
                f"{name} = {format_number(point)}; must be above the one before, "
                f"{format_number(before)}"
            )
    tolerance = RANGE_RTOL * (limits[1] - limits[0])
    for point in points:
        if not limits[0] - tolerance <= point <= limits[1] + tolerance:
            raise InputError(
                f"{name} = {format_number(point)}; must be from {ceiled(limits[0])} "
                f"to {floored(limits[1])}, the ends of the flank"
            )


def _require_depths(name: str, depths: np.ndarray, flank: Zones) -> None:
    """Refuse depths [um] of more than half the module."""
    limit = 1e3 * flank.gear.module * MAX_DEVIATION_UM
    largest = float(depths.flat[np.abs(depths).argmax()])
    if not abs(largest) <= limit:
        raise InputError(
            f"{name} = {format_number(largest)} um; must be from -{floored(limit)} to "
            f"{floored(limit)} um, half the module"
        )


def _with_bias(
    topography: FlankTopography, entry: TopographyEntry, flank: Zones, width: float
) -> FlankTopography:
    """The topography with the twist, whose corners are ends of the active profile."""
    if not entry.bias_um:
        return topography
    rolls = np.union1d(topography.roll_lengths, (flank.start, flank.tip))
    places = np.union1d(topography.places, (-0.5 * width, 0.5 * width))
    way = 2.0 * (rolls - flank.start) / (flank.tip - flank.start) - 1.0
    twist = np.outer(np.clip(way, -1.0, 1.0), 2.0 * places / width)
    every = np.meshgrid(rolls, places, indexing="ij")
    depths = topography.depth(*map(np.ravel, every)).reshape(twist.shape)
    depths += 0.5 * entry.bias_um * UM * twist
    return FlankTopography(
        roll_lengths=tuple(rolls.tolist()),
        places=tuple(places.tolist()),
        depths=tuple(map(tuple, depths.tolist())),
    )
