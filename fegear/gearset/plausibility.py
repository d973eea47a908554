"""Values of a gear set that can be meant otherwise than they are written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from fegear.files.codes import with_code
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.placing import layout

# Values of solid materials, from soft plastics to tungsten carbide, by name: the factor
# to the unit of the gear-set file, lowest and highest value, and a likely mistake
PLAUSIBLE = {
    "young_modulus": ("young_modulus_GPa", 1e-9, 0.1, 1000.0, "GPa, not MPa"),
    "poisson_ratio": ("poisson_ratio", 1.0, 0.1, 0.48, "without a unit"),
    "density": ("density_kg_per_m3", 1.0, 500.0, 20000.0, "kg/m3, not g/cm3"),
}
MIN_OVERLAP_MM = 1e-3


def gear_set_warnings(gear_set: GearSet) -> Iterator[str]:
    """A line for each material value and each place of a gear that cannot be meant."""
    for gear in gear_set.gears:
        yield from _material_warnings(gear)
    yield from _overlap_warnings(gear_set)


def _material_warnings(gear: Gear) -> Iterator[str]:
    for name, (key, factor, least, most, hint) in PLAUSIBLE.items():
        value = factor * getattr(gear, name)
        if not least <= value <= most:
            yield with_code(
                "W34",
                f'gear "{gear.name}": {key} = {value:.6g} is outside {least:g} to '
                f"{most:g}, which materials of gears have; the unit is {hint}",
            )


def _overlap_warnings(gear_set: GearSet) -> Iterator[str]:
    """Gears in one plane that do not mesh and are over each other.

    Gears that are connected by meshes are in one plane. How far others are behind them
    on shafts is not part of a gear set, so that nothing is said about those.
    """
    if all(mesh.center_line is None for mesh in gear_set.meshes):
        return  # places in a row are those of drawings alone
    places, pairs = (
        layout(gear_set).places,
        {frozenset(m.gears) for m in gear_set.meshes},
    )
    for group in _planes(gear_set):
        for first, second in combinations(sorted(group), 2):
            if {first, second} in pairs:
                continue
            gears = gear_set.gears[first], gear_set.gears[second]
            one, other = places[first], places[second]
            distance = math.hypot(one.x - other.x, one.y - other.y)
            reach = sum(gear.geometry.tip_radius for gear in gears)
            overlap = 1e3 * (reach - distance)
            if overlap > MIN_OVERLAP_MM:
                yield with_code(
                    "W35",
                    f'gears "{gears[0].name}" and "{gears[1].name}" do not mesh and '
                    f"overlap by {overlap:.4g} mm in their plane; check "
                    "center_line_deg",
                )


def _planes(gear_set: GearSet) -> list[set[int]]:
    """Gears that are connected by meshes, by index."""
    planes: list[set[int]] = []
    for mesh in gear_set.meshes:
        joined = {*mesh.gears}
        for plane in [plane for plane in planes if plane & joined]:
            planes.remove(plane)
            joined |= plane
        planes.append(joined)
    return planes
