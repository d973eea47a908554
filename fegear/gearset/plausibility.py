"""Values of a gear set that can be meant otherwise than they are written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from fegear.files.codes import with_code
from fegear.gearset.housing import housing_warnings
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.placing import layout
from meshes.internal import InternalGear
from meshes.pairing import BACKLASH_RTOL

if TYPE_CHECKING:
    from meshes import GearPair

# Values of solid materials, from soft plastics to tungsten carbide, by name: the factor
# to the unit of the gear-set file, lowest and highest value, and a likely mistake
PLAUSIBLE_RANGES = {
    "young_modulus": ("young_modulus_GPa", 1e-9, 0.1, 1000.0, "GPa, not MPa"),
    "poisson_ratio": ("poisson_ratio", 1.0, 0.1, 0.48, "without a unit"),
    "density": ("density_kg_per_m3", 1.0, 500.0, 20000.0, "kg/m3, not g/cm3"),
}
MIN_OVERLAP_MM = 1e-3
MAX_THINNING = 0.2  # of a measured tooth, to either side [modules]
TYPICAL_MESH_STIFFNESS = 2e10  # of steel teeth, per face width [N/m2], as in ISO 6336
MAX_RIGID_SHARE = 0.1
LENGTH_RTOL = 1e-9  # of diameters and places that are alike but for round-off
MAX_SHIFT = 1.5  # the same of its profile shift


def gear_set_warnings(gear_set: GearSet, joins_housing: bool = False) -> Iterator[str]:
    """A line for each value of a gear set that cannot be meant, each undercut that
    shortens a path of contact, and a housing that is left out.

    joins_housing : whether shafts are in the housing
    """
    for gear in gear_set.gears:
        yield from _material_warnings(gear)
        yield from _thickness_warnings(gear)
        yield from _spring_warnings(gear)
    yield from _thick_shaft_warnings(gear_set)
    yield from _overlap_warnings(gear_set)
    for number, mesh in enumerate(gear_set.meshes, start=1):
        yield from undercut_warnings(number, mesh.pair)
    yield from _backlash_warnings(gear_set)
    if not joins_housing:
        yield from housing_warnings(gear_set.housing)


def _thickness_warnings(gear: Gear) -> Iterator[str]:
    """What a measured tooth thickness leads to, where it is beyond that of gears."""
    teeth = gear.geometry
    if not gear.thickness_origin:
        return
    thinning = teeth.tooth_thinning / teeth.module  # both across the axis
    where = f'gear "{gear.name}": {gear.thickness_origin} gives'
    if abs(thinning) > MAX_THINNING:
        yield with_code(
            "W38",
            f"{where} tooth_thinning_um = {1e6 * teeth.tooth_thinning:.4g}, "
            f"{thinning:.3g} {teeth.section_name}modules; gears have "
            f"{-MAX_THINNING:g} to {MAX_THINNING:g}",
        )
    if abs(teeth.normal_profile_shift) > MAX_SHIFT:
        yield with_code(
            "W38",
            f"{where} profile_shift = {teeth.normal_profile_shift:.4g}; gears have "
            f"{-MAX_SHIFT:g} to {MAX_SHIFT:g}",
        )


def _material_warnings(gear: Gear) -> Iterator[str]:
    for name, (key, factor, lowest, highest, hint) in PLAUSIBLE_RANGES.items():
        value = factor * getattr(gear, name)
        if not lowest <= value <= highest:
            yield with_code(
                "W34",
                f'gear "{gear.name}": {key} = {value:.6g} is outside {lowest:g} to '
                f"{highest:g}, which materials of gears have; the unit is {hint}",
            )


def _spring_warnings(gear: Gear) -> Iterator[str]:
    """A ring on springs that moves as a rigid body as its teeth deflect."""
    teeth = gear.geometry
    if not (isinstance(teeth, InternalGear) and teeth.foundation):
        return
    springs, radius = teeth.foundation, teeth.outer_radius
    compliance = 1.0 / springs.translation(radius)
    compliance += teeth.base_radius**2 / springs.rotation(radius)
    if (share := compliance * TYPICAL_MESH_STIFFNESS) > MAX_RIGID_SHARE:
        yield with_code(
            "W40",
            f'gear "{gear.name}": on its springs it moves as a rigid body by '
            f"{share:.2g} times the deflection of a usual mesh; its inertia in that "
            "motion is part of the coupled model and of fidelity reduced alone",
        )


def _thick_shaft_warnings(gear_set: GearSet) -> Iterator[str]:
    """External gears whose teeth would be in the section of the shaft that bears them.

    Sections that end at a face of the gear are beside it.
    """
    for number, shaft in enumerate(gear_set.shafts, start=1):
        if shaft.body is None:
            continue
        ends = np.concatenate([[0.0], np.cumsum(shaft.body.lengths)])
        for index, position in zip(shaft.gears, shaft.body.gear_positions, strict=True):
            gear = gear_set.gears[index]
            reach = 0.5 * gear.face_width - LENGTH_RTOL * ends[-1]
            is_under = (ends[1:] > position - reach) & (ends[:-1] < position + reach)
            diameter = float(np.max(shaft.body.diameters, where=is_under, initial=0.0))
            root = 2.0 * gear.geometry.root_radius
            if gear.geometry.sign > 0 and diameter > root * (1.0 + LENGTH_RTOL):
                yield with_code(
                    "W71",
                    f"shaft {number}: diameters_mm = {1e3 * diameter:.6g} under gear "
                    f'"{gear.name}" is above its root diameter, {1e3 * root:.6g} mm',
                )


def _overlap_warnings(gear_set: GearSet) -> Iterator[str]:
    """Gears in one plane that do not mesh and are over each other.

    Gears that are connected by meshes are in one plane. How far others are behind them
    on shafts is not part of a gear set, so that nothing is said about those.
    """
    if all(mesh.center_line is None for mesh in gear_set.meshes):
        return  # places in a row are those of drawings alone
    places, meshing_pairs = (
        layout(gear_set).places,
        {frozenset(m.gears) for m in gear_set.meshes},
    )
    for group in _gears_by_plane(gear_set):
        for first, second in combinations(sorted(group), 2):
            if {first, second} in meshing_pairs:
                continue
            gears = gear_set.gears[first], gear_set.gears[second]
            first_place, second_place = places[first], places[second]
            distance = math.hypot(
                first_place.x - second_place.x, first_place.y - second_place.y
            )
            sum_of_tip_radii = sum(gear.geometry.tip_radius for gear in gears)
            overlap = 1e3 * (sum_of_tip_radii - distance)
            if overlap > MIN_OVERLAP_MM:
                yield with_code(
                    "W35",
                    f'gears "{gears[0].name}" and "{gears[1].name}" do not mesh and '
                    f"overlap by {overlap:.4g} mm in their plane; check "
                    "center_line_deg",
                )


def undercut_warnings(number: int, pair: GearPair) -> Iterator[str]:
    """A line for each gear whose undercut shortens the path of contact of a mesh.

    number : of the mesh, from 1
    """
    for role, gear, mate in (
        ("driver", pair.driver, pair.driven),
        ("driven gear", pair.driven, pair.driver),
    ):
        mate_start = pair.line_of_action - mate.tip_roll_length
        if not gear.is_undercut or mate_start >= gear.form_roll_length:
            continue
        lost_ratio = (gear.form_roll_length - mate_start) / pair.base_pitch
        yield with_code(
            "W27",
            f"mesh {number}: the tip circle of the mate reaches below the form circle "
            f"of the undercut {role} ({gear.teeth} teeth); contact ratio "
            f"{pair.contact_ratio:.4g}, {lost_ratio:.3g} less than without "
            "undercut",
        )


def _backlash_warnings(gear_set: GearSet) -> Iterator[str]:
    """A line for the meshes whose teeth jam."""
    jammed_meshes = [
        n for n, mesh in enumerate(gear_set.meshes, 1) if not mesh.backlash > 0.0
    ]
    if jammed_meshes:
        where = "mesh " if len(jammed_meshes) == 1 else "meshes "
        where += ", ".join(map(str, jammed_meshes))
        jam_text = "no backlash, the teeth jam in motion; set backlash_um, or"
        keys = "center_distance_mm and tooth_thinning_um"
        yield with_code("W55", f"{where}: {jam_text} {keys}{_rounded_away(gear_set)}")


def _rounded_away(gear_set: GearSet) -> str:
    """Backlashes that are none by the rounding of the sizes alone, in words."""
    lacking = [
        f"mesh {number}: {1e6 * mesh.pair.backlash_of_sizes:.4g} um by the sizes, "
        f"whose rounding explains up to {1e6 * mesh.pair.rounding:.2g} um"
        for number, mesh in enumerate(gear_set.meshes, start=1)
        if mesh.backlash == 0.0
        and mesh.pair.backlash_of_sizes < -BACKLASH_RTOL * mesh.pair.base_pitch
    ]
    return f" ({'; '.join(lacking)})" if lacking else ""


def _gears_by_plane(gear_set: GearSet) -> list[set[int]]:
    """Gears that are connected by meshes, by index."""
    planes: list[set[int]] = []
    for mesh in gear_set.meshes:
        joined_gears = {*mesh.gears}
        for plane in [plane for plane in planes if plane & joined_gears]:
            planes.remove(plane)
            joined_gears |= plane
        planes.append(joined_gears)
    return planes
