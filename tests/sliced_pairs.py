"""A small spur or helical pair whose contact is in slices of the face width."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from conftest import make_gear, make_helical

from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.width.contact import WidthContact, slice_places
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import root_influence
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.wide_flank import (
    wide_flank,
    width_and_root_modes,
    width_modes,
)
from fegear.elasticity.wide_root import WideRoot
from meshes import GearPair, MeshSize

STEEL = PlaneMaterial(206e9, 0.3, "strain")
COARSE = MeshSize().refined(0.5)
WIDTH, TORQUE = 20e-3, 100.0
DEGREE, MESH = 4, MeshSize().refined(0.25)  # coarse
TEETH, HUBS = (25, 36), (15e-3, 20e-3)


@cache
def gears(helix_angle_deg):
    if helix_angle_deg == 0.0:
        return tuple(map(make_gear, TEETH, HUBS))
    return tuple(
        make_helical(z, hub, sign * helix_angle_deg)
        for z, hub, sign in zip(TEETH, HUBS, (1, -1), strict=True)
    )


@cache
def wide_flanks(helix_angle_deg):
    material = replace(STEEL, plane="width", width=WIDTH)
    return tuple(
        wide_flank(
            gear,
            cached_flank_compliance(gear, STEEL, COARSE),
            width_modes(gear, material, DEGREE, MESH),
            WIDTH,
        )
        for gear in gears(helix_angle_deg)
    )


@cache
def wide_roots(helix_angle_deg):
    material = replace(STEEL, plane="width", width=WIDTH)
    return tuple(
        WideRoot(
            root_influence(cyclic_sector(gear, STEEL, COARSE)),
            width_and_root_modes(gear, material, DEGREE, MESH)[1],
            WIDTH,
        )
        for gear in gears(helix_angle_deg)
    )


def problem(helix_angle_deg=0.0, gap=None, slices=16, width=WIDTH, **changes):
    pair = gears(helix_angle_deg)
    distance = sum(gear.reference_radius for gear in pair)
    flanks = [
        ContactFlank(compliance=cached_flank_compliance(gear, STEEL, COARSE))
        for gear in pair
    ]
    wide = wide_flanks(helix_angle_deg)
    gap = np.zeros(slices) if gap is None else gap(slice_places(width, slices))
    face = WidthContact(
        driver=wide[0], driven=wide[1], width=width, gap=gap, back_gap=gap
    )
    return ContactProblem(
        pair=GearPair(*pair, distance),
        driver=flanks[0],
        driven=flanks[1],
        face_width=width,
        solver=face,
        **changes,
    )


def slope(depth):
    return lambda z: depth * (0.5 + z / WIDTH)
