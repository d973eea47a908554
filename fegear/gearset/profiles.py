"""From the keys of a profile modification to the deviations of a flank."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from fegear.files.errors import InputError
from fegear.files.keys import unit_of_key
from fegear.files.output import read_text
from fegear.gearset.modifications import MAX_PROFILE_POINTS, FlankProfile
from fegear.gearset.problems import shown
from fegear.gearset.refusals import KeyOf
from fegear.gearset.schema import POINT_KEYS, ProfileEntry
from fegear.gearset.zones import Zones, zones
from lumped.common.checks import format_number
from lumped.common.csv_text import CsvText, TableError, parse_csv
from lumped.common.units import UM
from meshes import GearPair
from meshes.gear import Bound, ceiled, floored

DEVIATION = "deviation_um"
MAX_DEVIATION_UM = 500.0  # per mm of the module: half the module, as of pitch errors
MAX_SLOPE = 0.2  # between measured points, deviation over roll length
RANGE_RTOL = 1e-6  # of a flank, by which rounded points may lie outside


def flank_profile(
    entry: ProfileEntry | None, pair: GearPair, role: str, key_of: KeyOf, folder: Path
) -> FlankProfile | None:
    """The profile of the "driver" or "driven" gear; InputError if it does not fit.

    folder : where a file with measured points lies
    """
    if entry is None:
        return None
    flank, where = zones(pair, role), key_of.text
    limit = 1e3 * flank.gear.module * MAX_DEVIATION_UM
    for key in ("crowning_um", "slope_um"):
        _require_size(f"{where}.{key}", getattr(entry, key), limit)
    points = replace(_points_of_entry(entry, where, folder), gear=f" of {key_of.gear}")
    if entry.file is None:
        points = replace(points, key_of=key_of)
    rolls, deviations = convert_measured_points(points, flank, where)
    if not (entry.crowning_um or entry.slope_um or rolls):
        return None
    return FlankProfile(
        crowning=entry.crowning_um * UM,
        slope=entry.slope_um * UM,
        roll_lengths=rolls,
        deviations=deviations,
        interpolation=entry.interpolation,
    )


@dataclass(frozen=True)
class MeasuredPoints:
    """Points of a flank as a file gives them.

    key : of the points, `roll_angle_deg` or `diameter_mm`
    places : how messages name each point, with a field `key`
    column : of the deviations
    gear : whose flank it is, after the names of its ends in messages
    key_of : table that has the points in a list, None for those of a file
    """

    key: str
    points: Sequence[float]
    deviations: Sequence[float]
    places: Sequence[str]
    column: str = DEVIATION
    gear: str = ""
    key_of: KeyOf | None = None


def convert_measured_points(
    table: MeasuredPoints, flank: Zones, where: str
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Roll lengths [m], increasing, and deviations [m] of points that fit the flank."""
    key, points, deviations = table.key, table.points, table.deviations
    places = table.places
    if len(points) != len(deviations):
        raise InputError(
            f"{where}: {key} has {len(points)} entries and {table.column} "
            f"{len(deviations)}; as many are needed"
        )
    limit = 1e3 * flank.gear.module * MAX_DEVIATION_UM
    for place, deviation in zip(places, deviations, strict=True):
        _require_size(place.format(key=table.column), deviation, limit)
    _require_order(key, points, places, where)
    rolls = _roll_lengths(table, flank)
    if flank.gear.sign < 0:  # whose flank has its tip at the least radius
        rolls, deviations, places = rolls[::-1], deviations[::-1], places[::-1]
    _require_gentle_slopes(
        rolls, deviations, [p.format(key=table.column) for p in places]
    )
    return rolls, tuple(deviation * UM for deviation in deviations)


def _points_of_entry(entry: ProfileEntry, where: str, folder: Path) -> MeasuredPoints:
    """Measured points of the lists or of the file."""
    if entry.file is not None:
        return _points_of_file(entry.file, where, folder)
    key = next(iter(entry.present(*POINT_KEYS)), POINT_KEYS[0])
    points, deviations = getattr(entry, key) or (), entry.deviation_um or ()
    places = [f"{where}.{{key}} entry {i + 1}" for i in range(len(deviations))]
    return MeasuredPoints(key, points, deviations, places)


def _points_of_file(name: str, where: str, folder: Path) -> MeasuredPoints:
    source = f"{where}.file = {shown(name)}"
    table = measured_table(name, source, folder)
    keys = [key for key in POINT_KEYS if key in table.names]
    if len(keys) != 1 or DEVIATION not in table.names:
        raise InputError(
            f"{source}; needs the columns {DEVIATION} and one of "
            f"{', '.join(POINT_KEYS)}, has {', '.join(table.names)}"
        )
    points, deviations = (
        measured_column(table, column) for column in (keys[0], DEVIATION)
    )
    places = [
        place.replace("{", "{{").replace("}", "}}") + ": {key}" for place in table.rows
    ]
    return MeasuredPoints(keys[0], points, deviations, places)


def measured_table(name: str, source: str, folder: Path) -> CsvText:
    """The CSV file that the measured points of a flank are in.

    source : what messages begin with
    """
    try:
        return parse_csv(read_text(folder / name), source)
    except InputError as error:
        reason = str(error).removeprefix(f"{folder / name}: ")
        raise InputError(f"{source}; {reason}") from None
    except TableError as error:
        raise InputError(str(error)) from None


def measured_column(table: CsvText, name: str) -> list[float]:
    """A column of finite numbers."""
    index = table.names.index(name)
    return [
        _finite_number(row[index], name, place) for place, row in table.rows.items()
    ]


def _finite_number(cell: str, column: str, place: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{place}: {column} = {shown(cell)}; must be a finite number")
    return value


def _require_size(name: str, value: float, limit: float) -> None:
    if not abs(value) <= limit:
        raise InputError(
            f"{name} = {format_number(value)}; must be from -{floored(limit)} to "
            f"{floored(limit)}, "
            "half the module"
        )


def _require_order(
    key: str, points: Sequence[float], places: Sequence[str], where: str
) -> None:
    if places and not 2 <= len(points) <= MAX_PROFILE_POINTS:
        raise InputError(
            f"{where}: {len(points)} measured points; 2 to {MAX_PROFILE_POINTS} are "
            "needed"
        )
    for place, (point_before, point) in zip(places[1:], pairwise(points), strict=True):
        if not point > point_before:
            raise InputError(
                f"{place.format(key=key)} = {format_number(point)}; must be above the "
                "one before, "
                f"{format_number(point_before)}"
            )


def _roll_lengths(table: MeasuredPoints, flank: Zones) -> tuple[float, ...]:
    """Roll lengths [m] of measured points, which must be on the flank."""
    gear, key, points = flank.gear, table.key, table.points
    base_radius, form_roll_length, tip_roll_length = (
        gear.base_radius,
        gear.form_roll_length,
        flank.tip,
    )
    ends = (form_roll_length, "form circle"), (tip_roll_length, "tip")
    if key == "diameter_mm":
        limits = sorted((2e3 * math.hypot(base_radius, s), end) for s, end in ends)
    else:
        limits = sorted((flank.roll_angle_deg(s), end) for s, end in ends)
    (least_value, least_name), (most_value, most_name) = limits
    tolerance = RANGE_RTOL * (most_value - least_value)
    for index, (place, point) in enumerate(zip(table.places, points, strict=True)):
        if least_value - tolerance <= point <= most_value + tolerance:
            continue
        if table.key_of is not None:
            bound = Bound("at least", least_value, f"the {least_name}{table.gear}")
            if point > most_value:
                bound = Bound("at most", most_value, f"the {most_name}{table.gear}")
            raise table.key_of.refusal(key, bound, unit_of_key(key), index)
        raise InputError(
            f"{place.format(key=key)} = {format_number(point)}; must be from "
            f"{ceiled(least_value)} to {floored(most_value)}, {least_name} and "
            f"{most_name}{table.gear}"
        )
    if key == "diameter_mm":
        radii = [5e-4 * point for point in points]
        return tuple(
            gear.sign * math.sqrt(max(0.0, r * r - base_radius * base_radius))
            for r in radii
        )
    return tuple(math.radians(point) * base_radius for point in points)


def _require_gentle_slopes(
    rolls: Sequence[float], deviations: Sequence[float], places: Sequence[str]
) -> None:
    """Require slopes at which the normal of the flank hardly turns."""
    steps = zip(places[1:], pairwise(rolls), pairwise(deviations), strict=True)
    for place, (start, end), (deviation_before, deviation_after) in steps:
        slope = abs(deviation_after - deviation_before) * UM / (end - start)
        if not slope <= MAX_SLOPE:
            raise InputError(
                f"{place} = {deviation_after:g}; changes by {slope:.3g} of "
                f"the roll length from the point before, at most {MAX_SLOPE:g}"
            )
